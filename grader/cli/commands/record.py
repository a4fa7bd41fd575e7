"""`grader record SOURCE --out DIR`: evidence without a judgement."""

from __future__ import annotations

import re
from pathlib import Path

from grader import pipeline
from grader.arena.sandbox import Mode
from grader.cli.display import open_progress
from grader.cli.output import say
from grader.cli.host_support import say_unwalled
from grader.cli.select_rubric import only_package
from grader.errors import ExitCode, UsageError
from grader.files import check_writable
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.model import Criterion, Rubric, Scenario, Start, Until

MAX_SECONDS = 3600


def run(
    *,
    source: str,
    out: Path,
    rubric: str | None = None,
    package: str | None = None,
    script: list[str],
    launch: list[str],
    seconds: float = 10.0,
    sandbox: Mode = "auto",
) -> ExitCode:
    """Record the rubric's scenarios, or one made of the scripts and launch files that are named."""
    if rubric is not None and (script or launch):
        raise UsageError("give --rubric, or --script and --launch, not both")
    if rubric is None and not (script or launch):
        raise UsageError("nothing to run", hint="give --rubric, or --script FILE, or --launch FILE")
    loaded = (
        load_rubric(rubric) if rubric else made_up(package or only_package(source), script, launch, seconds)
    )
    check_writable(out)
    options = pipeline.GradeOptions(sandbox=sandbox, submission_id=None, static_only=False, keep_hidden=True)
    say_unwalled(sandbox)
    with open_progress() as progress:
        files = pipeline.record(source, loaded, out, options, progress)
    for file in files:
        say(str(file))
    return ExitCode.PASSED


def made_up(package: str, scripts: list[str], launches: list[str], seconds: float) -> LoadedRubric:
    """A rubric that only says what to run and for how long; its criterion is never judged."""
    if not 0 < seconds <= MAX_SECONDS:
        raise UsageError(f"--seconds must be more than 0 and at most {MAX_SECONDS}, not {seconds:g}")
    starts = [Start(name=_name(i, file), script=file) for i, file in enumerate(scripts, 1)]
    starts += [Start(name=_name(i, file), launch=file) for i, file in enumerate(launches, len(starts) + 1)]
    until = Until(limit_s=seconds, first_message_s=seconds, silent_s=seconds, messages={})
    scenario = Scenario(title="As asked on the command line", start=tuple(starts), until=until)
    criterion = Criterion.model_validate(
        {"id": "recorded", "title": "Recorded", "points": 0, "check": "none", "scenario": "record"}
    )
    made = {
        "schema": "grader.rubric/1",
        "id": "record",
        "title": "Recording",
        "version": "0",
        "package": package,
    }
    rubric = Rubric.model_validate({**made, "scenarios": {"record": scenario}, "criteria": (criterion,)})
    return LoadedRubric(rubric=rubric, path=Path(), digest="")


def _name(number: int, file: str) -> str:
    """A start's name, told apart by its number: `p1-numeric-talker`."""
    stem = re.sub(r"[^a-z0-9]+", "-", Path(file).stem.lower()).strip("-")
    return f"p{number}-{stem}".rstrip("-")
