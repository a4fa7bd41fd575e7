"""Says where a mark is lost with a file that is still as the course handed it out."""

from __future__ import annotations

import posixpath
from collections.abc import Collection, Iterator
from pathlib import PurePosixPath

from grader.model.package import PackageFacts
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, Status
from grader.rubric.load import names_in
from grader.rubric.model import Criterion, Rubric
from grader.wording import join_words

CPP = frozenset({".cpp", ".cc", ".cxx"})


def tell_unchanged(
    result: CriterionResult, rubric: Rubric, package: PackageFacts, handed_out: Collection[str]
) -> CriterionResult:
    """Return the criterion; where it is lost, with those of its files whose sha256 is among `handed_out`.

    Its files are those that it cites or its parameters name, and the programs of its run.
    """
    if result.status not in {Status.FAIL, Status.PARTIAL} or not handed_out:
        return result
    criterion = next(c for c in rubric.criteria if c.id == result.id)
    cited = {one.file for one in result.citations if isinstance(one, FileCitation)}
    names = names_in(criterion).union(_programs(criterion, rubric, package))
    own = rubric.package_of(criterion) if rubric.package_of(criterion) != rubric.package else ""
    unchanged = [
        path
        for one in (package, *package.also)
        for file in one.files
        if file.sha256 in handed_out
        and (
            (path := posixpath.normpath(f"{package.way_to(one)}/{file.path}")) in cited
            or (_is_named(path, names) and one.asked == own)
        )
    ]
    if not unchanged:
        return result
    verb, them = ("is", "it") if len(unchanged) == 1 else ("are", "them")
    told = f"{join_words(unchanged)} {verb} still as the course handed {them} out"
    return result.model_copy(update={"message": f"{result.message}; {told}"})


def _is_named(path: str, names: Collection[str]) -> bool:
    """A program in C++ is named without its suffix."""
    file = PurePosixPath(path)
    return file.name in names or (file.suffix in CPP and file.stem in names)


def _programs(criterion: Criterion, rubric: Rubric, package: PackageFacts) -> Iterator[str]:
    """Yield the names of the student's programs in the criterion's run: of its process, where it judges one."""
    scenario = rubric.scenarios.get(criterion.scenario or "")
    starts = scenario.start if scenario is not None else ()
    process = criterion.parameters.get("process")
    for start in [one for one in starts if one.name == process] or starts:
        if start.script is not None:
            yield PurePosixPath(start.script).name
        for launch in (file for one in (package, *package.also) for file in one.launch_files):
            if (
                start.launch is not None
                and PurePosixPath(launch.path).name == PurePosixPath(start.launch).name
            ):
                names = {one.name for one in (package, *package.also)}
                yield from (node.type for node in launch.brings if node.pkg in names and node.type)
