"""All submissions of a class, read one by one: what the page keeps of each, and shared diagnoses, with names or under
pseudonyms."""

from __future__ import annotations

import hashlib
import re
import secrets
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal
from urllib.parse import quote

from grader.files import atomic_write
from grader.model.batch import MISSING, ROSTER, BatchRun, CriterionInfo, Entry
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.losses import Loss, arrange
from grader.report.sentences import without_sandbox
from grader.untrusted_text import line

REPORT = "report.html"
CHARS = 160
MESSAGE_CHARS = 300
LETTERS: Mapping[Status, str] = {
    Status.PASS: "p",
    Status.PARTIAL: "a",
    Status.FAIL: "f",
    Status.BLOCKED: "b",
    Status.INCONCLUSIVE: "i",
    Status.ERROR: "e",
    Status.MANUAL: "m",
}
"""A status in one sign: what the page's data and its style sheet call it."""
ABSENT = "n"
LOST_LETTERS = "afb"
CLASS_MIN = 5
"""That fewer than so many submissions lose a criterion says nothing of the rubric."""
SubmissionState = Literal["graded", "inconclusive", "manual", "error", "missing"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Problem:
    """Why a submission could not be graded; `roster` where the roster keeps it from that."""

    message: str
    hint: str
    roster: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class SubmissionRow:
    """One submission; texts are visible ones of bounded length.

    `state` is `manual` where only a person's points are missing, `missing` where it is not graded yet. `letters` has
    one of `LETTERS` for each criterion of the rubric, in its order. `earned` are the points of criteria, by place,
    where they are not those of the status. `caused` are the points that each mistake cost in all, by the place of the
    criterion that asks for it. `folder` holds its reports, if there are any. `unwalled` says that it ran
    without a sandbox. Seconds.
    """

    id: str
    name: str
    group: str
    folder: str
    state: SubmissionState
    points: float
    letters: str
    earned: Mapping[int, float]
    caused: Mapping[int, float]
    late_s: float
    late_lost: float
    decided: int
    look_again: int
    wall_s: float
    unwalled: str
    why: str
    problem: Problem | None

    @property
    def judged(self) -> bool:
        """Whether its points say anything."""
        return self.state in {"graded", "inconclusive", "manual"}


def _judged(result: GradingResult, criteria: Sequence[CriterionInfo]) -> list[CriterionResult | None]:
    by_id = {criterion.id: criterion for criterion in result.criteria}
    return [by_id.get(criterion.id) for criterion in criteria]


def letters_of(result: GradingResult, criteria: Sequence[CriterionInfo]) -> str:
    """Return one of `LETTERS` for each of these criteria, `ABSENT` where the result does not have it."""
    return "".join(
        LETTERS[found.status] if found and not found.left_out else ABSENT
        for found in _judged(result, criteria)
    )


def passed_by_none(criteria: Sequence[CriterionInfo], letters: Iterable[str]) -> dict[int, int]:
    """Return criteria, by place, that no submission passed, with how many were decided: at least `CLASS_MIN`.

    Of these the mistake may be the rubric's. Criteria without points, and those that were lost only by what failed
    before, are left out.
    """
    counts = [Counter(column) for column in zip(*letters, strict=True)]
    decided = {place: sum(found[letter] for letter in LOST_LETTERS) for place, found in enumerate(counts)}
    return {
        place: decided[place]
        for place, found in enumerate(counts)
        if criteria[place].max_points > 0
        and not found[LETTERS[Status.PASS]]
        and decided[place] >= CLASS_MIN
        and decided[place] > found[LETTERS[Status.BLOCKED]]
    }


def line_of(entry: Entry, result: GradingResult, criteria: Sequence[CriterionInfo]) -> SubmissionRow:
    """Return one submission and its result, as the page shows it."""
    judged = _judged(result, criteria)
    late = result.late
    return SubmissionRow(
        id=line(entry.id, CHARS),
        name=line(entry.name, CHARS),
        group=line(entry.group, CHARS),
        folder="" if result.error and result.error.kind in {MISSING, ROSTER} else result.submission.id,
        state=state_of(result),
        points=result.points,
        letters=letters_of(result, criteria),
        earned={place: found.points for place, found in enumerate(judged) if found and _unusual(found)},
        caused=_points_lost(result, criteria),
        late_s=late.late_s if late else 0.0,
        late_lost=max(0.0, late.points_before - late.points) if late else 0.0,
        decided=sum(override.awards for override in result.overrides),
        look_again=sum(override.changed for override in result.overrides),
        wall_s=result.timing.wall_s,
        unwalled=line(without_sandbox(result.environment.sandbox), MESSAGE_CHARS),
        why=_open_words(result.criteria),
        problem=_problem(result),
    )


def _points_lost(result: GradingResult, criteria: Sequence[CriterionInfo]) -> dict[int, float]:
    if result.error is not None:
        return {}
    places = {criterion.id: place for place, criterion in enumerate(criteria)}
    lost = arrange(result).lost
    return {places[loss.criterion.id]: loss.points for loss in lost if loss.criterion.id in places}


def link_to(one: SubmissionRow) -> str:
    """Return the submission's report; empty where it has none."""
    # no slash and no `..` of an id may lead anywhere else
    return f"{quote(one.folder, safe='', errors='replace')}/{REPORT}" if one.folder else ""


def state_of(result: GradingResult) -> SubmissionState:
    """Return the result's status, or `missing` if there is none yet, or `manual` if only people's criteria are open."""
    if result.error is not None and result.error.kind == MISSING:
        return "missing"
    if result.status == "inconclusive" and not _still_open(result.criteria):
        return "manual"
    return result.status


def _still_open(criteria: Iterable[CriterionResult]) -> list[CriterionResult]:
    """Return what another run could decide."""
    return [c for c in criteria if c.status.is_retryable and c.counts]


def _open_words(criteria: Iterable[CriterionResult]) -> str:
    """Return what is open, in a line."""
    found = _still_open(criteria)
    if not found:
        return ""
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return line(f"{found[0].id}: {found[0].message or found[0].title}", MESSAGE_CHARS) + more


def _unusual(criterion: CriterionResult) -> bool:
    full = criterion.max_points if criterion.status is Status.PASS else 0.0
    return criterion.points != full


def _problem(result: GradingResult) -> Problem | None:
    error = result.error
    if result.status != "error" or (error is not None and error.kind == MISSING):
        return None
    if error is None:
        return Problem(message=_open_words(result.criteria), hint="", roster=False)
    return Problem(
        message=line(error.message, MESSAGE_CHARS),
        hint=line(error.hint, MESSAGE_CHARS),
        roster=error.kind == ROSTER,
    )


@dataclass(frozen=True, kw_only=True)
class Gathered:
    """Submissions in the order in which the page shows them, and diagnoses, most members first."""

    lines: Sequence[SubmissionRow]
    diagnoses: Sequence[Diagnosis]


def gather(run: BatchRun, rows: Iterable[tuple[Entry, GradingResult]]) -> Gathered:
    """Return them in the roster's order, by name."""
    lines, found = [], dict[tuple[str, str], Diagnosis]()
    for place, (entry, result) in enumerate(rows):
        lines.append(line_of(entry, result, run.criteria))
        for criterion, message, points in _mistakes(result):
            text = line(message, MESSAGE_CHARS)
            one = found.setdefault((criterion, reduced(text)), Diagnosis(criterion=criterion))
            one.add(place, text, points)
    # those of one size stay in the order in which they were found
    diagnoses = sorted(found.values(), key=lambda one: (-len(one.members), -one.points))
    return Gathered(lines=lines, diagnoses=diagnoses)


def gather_anonymous(run: BatchRun, rows: Iterable[tuple[Entry, GradingResult]], salt: bytes) -> Gathered:
    """Return them by pseudonyms, in an order that depends on `salt`; nothing in it tells who anybody is."""
    names, ids = Names(), []

    def read() -> Iterable[tuple[Entry, GradingResult]]:
        for entry, result in rows:
            names.add(entry, result.submission.commit)
            ids.append(entry.id)
            yield entry, result

    named = gather(run, read())
    words = names.told()
    shuffled = order(ids, salt)
    now = {before: place for place, before in enumerate(shuffled)}
    lines = [
        _anonymous_line(named.lines[before], pseudonym, words)
        for pseudonym, before in zip(pseudonyms(ids), shuffled, strict=True)
    ]
    diagnoses = [
        Diagnosis(
            criterion=found.criterion,
            points=found.points,
            wordings=Counter([without_words(found.message, words)]),
            members=sorted(now[member] for member in found.members),
        )
        for found in named.diagnoses
    ]
    return Gathered(lines=lines, diagnoses=diagnoses)


def _anonymous_line(named: SubmissionRow, pseudonym: str, words: frozenset[str]) -> SubmissionRow:
    problem = named.problem
    if problem is not None:
        problem = replace(problem, message=without_words(problem.message, words), hint="")
    why = without_words(named.why, words)
    return replace(named, id=pseudonym, name="", group="", folder="", why=why, problem=problem)


WORDINGS_MAX = 40
LOST = {Status.PARTIAL, Status.FAIL}

_NAME = re.compile(
    r"(?:[\w.~@+-]*/)+[\w.~@+-]*|\b[\w-]+\.(?:py|cpp|cc|c|h|hpp|xml|launch|txt|sh|msg|srv|ya?ml)\b"
)
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"|\u2018[^\u2019]*\u2019|\u201c[^\u201d]*\u201d|`[^`]*`")
_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:[.,]\d+)*(?:e[+-]?\d+)?", re.ASCII)
_LIST = re.compile(r"(?P<one>…|N)(?:(?:, | and | or |, and )(?P=one))+")


