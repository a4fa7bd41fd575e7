"""What a check says of one criterion."""

from __future__ import annotations

import posixpath
from collections.abc import Iterable, Sequence
from enum import Enum
from typing import Literal, Protocol

from pydantic import Field
from typing_extensions import TypedDict, Unpack

from grader.model.record import Record


# Not `StrEnum`, which Python 3.10 does not have.
class Status(str, Enum):
    """The seven statuses of a criterion (docs/design.md, Statuses)."""

    PASS = "pass"  # noqa: S105 - a status, not a password
    PARTIAL = "partial"
    FAIL = "fail"
    BLOCKED = "blocked"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"
    MANUAL = "manual"

    @property
    def is_open(self) -> bool:
        """Whether the points are neither earned nor lost: a person or another grading decides."""
        return self is Status.MANUAL or self.is_retryable

    @property
    def is_retryable(self) -> bool:
        """Whether grading again may decide it: the machine or the grader kept it from being judged."""
        return self in {Status.INCONCLUSIVE, Status.ERROR}

    @property
    def is_lost(self) -> bool:
        """Whether points are lost, here or because another criterion was not reached."""
        return self in {Status.FAIL, Status.PARTIAL, Status.BLOCKED}


class FileCitation(Record):
    """A line of the student's own files; `file` is relative to the package's root, `line` counts from 1.
    With several packages, it is the main one's root, and a file of another one is `../lab_msgs/…`."""

    file: str
    """A file of the submission, from the package's root."""
    line: int | None = None
    """Counted from 1; null for the whole file."""
    column: int | None = Field(default=None, exclude_if=lambda value: value is None)
    """The place in the line, counted from 1. Only there if it is known."""
    end_column: int | None = Field(default=None, exclude_if=lambda value: value is None)
    """The end of the place, counted from 1, itself not included. Only there if it is known."""
    source: str = Field(default="", exclude_if=lambda value: not value)
    """The line's text. Only there if something was lost and the line is short."""

    def below(self, folder: str) -> FileCitation:
        """Return the line of the file that has this path in `folder`, another package's: `../lab_msgs`."""
        return self.model_copy(update={"file": posixpath.normpath(f"{folder}/{self.file}")})


class _OnLine(Protocol):
    @property
    def file(self) -> str: ...
    @property
    def line(self) -> int | None: ...


class Placed:
    """Mixin for what stands on a line of a file."""

    @property
    def place(self: _OnLine) -> FileCitation:
        """The line."""
        return FileCitation(file=self.file, line=self.line)


def cited_lines(citations: Sequence[Citation]) -> set[tuple[str, int]]:
    """Return the files and lines that are cited, without those that are cited whole."""
    files = (one for one in citations if isinstance(one, FileCitation))
    return {(one.file, one.line) for one in files if one.line is not None}


class EvidenceCitation(Record):
    """A stretch of an evidence file: `from_ns` to `to_ns` are its `log_time`s, both included."""

    evidence: str
    """An evidence file's name."""
    topic: str
    """A topic in it."""
    from_ns: int | None = None
    """`log_time` of the first message (ns); null for the whole."""
    to_ns: int | None = None
    """`log_time` of the last message (ns), included; null for the whole."""


Citation = FileCitation | EvidenceCitation
Citations = tuple[Citation, ...]


MistakeKind = Literal[
    "file-missing", "file-elsewhere", "not-executable", "cannot-be-run", "not-made", "steers-wrong"
]


class Mistake(Record):
    """The mistake that lost a mark, for programs, which need not read the sentence. `name` is the file that
    it is about, or the side to which a robot is told to turn."""

    kind: MistakeKind
    """A file is not in the package, or only under another path; a script has no executable bit, or its
    first line keeps the system from running it, or the build that was to install it failed; a robot turns to the
    wrong side."""
    name: str
    """The file that the lab asks for, or the script, from the package's root; of a turn, `left` or `right`."""

    @property
    def is_absence(self) -> bool:
        """Whether the file is not where it has to be."""
        return self.kind in {"file-missing", "file-elsewhere"}


SoughtKind = Literal["call", "uncalled", "below", "component", "dependency", "package", "quoted", "field"]


class Sought(Record):
    """A name whose lines are looked up in the sources once all is judged, and then cited: checks see few of them."""

    kind: SoughtKind
    """The command that installs scripts, where `CMakeLists.txt` does not call it; another one that it does not call;
    the one below which that goes, and is cited; a package that the machine lacks and `find_package(…)` names, that
    `package.xml` does not declare, or that roslaunch does not find; what a script has in quotes; or
    a field of a message that has another value."""
    name: str


Span = tuple[int, int]
"""From when until when, in ns since the epoch."""


