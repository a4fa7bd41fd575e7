"""The list of formats: what the grader writes or reads, and which version of it.

A format's version is in `grader/model/version.py`. It is raised when a reader that does not know of a change would take
a status or a point for another than it is, or could not read the file: a key is gone, means something else, has another
type, or one of a fixed set of words is new. What a reader may pass over is listed here as an `Addition`: an optional
key, with a default that says what a file without it means. A test compares the records with the schemas in
`docs/reference/` and fails where a change is neither.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from grader.model import version
from grader.model.version import Versioned


@dataclass(frozen=True)
class Addition:
    """`key` (`Record.key`, or a metadata key), added to a version; `what` says what a file without it means."""

    version: int
    key: str
    what: str


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file. `by` says who writes it: unknown keys of a grader are ignored, those of a person are faults.

    For the reference page: `where` the file is, where it `says` its version, and what happens with a `newer` one.
    """

    is_: Versioned
    title: str
    where: str
    by: Literal["grader", "person"]
    says: str
    newer: str
    additions: tuple[Addition, ...] = ()

    @property
    def name(self) -> str:
        """The name that `grader schema` takes: `result`."""
        return self.is_.short


_UNREADABLE = "exit code 3"
_FAULT = "exit code 2, with file and line"

FORMATS: dict[str, Format] = {
    one.name: one
    for one in (
        Format(
            is_=version.RESULT,
            title="Result",
            where="`<out>/<submission>/result.json`, and each line of `results.jsonl` (with `roster` beside it)",
            by="grader",
            says="`schema`",
            newer=f"{_UNREADABLE}; in a class, before anything is written",
            additions=(
                Addition(1, "SubmissionInfo.name", "no roster gave a name"),
                Addition(1, "GradingResult.rubric_origin", "it is not known where the rubric came from"),
            ),
        ),
        Format(
            is_=version.EVIDENCE,
            title="Evidence",
            where="`<out>/<submission>/evidence/*.mcap`",
            by="grader",
            says="`format` in the metadata record `grader.evidence`, as a number",
            newer=_UNREADABLE,
        ),
        Format(
            is_=version.RUBRIC,
            title="Rubric",
            where="`rubrics/<lab>.yaml`, and every file that is given with `--rubric`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_FAULT,
        ),
        Format(
            is_=version.OVERRIDES,
            title="Overrides",
            where="`<out>/overrides.yaml`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_FAULT,
        ),
        Format(
            is_=version.COMMENTS,
            title="Comments",
            where="`<out>/comments.yaml`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_FAULT,
        ),
        Format(
            is_=version.RUN,
            title="Run of a class",
            where="`<out>/run.json`",
            by="grader",
            says="`schema`",
            newer="exit code 2",
        ),
        Format(
            is_=version.PUBLISHED,
            title="Published results",
            where="each line of `<out>/published.jsonl`",
            by="grader",
            says="`schema`",
            newer="exit code 2",
        ),
        Format(
            is_=version.SENT,
            title="Sent feedback",
            where="each line of `<out>/sent.jsonl`",
            by="grader",
            says="`schema`",
            newer="exit code 2",
        ),
        Format(
            is_=version.COURSE,
            title="Course",
            where="`course.yaml`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_FAULT,
        ),
        Format(
            is_=version.SIMILARITY,
            title="Similarity",
            where="`<out>/similarity.json`",
            by="grader",
            says="`schema`",
            newer="the grader does not read it again",
        ),
        Format(
            is_=version.MUTANTS,
            title="Mutants of a lab",
            where="`fixtures/<lab>.yaml`, and `mutants/<lab>.yaml` beside a rubric of your own",
            by="person",
            says="`schema`, which has to be there",
            newer=_FAULT,
        ),
        Format(
            is_=version.RUBRIC_TEST,
            title="Test of a rubric",
            where="what `grader rubric test --json` prints",
            by="grader",
            says="`schema`",
            newer="the grader does not read it again",
        ),
    )
}
