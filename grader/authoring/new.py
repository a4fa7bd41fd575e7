"""`grader rubric new`: two looks at a correct package, then a proposal."""

from __future__ import annotations

from pathlib import Path

from grader import pipeline
from grader.authoring.discover import find_parts, first_look, second_look
from grader.authoring.observe import observe
from grader.authoring.propose import Proposal
from grader.authoring.text import rubric_text
from grader.errors import RosMissing, SubmissionError
from grader.evidence.reader import load_evidence, package_facts
from grader.evidence.run import Run
from grader.files import temporary_folder
from grader.intake import open_submission
from grader.model.package import PackageFacts
from grader.model.progress import Progress
from grader.package import read_package
from grader.rubric.load import LoadedRubric


def propose_rubric(
    source: str, package: str, rubric_id: str, options: pipeline.GradeOptions, progress: Progress
) -> str:
    """The text of a rubric for the correct package that `source` holds.

    Raises GraderError: SubmissionError where nothing of it can be run, RosMissing without ROS.
    """
    with temporary_folder("new") as folder:
        submission = open_submission(source, package=package, workdir=folder / "source")
        facts = read_package(submission.package)
        parts = find_parts(submission.package.folder, facts)
        if not parts.nodes and not parts.launches:
            raise SubmissionError(
                f"{package} has no node and no launch file", hint="name a finished solution"
            )
        runs = _look(source, first_look(package, parts), folder / "first", options, progress)
        seen = {name: observe(runs[name]) for name in (*parts.nodes, *parts.launches)}
        again = second_look(package, parts, seen)
        if again is not None:
            runs |= _look(source, again, folder / "second", options, progress)
        known = _facts(runs, facts)
        proposal = Proposal(known, parts, seen, runs)
        return rubric_text(package, rubric_id, proposal.scenarios, proposal.criteria, proposal.notes)


def _look(
    source: str, rubric: LoadedRubric, out: Path, options: pipeline.GradeOptions, progress: Progress
) -> dict[str, Run]:
    """Record, and read back. Raises RosMissing where nothing could be run."""
    runs = load_evidence(pipeline.record(source, rubric, out, options, progress))
    missing = [name for name in rubric.rubric.scenarios if name not in runs]
    if missing:
        reason = runs["package"].metadata.get("not_run", "")
        raise RosMissing(f"nothing was run{': ' + reason if reason else ''}", hint="grader doctor")
    return runs


def _facts(runs: dict[str, Run], facts: PackageFacts) -> PackageFacts:
    """With what the build said of CMakeLists.txt, where it was recorded."""
    return package_facts(runs["package"]) if "package" in runs else facts