class Basis(Record):
    """What a verdict rests on, for the judge: whether another criterion explains it, whether it has to be repeated,
    and which lines are cited with it."""

    unjudged: bool = False
    """It rests on the absence of evidence: the judge turns it, even a pass, into `blocked` where a required criterion
    explains the absence."""
    part: float = 0.0
    """The share of the points that what is right earns where no other criterion explains a loss that is `unjudged`."""
    unbuilt: bool = False
    """What is absent is made by the build alone."""
    silent: bool = False
    """A process was there and alive, and only something that is absent explains it."""
    misfit: bool = False
    """Messages came, and nothing in them can be judged: whatever their rate is, that does not explain it."""
    timing: bool = False
    """A loss that one run's timing could have made: it counts only if it is seen twice."""
    of_machine: bool = False
    """It is open until the machine has what it lacks, and grading again before changes nothing."""
    cause: str = ""
    """What a process ended of, in words that are the same in every verdict that rests on it."""
    charged_once: bool = False
    """The same cause costs one criterion its points, and blocks the others that lost theirs to it."""
    lost_to: tuple[str, ...] = ()
    """What is wrong with the messages or files, in words that two criteria share which ask for it: it is charged to the
    first alone."""
    beyond: tuple[str, ...] = ()
    """Such words that may be true of one wrong value, too, by chance: a bound that it is beyond, the opposite, so many
    times as large. Only where another criterion is lost to one of them, that explains this one."""
    judged_by: str = ""
    """The check of what it was lost to: a lost criterion that has it is charged alone."""
    meant: str = ""
    """The file that is told to become the one that is missing."""
    said: str = ""
    """What a node printed, logged or published in place of what was asked: its lines in the sources are cited."""
    sought: tuple[Sought, ...] = ()
    """Names whose lines are cited."""
    wrong: Literal["", "value", "nan", "nothing", "order", "place", "stuck"] = ""
    """A value is another one, or NaN is in its place, or nothing came (no answer of a service, no feedback), or the
    items of a list are in another order, or one of them is set that is not to be, or what was right at first
    never is again."""
    callbacks: Literal["", "late", "before"] = ""
    """A callback came too `late` to what was sent, or never; or it is about what came `before` any callback could keep
    the node waiting."""
    excused: str = ""
    """What would be lost if the machine had not been late."""
    own_load: bool = False
    """The machine was late by the run's own doing."""
    dropped: bool = False
    """So much came on its topics that the recorder dropped some."""
    due: tuple[Span, ...] = ()
    """When what is missing had to come: an exception at another time does not explain that."""


class Verdict(Record):
    """One check's judgement."""

    status: Status
    score: float
    """The share of the points, 0 to 1."""
    message: str
    expected: str = ""
    measured: str = ""
    hint: str = ""
    citations: Citations = ()
    blocked_by: str = ""
    """The criterion that explains the absence."""
    right: str = ""
    """What earned a part of the points."""
    mistake: Mistake | None = None
    """The kind of what was done wrong."""
    basis: Basis = Basis()
    """What it rests on, which the judge needs and no report shows."""

    def about(
        self,
        *,
        expected: str | None = None,
        measured: str | None = None,
        said: str | None = None,
        citations: Citations | None = None,
    ) -> Verdict:
        """Return the verdict with what was expected, measured and said; None leaves a field. `citations`, where it
        shows, come behind those that it has."""
        # `dict.fromkeys` keeps the order, and each place once.
        places = None if citations is None else tuple(dict.fromkeys((*self.citations, *citations)))
        fields = {"expected": expected, "measured": measured, "citations": places}
        new = self.model_copy(update={name: value for name, value in fields.items() if value is not None})
        return new if said is None else new.based_on(said=said)

    def based_on(self, **fields: object) -> Verdict:
        """Return the verdict with these fields of its `basis`."""
        basis = Basis.model_validate({**dict(self.basis), **fields})
        return self.model_copy(update={"basis": basis})

    def caused_by(self, other: Verdict) -> Verdict:
        """Return the verdict with what another one found as its cause."""
        return self.based_on(cause=other.message, charged_once=other.basis.charged_once)

    @property
    def message_without_cause(self) -> str:
        """What was found, without the cause that stands behind it."""
        cause = self.basis.cause
        return self.message.replace(f" ({cause})", "").replace(f": {cause}", "") if cause else self.message

    def explained(self, why: str, hint: str, citations: Citations = (), *, cause: str = "") -> Verdict:
        """Return a loss with why it came to it behind its message, what to do about that, and its lines before its own.
        `cause` is what else rests on it."""
        update = {
            "message": f"{self.message}; {why}",
            "hint": hint,
            "citations": tuple(dict.fromkeys((*citations, *self.citations))),
        }
        new = self.model_copy(update=update)
        return new.based_on(cause=cause, charged_once=False) if cause else new

    def moved(self, folder: str) -> Verdict:
        """Return the verdict with the files that it cites below `folder`: `../lab_msgs`."""
        cited = (one.below(folder) if isinstance(one, FileCitation) else one for one in self.citations)
        return self.model_copy(update={"citations": tuple(cited)})

    def in_part(self, share: float, right: str) -> Verdict:
        """Return a fail as one that earns `share` of the points, 0 to 1, for what is right. Where nothing is, it stays
        as it is. Where it is unjudged, the judge gives the share, unless another criterion explains it."""
        if self.status is not Status.FAIL or share <= 0:
            return self
        if self.basis.unjudged:
            return self.model_copy(update={"right": right}).based_on(part=share)
        return self.model_copy(update={"status": Status.PARTIAL, "score": share, "right": right})

    def lost_by(self, kind: MistakeKind, name: str, meant: str = "") -> Verdict:
        """Return the verdict with the kind of mistake that it is lost by, and the file that is meant to be `name`."""
        return self.model_copy(update={"mistake": Mistake(kind=kind, name=name)}).based_on(meant=meant)

    def seeking(self, kind: SoughtKind, *names: str) -> Verdict:
        """Return the verdict with these names too to cite the lines of."""
        new = (Sought(kind=kind, name=name) for name in names)
        return self.based_on(sought=(*self.basis.sought, *new))

    def sought_names(self, kind: SoughtKind) -> list[str]:
        """Return the names of this kind to cite the lines of."""
        return [one.name for one in self.basis.sought if one.kind == kind]

    def sought_name(self, kind: SoughtKind) -> str:
        """Return the first name of this kind to cite the lines of; "" where none is sought."""
        return next(iter(self.sought_names(kind)), "")

    def of_value(self, *, nan: bool) -> Verdict:
        """Return the verdict marked as one on a wrong value; `nan`: it is NaN, or should be."""
        return self.based_on(wrong="nan" if nan else "value")

    def stuck(self, number: int = 2) -> Verdict:
        """Return the verdict marked as one on what is not done again, from its second time on."""
        return self.based_on(wrong="stuck") if number > 1 else self

    def late(self, due: Iterable[Span] = ()) -> Verdict:
        """Return the verdict marked as one that shows a callback which came too late, or never, when it was `due`."""
        return self.based_on(callbacks="late", due=tuple(due))

    def if_repeated(self) -> Verdict:
        """Return the verdict as a loss that counts only if it is repeated: one run's timing could have made it, so its
        scenario is run again."""
        return self.based_on(timing=True)


