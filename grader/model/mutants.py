"""Faulty packages of a lab as their file declares them, and what a rubric's test with them comes to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from typing_extensions import Self

from grader.model.record import Record
from grader.model.result import CriterionResult, RubricInfo

Cost = Literal["fail", "partial", "blocked"]
State = Literal["killed", "survived", "differs", "inconclusive", "error"]
MutantName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9.-]*$", max_length=100)]
Texts = tuple[Annotated[str, Field(min_length=1)], ...]
KINDS = ("operator", "replace", "write", "append", "mode", "crlf", "bom", "delete", "link", "move")


class ReplaceText(Record):
    """Replace `old`, which is in the file exactly `times` times, by `new`."""

    file: str
    old: Annotated[str, Field(min_length=1)]
    new: str
    times: int = 1


class WriteFile(Record):
    """Write a file. One that was executable stays so."""

    file: str
    text: str
    executable: bool = False


class AppendText(Record):
    """Add text to the end of a file."""

    file: str
    text: str


class SetMode(Record):
    """Set or clear a file's executable bit."""

    file: str
    executable: bool


class ChosenFile(Record):
    """A file, for an edit that needs nothing else."""

    file: str


class SymbolicLink(Record):
    """Put a symbolic link to `to` in the place of a file."""

    file: str
    to: str


class MoveFiles(Record):
    """Move every file whose path begins with `old`: the file itself, or all files of a folder (`old/`)."""

    old: str
    new: str


class PackageEdit(Record):
    """One edit of the correct package; exactly one of the keys says what kind.

    `operator` names a mutation operator, with `at` for the place where it fits several and `with` for its parameters.
    The other kinds take paths from the root of the reference solution.
    """

    operator: str | None = None
    at: Annotated[dict[str, str | int], Field(default_factory=dict)]
    parameters: Annotated[dict[str, Any], Field(alias="with", default_factory=dict)]
    replace: ReplaceText | None = None
    write: WriteFile | None = None
    append: AppendText | None = None
    mode: SetMode | None = None
    crlf: ChosenFile | None = None
    bom: ChosenFile | None = None
    delete: ChosenFile | None = None
    link: SymbolicLink | None = None
    move: MoveFiles | None = None

    @property
    def kinds(self) -> list[str]:
        """The kinds of edit that are given."""
        return [kind for kind in KINDS if getattr(self, kind) is not None]

    @model_validator(mode="after")
    def _is_one_edit(self) -> Self:
        if len(self.kinds) != 1:
            raise ValueError(f"an edit is exactly one of {', '.join(KINDS)}")
        if self.operator is None and (self.at or self.parameters):
            raise ValueError("`at` and `with` belong to an operator")
        return self


class Mutant(Record):
    """A package: the reference solution with `edits`, and the criteria that it must not reach, with their statuses.

    All other criteria must pass. With an empty `expect` it is another correct package. `points` is what it gets, where
    a score is partial: the share that a repair leaves, for instance. The grader's own tests also use `message` (a
    pattern, case ignored, for what the report says of a criterion) and `git_links` (the package is handed in as a
    repository with submodules at these paths and no .gitmodules).

    `says` holds texts that message, measurement and hint of a criterion must contain, `never_says` texts that they must
    not: of one criterion, or, as a list, of any. Case does not matter, nor does how words are spaced.
    """

    summary: str = ""
    edits: Annotated[tuple[PackageEdit, ...], Field(min_length=1)]
    expect: dict[str, Cost]
    message: Annotated[dict[str, str], Field(default_factory=dict)]
    says: Annotated[dict[str, Texts], Field(default_factory=dict)]
    never_says: Texts | dict[str, Texts] = ()
    points: float | None = None
    git_links: tuple[str, ...] = ()

    @property
    def operators(self) -> tuple[str, ...]:
        """The mutation operators among its edits."""
        return tuple(edit.operator for edit in self.edits if edit.operator is not None)

    def wrong_words(self, criterion: CriterionResult) -> Iterator[str]:
        """Yield what the report should say of a criterion and does not, and what it should not say and does."""
        said = _plain(f"{criterion.message} {criterion.measured} {criterion.hint}")
        banned = self.never_says
        for text in self.says.get(criterion.id, ()):
            if _plain(text) not in said:
                yield f"{criterion.id} does not say {text!r}: {said}"
        for text in banned.get(criterion.id, ()) if isinstance(banned, dict) else banned:
            if _plain(text) in said:
                yield f"{criterion.id} says {text!r}: {said}"


def _plain(text: str) -> str:
    # A text that is broken into lines in the file counts as one line.
    return " ".join(text.casefold().split())


class MutantsFile(Record):
    """The faulty packages of one lab, by name. `anchors` holds values that the file refers to by YAML's `*name`."""

    schema_: Annotated[Literal["grader.mutants/1"], Field(alias="schema")]
    rubric: str
    anchors: Any = None
    mutants: Annotated[dict[MutantName, Mutant], Field(min_length=1)]


class LostCriterion(Record):
    """A criterion that was not reached, in the report's words."""

    id: str
    status: str
    message: str
    hint: str = ""


class MutantResult(Record):
    """One mutant's grading. `expected` is None where nothing was declared, `operator` empty where none was used.

    `missing` are declared criteria that were reached or are not in the rubric, `surplus` those that were lost
    though not declared, `differing` those with another status or other words, each with its reason. `evidence` is the
    folder of the grading, None where it was not kept.
    """

    name: str
    label: str
    operator: str
    mistake: str
    state: State
    expected: dict[str, Cost] | None
    lost: tuple[LostCriterion, ...]
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()
    diff: str
    evidence: str | None = None
    error: str = ""
    wall_s: float


class ReferenceResult(Record):
    """How the correct package fared; `lost` is empty where it got everything."""

    points: float
    max_points: float
    lost: tuple[LostCriterion, ...]
    evidence: str | None = None


class RubricTest(Record):
    """`grader rubric test --json`. `uncosted` are criteria worth points that no mutant cost; None where only some of
    the mutants were tried. `unfit` are mutants that a solution of the user's own has no place for."""

    schema_: Literal["grader.rubric-test/1"] = Field(default="grader.rubric-test/1", alias="schema")
    rubric: RubricInfo
    solution: str
    reference: ReferenceResult
    mutants: tuple[MutantResult, ...]
    uncosted: tuple[str, ...] | None
    unfit: tuple[str, ...] = ()
    wall_s: float
    passed: bool