def reduced(message: str) -> str:
    """Return a message without what is one submission's own: names and quoted words are `…`, numbers are `N`."""
    # in this order: what is quoted may contain names, and names may contain numbers
    text = _QUOTED.sub("…", message)
    text = _NAME.sub("…", text)
    text = _NUMBER.sub("N", text)
    return " ".join(_LIST.sub(r"\g<one>", text).replace("there are …", "there is …").split())


@dataclass(kw_only=True)
class Diagnosis:
    """One mistake that many may share: `members` are the places of its submissions, `wordings` what it was called
    (`more` where there are others), `points` what it cost all of them, with all that followed from it. `criterion` is
    an id, empty for what could not be graded."""

    criterion: str
    points: float = 0.0
    members: list[int] = field(default_factory=list)
    wordings: Counter[str] = field(default_factory=Counter)
    more: bool = False

    @property
    def message(self) -> str:
        """As most of them have it."""
        return self.wordings.most_common(1)[0][0]

    def add(self, place: int, message: str, points: float) -> None:
        """Add one more submission."""
        self.members.append(place)
        self.points += points
        if message in self.wordings or len(self.wordings) < WORDINGS_MAX:
            self.wordings[message] += 1
        else:
            self.more = True


def _mistakes(result: GradingResult) -> Iterator[tuple[str, str, float]]:
    """Yield of each mistake the criterion that asks for it, what its check said, and the points that it cost in all; or
    why nothing could be graded, with no criterion. What a person decided keeps the words of the check."""
    if result.error is not None:
        if result.error.kind not in {MISSING, ROSTER}:
            yield "", result.error.message, 0.0
        return
    said = {override.criterion: override.automatic.message for override in result.overrides}
    view = arrange(result)
    # what costs nothing may still be the mistake of many
    advice = (Loss(criterion=criterion) for criterion in view.advice if criterion.status in LOST)
    for loss in (*view.lost, *advice):
        criterion = loss.criterion
        message = said.get(criterion.id, criterion.message)
        yield criterion.id, message or criterion.measured or criterion.title, loss.points