def joined(losses: Sequence[Verdict]) -> Verdict | None:
    """Return several losses as one, each reason once, with the fields of the first that could be judged; None where
    there is none."""
    # Two checks of one cause say the same sentence.
    different = list({one.message: one for one in losses}.values())
    if len(different) < 2:
        return different[0] if different else None
    first = next((one for one in different if not one.basis.unjudged), different[0])
    update = {
        "message": "; ".join(one.message for one in different),
        # Clause by clause: two hints may have a part in common.
        "hint": "; ".join(dict.fromkeys(clause for one in different for clause in one.hint.split("; "))),
        "citations": tuple(dict.fromkeys(place for one in different for place in one.citations)),
    }
    return first.model_copy(update=update)


def share_text(share: float) -> str:
    """Return a share of the points in words: `half`, `75 %`."""
    return {1.0: "all", 0.5: "half"}.get(share, f"{share * 100:.0f} %")


class Details(TypedDict, total=False):
    """What a verdict may say beside its message."""

    expected: str
    measured: str
    hint: str
    citations: Citations


def passed(message: str, **details: Unpack[Details]) -> Verdict:
    """Return a verdict that earns all points."""
    return Verdict(status=Status.PASS, score=1.0, message=message, **details)


def partial(score: float, message: str, **details: Unpack[Details]) -> Verdict:
    """Return a verdict that earns the share `score`, 0 to 1, of the points."""
    return Verdict(status=Status.PARTIAL, score=score, message=message, **details)


def failed(message: str, **details: Unpack[Details]) -> Verdict:
    """Return a verdict that earns nothing."""
    return Verdict(status=Status.FAIL, score=0.0, message=message, **details)


def failed_or_blocked(message: str, **details: Unpack[Details]) -> Verdict:
    """Return the verdict that there is nothing to judge: a fail, or `blocked` where a required criterion
    explains it."""
    return failed(message, **details).based_on(unjudged=True)


def inconclusive(message: str, **details: Unpack[Details]) -> Verdict:
    """Return a verdict that is still open, for no fault of the student's."""
    return Verdict(status=Status.INCONCLUSIVE, score=0.0, message=message, **details)


def grade_again(message: str, *, measured: str = "") -> Verdict:
    """Return a verdict that is open because this run shows too little; another one may show more."""
    return inconclusive(message, hint="grade again", measured=measured)


def machine_lacks(message: str, **details: Unpack[Details]) -> Verdict:
    """Return a verdict that is open until the grading machine has what it lacks."""
    return inconclusive(message, **details).based_on(of_machine=True)
