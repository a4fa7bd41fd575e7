"""The steps that `grader/pipeline.py` names, each in a module of what it gives."""

from grader.steps.aside import run_aside
from grader.steps.children import waited_for
from grader.steps.judged import Judged, figures_of, judged_again, judged_recording
from grader.steps.opened import about, opened
from grader.steps.options import GradeOptions
from grader.steps.outcome import NOTHING_TOOK, Clock, console_log, outcome
from grader.steps.recorded import keep_scenarios, loaded_meanwhile, read_facts, recorded_and_judged, recorder

__all__ = [
    "NOTHING_TOOK",
    "Clock",
    "GradeOptions",
    "Judged",
    "about",
    "console_log",
    "figures_of",
    "judged_again",
    "judged_recording",
    "keep_scenarios",
    "loaded_meanwhile",
    "opened",
    "outcome",
    "read_facts",
    "recorded_and_judged",
    "recorder",
    "run_aside",
    "waited_for",
]
