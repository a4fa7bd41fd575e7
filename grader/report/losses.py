"""What a result lost: one entry for each mistake, with all that it costs, in the order in which it is read.

`arrange` finds the criterion that each blocked one comes down to, and folds what one repair puts right: the files that
have to be written, the scripts that one `chmod` makes executable, the criteria with the same advice for the same line.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from grader.judging.settle import awarded
from grader.model.repair import Repair
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import FileCitation, Status
from grader.report.view import ON_COPY
from grader.rubric.model import Rubric
from grader.wording import join_words

NAMES, NUMBERS = re.compile(r"/[\w/~]+"), re.compile(r"-?\d+(\.\d+)?")
POINTS_EQUAL = 1e-6


@dataclass(frozen=True, kw_only=True)
class Loss:
    """A criterion that was not reached, and those that it blocks (directly or through another).

    `alike` are others of the same mistake, or that are open with the same advice: no ROS on a machine leaves a dozen
    of them.
    """

    criterion: CriterionResult
    blocked: tuple[CriterionResult, ...] = ()
    alike: tuple[CriterionResult, ...] = ()

    @property
    def points(self) -> float:
        """What it cost, the blocked ones included."""
        return sum(c.missing for c in (self.criterion, *self.blocked, *self.alike))


@dataclass(frozen=True, kw_only=True)
class ReportView:
    """`open`: a person or another run must settle it. `advice`: worth nothing, or reached with a hint."""

    lost: tuple[Loss, ...]
    open: tuple[Loss, ...]
    advice: tuple[CriterionResult, ...]


def arrange(result: GradingResult, rubric: Rubric | None = None) -> ReportView:
    """Return losses by their cost, in the rubric's order if they cost the same. Results of earlier graders need the
    `rubric`: they do not say what blocked a criterion."""
    unreached = [c for c in result.criteria if c.status is not Status.PASS]
    roots = {c.id: root_of(c, result, rubric) for c in unreached}
    causes = {root for name, root in roots.items() if root != name}
    causes |= {result.gate.criterion} if result.gate else set()  # the rest counts for less without it
    losses = [
        Loss(criterion=c, blocked=tuple(b for b in unreached if b is not c and roots[b.id] == c.id))
        for c in unreached
        # what others come down to, and what comes down to nothing else and costs points, or may
        if c.id in causes or (roots[c.id] == c.id and (c.is_required or (c.counts and c.status.is_open)))
    ]
    losses.sort(key=lambda loss: -loss.points)
    told = {c.id for loss in losses for c in (loss.criterion, *loss.blocked)}
    told |= awarded(result.overrides).keys()
    return ReportView(
        lost=_told_once([loss for loss in losses if not loss.criterion.status.is_open]),
        open=_fold([loss for loss in losses if loss.criterion.status.is_open]),
        advice=tuple(  # what costs nothing and could not be judged is none
            c
            for c in result.criteria
            if c.id not in told and not c.status.is_open and (c.hint or c.status is not Status.PASS)
        ),
    )


def _told_once(losses: list[Loss]) -> tuple[Loss, ...]:
    """Return one entry for all that one mistake costs: those with the same advice for the same line, or else in the
    same words, and those of the same repairs. What costs most in all comes first."""
    # the first of a group stands for it: the criterion that asks for what was repaired
    asked_first = sorted(
        losses, key=lambda loss: not (loss.criterion.repaired and loss.criterion.repaired.charged)
    )
    charged = {
        one: used.repairs
        for loss in asked_first[::-1]
        if (used := loss.criterion.repaired) and used.charged
        for one in used.repairs
    }
    folded = _fold(asked_first, partial(_mistake, charged=charged))
    return tuple(sorted(_fold_one_edit(folded), key=lambda loss: -loss.points))


INSTALL = "cmake-install"
NOT_STARTED = ("not-executable", "cannot-be-run")
"""The mistakes in a script that the build would make up for if CMakeLists.txt installed it."""


def _fold_one_edit(losses: Sequence[Loss]) -> Iterator[Loss]:
    """Yield one entry for scripts that one `chmod` makes executable, or that the build does once they are installed."""
    scripts = {
        loss.criterion.id: loss.criterion.mistake
        for loss in losses
        if loss.criterion.mistake and loss.criterion.mistake.kind in NOT_STARTED
    }
    install = next((loss for loss in losses if loss.criterion.check == INSTALL), None)
    installed = [i for i, found in scripts.items() if install and found.name in install.criterion.message]
    bits = [i for i, found in scripts.items() if i not in installed and found.kind == "not-executable"]
    for first, names in ((install.criterion.id if install else "", installed), ("".join(bits[:1]), bits[1:])):
        folded = next((loss for loss in losses if loss.criterion.id == first), None)
        others = [loss for loss in losses if loss.criterion.id in names]
        if folded is not None and others:
            criterion = _joined(folded.criterion, [loss.criterion for loss in others])
            alike = tuple(c for loss in others for c in (loss.criterion, *loss.alike))
            blocked = tuple(c for loss in (folded, *others) for c in loss.blocked)
            joined = Loss(criterion=criterion, blocked=blocked, alike=(*folded.alike, *alike))
            losses = [joined if loss is folded else loss for loss in losses if loss not in others]
    yield from losses


def _joined(criterion: CriterionResult, scripts: Sequence[CriterionResult]) -> CriterionResult:
    """Return the criterion of an edit that also makes these scripts executable, with what it does for them."""
    found = [one.mistake for one in scripts if one.mistake]
    paths = [one.name for one in found]
    if criterion.check == INSTALL:
        # The build runs each by the right Python, whatever its mode, but its first line stays wrong.
        unstarted = [one for one in scripts if one.mistake and one.mistake.kind == "cannot-be-run"]
        why = _by_text(
            (one.message.partition("; ")[0].removeprefix(f"{_path(one)} "), one) for one in unstarted
        )
        fixes = _by_text((re.sub(r"(^|; )chmod \+x [^;]*", "", one.hint), one) for one in unstarted)
        then = f"makes {join_words(paths)} executable"
        if why:
            then = f"makes {'programs' if len(paths) > 1 else 'a program'} of {join_words(paths)}"
        message = "; ".join(
            [criterion.message, *(f"{join_words(of)} {reason}" for reason, of in why.items())]
        )
        more = [
            fix if all(path in fix for path in of) else f"in {join_words(of)}, {fix}"
            for fix, of in fixes.items()
            if fix
        ]
        lines = (c for one in unstarted for c in one.citations if isinstance(c, FileCitation))
        update = {
            "message": message,
            "hint": "; ".join([criterion.hint, f"the build then {then}", *more]),
            "citations": tuple(dict.fromkeys((*criterion.citations, *lines))),
        }
        return criterion.model_copy(update=update)
    own = criterion.mistake.name if criterion.mistake else ""
    hint = criterion.hint.replace(own, " ".join([own, *paths]))
    return criterion.model_copy(update={"message": without_bit([own, *paths]), "hint": hint})


def _path(one: CriterionResult) -> str:
    return one.mistake.name if one.mistake else ""


def _by_text(said: Iterable[tuple[str, CriterionResult]]) -> dict[str, list[str]]:
    """Return each text once, with the scripts that it is said of."""
    found: dict[str, list[str]] = {}
    for text, one in said:
        found.setdefault(text, []).append(_path(one))
    return found


def without_bit(paths: Sequence[str]) -> str:
    """Return `src/a.py and src/b.py are not executable`."""
    return f"{join_words(paths)} {'are' if len(paths) > 1 else 'is'} not executable"


def _mistake(loss: Loss, charged: Mapping[Repair, tuple[Repair, ...]]) -> Hashable:
    """Return what the same mistakes have in common. `charged` says of a repair with which others it is charged."""
    criterion = loss.criterion
    if missing_file(criterion):
        # the same for all missing files, which are one entry
        return missing_file
    used = criterion.repaired
    if used is not None and (used.charged or criterion.points >= used.share * criterion.full - POINTS_EQUAL):
        costly = min(used.repairs, key=lambda one: one not in charged)
        return used.repairs if used.charged else charged.get(costly, used.repairs)
    lines = tuple(c for c in criterion.citations if isinstance(c, FileCitation) and c.line is not None)
    if not criterion.hint:
        return criterion.id
    # one mistake may be told with other numbers in each run
    said = NUMBERS.sub("", ON_COPY.sub("", criterion.message))
    if said.startswith("/"):  # how a topic behaves: of two topics, one loop is the reason
        said = NAMES.sub("", said)
    return criterion.hint, lines or (criterion.check, said)


def missing_file(criterion: CriterionResult) -> str:
    """Return the path of the file that has to be written for the criterion; empty where that is not its fault."""
    found = criterion.mistake
    return found.name if found is not None and found.kind == "file-missing" else ""


@dataclass(frozen=True, kw_only=True)
class MissingFile:
    """`says` is what else is known of it, `holds` what the criterion expects of it."""

    path: str
    criterion: CriterionResult
    says: str
    holds: str


def missing_files(loss: Loss) -> list[MissingFile]:
    """Return the files that one entry of losses asks to write."""
    found = []
    for criterion in (loss.criterion, *loss.alike):
        if path := missing_file(criterion):
            _, _, says = criterion.message.partition("; ")
            name = re.escape(path.rpartition("/")[2])
            holds = re.sub(rf"^(\S*/)?{name}[,:]? ", "", criterion.expected)
            found.append(MissingFile(path=path, criterion=criterion, says=says, holds=holds))
    return found


def write_files_hint(files: Sequence[MissingFile]) -> str:
    """Return what to do about several missing files: what follows the first one's path goes for all. What comes next
    is told of each."""
    _, _, push = files[0].criterion.hint.partition(files[0].path)
    later = [file.criterion.hint.partition("; then ")[2] for file in files]
    push = push.partition("; then ")[0].replace(" it", " them")
    return "; then ".join(dict.fromkeys([f"write these files{push}", *filter(None, later)]))


def _fold(
    losses: list[Loss],
    key: Callable[[Loss], Hashable] = lambda loss: (loss.criterion.status, loss.criterion.hint),
) -> tuple[Loss, ...]:
    """Return one entry for all that have the same key."""
    groups: dict[Hashable, list[Loss]] = {}
    for loss in losses:
        groups.setdefault(key(loss), []).append(loss)
    return tuple(
        replace(
            first,
            blocked=tuple(c for loss in (first, *others) for c in loss.blocked),
            alike=tuple(loss.criterion for loss in others),
        )
        for first, *others in groups.values()
    )


def root_of(criterion: CriterionResult, result: GradingResult, rubric: Rubric | None) -> str:
    """Return the id of the criterion that a blocked one comes down to; its own id for any other."""
    by_id = {c.id: c for c in result.criteria}
    if criterion.blocked_by in by_id:
        return criterion.blocked_by
    requires = {c.id: c.requires for c in rubric.criteria} if rubric else {}
    # a rubric that was changed since may lead in a circle
    seen = {criterion.id}
    while criterion.status is Status.BLOCKED:
        unmet = [by_id[i] for i in requires.get(criterion.id, ()) if i in by_id and i not in seen]
        cause = next((c for c in unmet if c.status.is_lost), None)
        if cause is None:
            break
        seen.add(cause.id)
        criterion = cause
    return criterion.id
