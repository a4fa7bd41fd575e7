"""The list of formats. Whoever changes a record that is written adds here what changed, or a test fails.

A format's version is in `grader/model/version.py`. It is raised, with a `Change` here, when a reader that does not know
of the change would take a status or a point for another than it is, or could not read the file: a key is gone, means
something else, has another type, or one of a fixed set of words is new. What a reader may pass over is an `Addition`:
an optional key, with a default that says what a file without it meant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from grader.model import version
from grader.model.version import Versioned


@dataclass(frozen=True)
class Change:
    """A version: what is different in it."""

    version: int
    what: str


@dataclass(frozen=True)
class Addition:
    """`key` (`Record.key`, or a metadata key) came into version `version` later; files from before do not have it."""

    version: int
    key: str
    what: str


@dataclass(frozen=True, kw_only=True)
class Format:
    """`by` says who writes it: a grader's unknown keys are passed over, a person's are faults with their line."""

    is_: Versioned
    title: str
    where: str
    by: Literal["grader", "person"]
    says: str
    newer: str
    changes: tuple[Change, ...]
    additions: tuple[Addition, ...] = ()

    @property
    def name(self) -> str:
        """`result`, as `grader schema` takes it."""
        return self.is_.short


FIRST = (Change(1, "The first."),)
_READ = "exit code 3"
_WRONG = "exit code 2, with file and line"

FORMATS: dict[str, Format] = {
    one.name: one
    for one in (
        Format(
            is_=version.RESULT,
            title="Result",
            where="`<out>/<submission>/result.json`, and each line of `results.jsonl` (with `roster` beside it)",
            by="grader",
            says="`schema`",
            newer=f"{_READ}; in a class, before anything is written",
            changes=FIRST,
            additions=(
                Addition(1, "GradingResult.notes", "Nothing was noticed."),
                Addition(1, "GradingResult.overrides", "Nobody decided anything."),
                Addition(1, "GradingResult.handed_in", "Nobody said when it was handed in."),
                Addition(1, "GradingResult.late", "There was no deadline."),
                Addition(1, "GradingResult.standing", "Nobody looked at what is committed."),
            ),
        ),
        Format(
            is_=version.EVIDENCE,
            title="Evidence",
            where="`<out>/<submission>/evidence/*.mcap`",
            by="grader",
            says="`format` in the metadata record `grader.evidence`, as a number",
            newer=_READ,
            changes=FIRST,
            additions=(
                Addition(1, "GraphEvent.processes", "Nodes are told from the grader's by their names alone."),
                Addition(1, "GraphEvent.service_types", "Types of services are not known."),
                Addition(1, "HostEvent.busy", "How busy the processors were is not known."),
                Addition(
                    1, "HostEvent.own_busy", "How much of it the run's own processes took is not known."
                ),
                Addition(1, "LaunchNode.file", "It stands in the launch file itself."),
                Addition(1, "LaunchNode.namespace", "It is in no namespace."),
                Addition(1, "LaunchNode.machine", "Not given."),
                Addition(1, "LaunchNode.respawn", "Not given."),
                Addition(1, "LaunchNode.required", "Not given."),
                Addition(1, "LaunchNode.uncertain", "It counts."),
                Addition(1, "LaunchFile.brings", "Includes were not followed."),
                Addition(1, "LaunchFile.tests", "As above."),
                Addition(1, "LaunchFile.params", "As above."),
                Addition(1, "LaunchFile.loads", "As above."),
                Addition(1, "LaunchFile.include_faults", "As above."),
                Addition(1, "LaunchFile.unknown_tags", "As above."),
                Addition(1, "metadata scenario.digest", "The scenario is taken to be the rubric's of today."),
                Addition(1, "metadata recording.missing", "Nothing was to be handed in as a recording."),
                Addition(1, "metadata recording.problem", "As above."),
                Addition(
                    1, "topic /grader/calibration", "How late the machine was is told by its timer alone."
                ),
            ),
        ),
        Format(
            is_=version.RUBRIC,
            title="Rubric",
            where="`rubrics/<lab>.yaml`, and every file that is given with `--rubric`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_WRONG,
            changes=FIRST,
        ),
        Format(
            is_=version.OVERRIDES,
            title="Overrides",
            where="`<out>/overrides.yaml`",
            by="person",
            says="`schema`; without it, a file is read as version 1",
            newer=_WRONG,
            changes=FIRST,
        ),
        Format(
            is_=version.RUN,
            title="Run of a class",
            where="`<out>/run.json`",
            by="grader",
            says="`schema`",
            newer="exit code 2",
            changes=FIRST,
            additions=(
                Addition(1, "BatchRun.cluster_insecure", "Any address of a cluster was taken."),
                Addition(
                    1, "BatchRun.own_folder", "Nobody knows who made the folder: its mode stays as it is."
                ),
                Addition(1, "BatchRun.allow_local", "A roster could name any path by its whole name."),
                Addition(1, "BatchRun.remote_only", "A roster could name paths."),
            ),
        ),
        Format(
            is_=version.SIMILARITY,
            title="Similarity",
            where="`<out>/similarity.json`",
            by="grader",
            says="`schema`",
            newer="the grader does not read it again",
            changes=FIRST,
        ),
        Format(
            is_=version.MUTANTS,
            title="Mutants of a lab",
            where="`rubrics/mutants/<lab>.yaml`",
            by="person",
            says="`schema`, which has to be there",
            newer=_WRONG,
            changes=FIRST,
        ),
        Format(
            is_=version.RUBRIC_TEST,
            title="Test of a rubric",
            where="what `grader rubric test --json` prints",
            by="grader",
            says="`schema`",
            newer="the grader does not read it again",
            changes=FIRST,
        ),
    )
}