SALT = ".anonymous-salt"
SALT_BYTES = 32
LEFT_OUT = "…"
WORD_CHARS = 3
PREFIXES = ("S", "P", "X", "No. ", "Anon. ")

WORDS = re.compile(r"[^\W_]+")


def salt_in(folder: Path) -> bytes:
    """Return the folder's own secret: pages made with it call everybody the same each time. Made where there is none.

    Raises OutputError where it cannot be written.
    """
    path = folder / SALT
    try:
        salt = path.read_bytes()
    except OSError:
        salt = b""
    if len(salt) >= SALT_BYTES:
        return salt
    salt = secrets.token_bytes(SALT_BYTES)
    atomic_write(path, salt)
    return salt


def order(ids: Sequence[str], salt: bytes) -> list[int]:
    """Return the places of `ids`, shuffled: the same for the same salt."""
    # keyed: who knows all ids, but not the salt, cannot work out the order
    keyed = [hashlib.blake2b(name.encode("utf-8", "surrogatepass"), key=salt).digest() for name in ids]
    return sorted(range(len(ids)), key=lambda place: keyed[place])


def pseudonyms(ids: Sequence[str]) -> list[str]:
    """Return `S001`, `S002`, …, in a form that no id has."""
    taken = [name.casefold() for name in ids]
    free = (p for p in PREFIXES if not any(re.match(rf"{re.escape(p.casefold())}\d", name) for name in taken))
    prefix = next(free, PREFIXES[-1])
    digits = max(3, len(str(len(ids))))
    return [f"{prefix}{number:0{digits}}" for number in range(1, len(ids) + 1)]


class Names:
    """Knows the words of everybody's id, name, group and source, and takes them out of texts."""

    def __init__(self) -> None:
        self._own: set[str] = set()
        self._sources: Counter[str] = Counter()
        self._count = 0

    def add(self, entry: Entry, commit: str | None = None) -> None:
        """Add the words of one submission."""
        self._count += 1
        self._own.update(words_in(entry.id, entry.name, entry.group, commit or ""))
        self._sources.update(set(words_in(entry.source, entry.ref or "")))

    def common(self) -> frozenset[str]:
        """Return the words that most sources have: `home`, `submissions`."""
        most = max(1, self._count // 2)
        return frozenset(word for word, times in self._sources.items() if times > most)

    def told(self) -> frozenset[str]:
        """Return the words that could tell someone."""
        return frozenset(self._own).union(self._sources.keys() - self.common())


def without_words(text: str, words: frozenset[str]) -> str:
    """Return `text` with `…` for each of the words, and for names of files, what is quoted, and numbers."""
    return WORDS.sub(lambda found: LEFT_OUT if found[0].casefold() in words else found[0], reduced(text))


def words_in(*texts: str) -> Iterable[str]:
    """Yield the words of these texts that are long enough to tell someone."""
    return (
        word for text in texts for found in WORDS.findall(text) if len(word := found.casefold()) >= WORD_CHARS
    )
