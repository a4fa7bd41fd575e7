"""Sentences that several reports share: late work, overrides, notes, a missing sandbox, and the verdict."""

from __future__ import annotations

import re
from datetime import datetime
from typing import NamedTuple

from grader.evidence.events import PACKAGE_RUN
from grader.judging.summary import passed
from grader.model.repair import Repair, place_of
from grader.model.result import (
    AppliedOverride,
    Automatic,
    CriterionResult,
    GradingResult,
    HandedIn,
    Lateness,
    Note,
)
from grader.model.verdict import Status
from grader.report.losses import Loss, ReportView, missing_file, without_bit
from grader.report.view import hidden_ids, not_graded, points_of
from grader.rubric.made_up import as_text
from grader.rubric.model import Rubric
from grader.wording import join_words, number, plural

DECIDED_TITLE, NOTES_TITLE = "Decided by a person", "Notes by a person"
CHANGED_TITLE = "Changed since it was first published"
BY = {"roster": "as the roster says", "commit": "the commit's date", "nobody": "not known"}


def score_words(result: GradingResult) -> tuple[str, ...]:
    """Return the lines below the score: a gate, what repaired faults and being late cost, and what was made up."""
    return (*gate_words(result), *repair_words(result), *late_words(result), *made_up_words(result))


def made_up_words(result: GradingResult) -> tuple[str, ...]:
    """Return `Values chosen at random for this submission: rate = 14`, of the criteria that are shown."""
    values = {name: value for c in result.criteria for name, value in c.made_up.items()}
    said = ", ".join(f"{name} = {as_text(value)}" for name, value in values.items())
    return (f"Values chosen at random for this submission: {said}",) if said else ()


def gate_words(result: GradingResult) -> tuple[str, ...]:
    """Return a sentence for a gate that keeps the points low, or for penalties that take more than there is."""
    if gate := result.gate:
        earned = f"{number(gate.points_before)} of {number(result.max_points)} points were earned"
        return (f"{earned}, but without {gate.criterion} at most {number(gate.at_most)} count",)
    below = sum(c.points for c in result.criteria)
    return ("Penalties never take the total below zero.",) if below < 0 else ()


def repair_words(result: GradingResult) -> tuple[str, ...]:
    """Return a sentence for each fault that a repaired copy was judged without: what it costs, and what it does not.
    Faults that cost the same points are told together, those that cost nothing not at all."""
    judged: dict[Repair, list[CriterionResult]] = {}
    for criterion in result.criteria:
        for repair in criterion.repaired.repairs if criterion.repaired else ():
            judged.setdefault(repair, []).append(criterion)
    together: dict[tuple[str, ...], list[Repair]] = {}
    for repair, criteria in judged.items():
        costing = [c.id for c in criteria if c.repaired and c.repaired.charged and c.missing]
        together.setdefault(tuple(costing or (c.id for c in criteria)), []).append(repair)
    said = (
        _repair_words(repairs, list({c.id: c for one in repairs for c in judged[one]}.values()))
        for repairs in together.values()
    )
    return tuple(words for words in said if words)


def _repair_words(repairs: list[Repair], criteria: list[CriterionResult]) -> str:
    charged = [c for c in criteria if c.repaired and c.repaired.charged]
    others = [c for c in criteria if c not in charged and _is_decided(c)]
    cost = sum(c.missing for c in charged)
    if not cost and not any(c.counts and c.points for c in others):
        return ""
    words = f"{join_words(_faults(repairs))}: this costs you {plural(cost, 'point')}"
    words += f" ({', '.join(c.id for c in charged)})" if charged else ""
    shares = {c.repaired.share for c in others if c.repaired}
    for share in sorted(shares, reverse=True):
        names = [c.id for c in others if c.repaired and c.repaired.share == share]
        earned = "" if share == 1 else f", for {share:.0%} of the points"
        were = "was" if len(names) == 1 else "were"
        words += f"; {join_words(names)} {were} judged with this repaired{earned}"
    # the name of a file keeps its letters
    return words if words.startswith(repairs[0].file) else f"{words[:1].upper()}{words[1:]}"


def _is_decided(criterion: CriterionResult) -> bool:
    # What is blocked or open was not judged on the copy either.
    return not criterion.blocked_by and not criterion.status.is_open


def _faults(repairs: list[Repair]) -> list[str]:
    """Return what is wrong, once for all files with the same fault: `src/a.py and src/b.py are not executable`."""
    bits = [one.file for one in repairs if one.kind == "executable-bit"]
    others = [one for one in repairs if one.kind != "executable-bit"]
    said = [without_bit(bits)] if bits else []
    return said + [
        one.message if one.file in one.message else f"{one.message} ({place_of(one)})" for one in others
    ]


def judged_repaired(result: GradingResult) -> dict[str, list[str]]:
    """Return by the criterion that a fault is charged to, which others were judged with this repaired."""
    found: dict[str, list[str]] = {}
    with_copy = [(c.id, c.repaired) for c in result.criteria if c.repaired is not None and _is_decided(c)]
    for name, charged in with_copy:
        if charged.charged:
            others = [
                other
                for other, used in with_copy
                if not used.charged and {*used.repairs} & {*charged.repairs}
            ]
            found[name] = others
    return found


def late_words(result: GradingResult) -> tuple[str, ...]:
    """Return what being late cost, when it was handed in, and which commit counts, a line each; none if none asked."""
    late, known = result.late, result.late or result.handed_in
    attempts = (attempt_words(result),)
    if known is None:
        return tuple(filter(None, attempts))
    cost = late.text if late else ""
    if late and late.points != late.points_before:
        before = f"{number(late.points_before)} of {number(result.max_points)} points before"
        cost = f"{before}, {number(late.points)} after: {late.text}"
    said = (cost, _times(known), known.note, *attempts)
    return tuple(words[:1].upper() + words[1:] for words in said if words)


def attempt_words(result: GradingResult) -> str:
    """Return `Attempt 2 of 3 counts, the one with the most points: 60, 85, 70`; empty where there was one."""
    attempts = result.attempts
    if attempts is None or len(attempts.points) < 2:
        return ""
    points = ", ".join("not graded" if one is None else number(one) for one in attempts.points)
    if attempts.counts == "by-criterion":
        many = len(attempts.points)
        until = f" up to attempt {attempts.chosen}" if attempts.chosen < many else ""
        return f"For each criterion its best attempt{until} counts; the {many} attempts: {points} points"
    which = "the last one" if attempts.counts == "last" else "the one with the most points"
    return f"Attempt {attempts.chosen} of {len(attempts.points)} counts, {which}: {points} points"


def when_words(result: GradingResult) -> str:
    """Return `In time`, or what being late cost; empty where nobody asked."""
    late, known = result.late, result.late or result.handed_in
    if known is None or known.deadline is None or known.at is None:
        return ""
    return (late.text[:1].upper() + late.text[1:]) if late and late.late_s > 0 else "In time"


def _times(known: HandedIn) -> str:
    # in the zone of the deadline, so that both can be compared
    zone = (known.deadline or known.at).tzinfo if known.at else None
    at = f"submitted {_time(known.at.astimezone(zone))} ({BY[known.by]})" if known.at else ""
    days = known.extension_days
    used = known.late_days_used if isinstance(known, Lateness) else 0
    added = [f"{plural(days, 'day')} of extension"] if days else []
    added += [plural(used, "late day")] if used else []
    extension = f" with {join_words(added)}" if added else ""
    deadline = f"deadline {_time(known.deadline)}{extension}" if known.deadline else ""
    return ", ".join(words for words in (at, deadline) if words)


def _time(time: datetime) -> str:
    """Return `2026-11-20 23:59 UTC+01:00`; seconds only where there are any."""
    clock = f"{time:%Y-%m-%d %H:%M:%S}".removesuffix(":00")
    offset = f"{time:%z}"
    return f"{clock} UTC" + (f"{offset[:3]}:{offset[3:5]}" if int(offset) else "")


def decision(override: AppliedOverride) -> str:
    """Return `by A. Miller, 2026-11-02: clear names`, as far as it is known; `with a note by …` where the points are
    the check's."""
    who = ", ".join(part for part in (override.author or "a person", str(override.date or "")) if part)
    answer = f"to your request: {override.answer}" if override.answer else ""
    said = "; ".join(text for text in (override.comment, answer) if text)
    return f"{'by' if override.awards else 'with a note by'} {who}{': ' if said else ''}{said}"


def automatic_words(override: AppliedOverride, criterion: CriterionResult) -> str:
    """Return `0/10 (to fix): 5 Hz, not 10 Hz`; empty if that counts, or the points are a person's to award anyway."""
    if override.automatic.status is Status.MANUAL or not override.awards:
        return ""
    message = override.automatic.message
    return _automatic_text(override.automatic, criterion) + (f": {message}" if message else "")


def look_again(override: AppliedOverride, criterion: CriterionResult) -> str:
    """Return why a person should look again; empty where the check says what it said then."""
    if not override.changed:
        return ""
    now, then = _automatic_text(override.automatic, criterion), _automatic_text(override.was, criterion)
    return f"the check now says {now}, it said {then} when this was decided: look again"


def _automatic_text(automatic: Automatic, criterion: CriterionResult) -> str:
    # Of what its group leaves out, `points_of` would say that it is not counted.
    points = points_of(criterion.model_copy(update={"points": automatic.points, "left_out": None}))
    return f"{points} ({STATES[automatic.status]})"


def decided_criteria(result: GradingResult) -> list[tuple[AppliedOverride, CriterionResult]]:
    """Return what was decided about which criterion, in the rubric's order."""
    by_id = {criterion.id: criterion for criterion in result.criteria}
    return [
        (override, by_id[override.criterion]) for override in result.overrides if override.criterion in by_id
    ]


def decided_title(result: GradingResult) -> str:
    """Return the heading above these."""
    return DECIDED_TITLE if any(override.awards for override in result.overrides) else NOTES_TITLE


NOT_SETTLED = "some criteria could not be judged; no points are lost for good."


def missing_hidden(result: GradingResult, rubric: Rubric) -> int:
    """Return how many of the rubric's hidden criteria are not in the result: it is the student's view of it."""
    return len(hidden_ids(rubric) - {c.id for c in result.criteria})


def visible_words(result: GradingResult, hidden: int) -> str:
    """Return `12 visible checks passed; 5 more run at grading.`; empty where nothing is `hidden`."""
    if not hidden:
        return ""
    good, many = sum(c.status is Status.PASS for c in result.criteria), len(result.criteria)
    seen = f"{many} visible {'check' if many == 1 else 'checks'}"
    said = f"{seen} passed" if good == many else f"{good} of {seen} passed"
    return f"{said}; {hidden} more {'runs' if hidden == 1 else 'run'} at grading."


def verdict_words(result: GradingResult, rubric: Rubric, hidden: int) -> str:
    """Return `Passed.` or `Not passed yet.`; empty where that is not known, because something is open or `hidden`, and
    for lost points where no pass mark says how many are enough."""
    if hidden or not_graded(result) or result.status != "graded":
        return ""
    if passed(rubric, result):
        return "Passed."
    return "" if rubric.pass_mark is None else "Not passed yet."


NOTICED_TITLE = "Noticed while it ran"
COSTS_NOTHING = "None of this cost any points."


def note_place(note: Note) -> str:
    """Return `build`, or the scenario's name; with the process or node, where it is known and has another name."""
    run = "build" if note.scenario == PACKAGE_RUN else note.scenario
    return f"{run}, {note.actor}" if note.actor and note.actor.strip("/") != run else run


def note_text(note: Note) -> str:
    """Return `asked the master to shut down (refused)`."""
    return f"{note.text} ({'refused' if note.kind == 'refused' else 'over the limit'})"


LABEL = re.compile(
    r"none \((?P<reason>.*?)\)(?P<other>, but for an unprivileged user)?(; memory held by [^;]*)?"
)
"""As `arena.sandbox.Sandbox.label` words it, and earlier graders did."""
ASKED = "--sandbox none"


def without_sandbox(label: str) -> str:
    """Return the sentence on `environment.sandbox`; nothing where there was a sandbox, or nothing was run."""
    found = LABEL.fullmatch(label)
    if found is None:
        return ""
    if found["reason"] == ASKED:
        why = f"The sandbox is switched off ({ASKED})"
    else:
        why = f"The grading machine has no sandbox ({found['reason']})"
    who = "an unprivileged user there" if found["other"] else "the user who grades"
    return f"{why}: students' code runs with all the rights of {who}."


RUBRIC_FROM = {
    "grader": "the grader's own",
    "pinned": "pinned by its digest",
    "submission": "from the student's repository",
    "elsewhere": "a file outside the submission",
    None: "",
}


def rubric_words(result: GradingResult) -> str:
    """Return the digest of the rubric that judged, and where it came from: `0123456789ab (pinned by its digest)`."""
    words = RUBRIC_FROM[result.rubric_origin]
    return f"{result.rubric.digest[:12]} ({words})" if words else result.rubric.digest[:12]


def students_rubric(result: GradingResult) -> str:
    """Return the warning where the student could have written the rubric; nothing elsewhere."""
    if result.rubric_origin != "submission":
        return ""
    where = f"The rubric is {RUBRIC_FROM['submission']}, where the student can change it"
    return f"{where}: these points are guidance, not a mark."


class Look(NamedTuple):
    """How a status looks wherever people read it: its sign, one of ASCII, a colour of the terminal, and the word
    that the glossary has."""

    sign: str
    plain: str
    style: str
    word: str


LOOKS = {
    Status.PASS: Look("✓", "+", "green", "passed"),
    Status.PARTIAL: Look("◐", "~", "yellow", "to fix"),
    Status.FAIL: Look("✗", "x", "red", "to fix"),
    Status.BLOCKED: Look("⊘", "-", "dim", "not tested"),
    Status.INCONCLUSIVE: Look("?", "?", "yellow", "not decided yet"),
    Status.ERROR: Look("!", "!", "magenta", "not decided yet"),
    Status.MANUAL: Look("•", "o", "cyan", "not decided yet"),
}
SIGNS = {status: look.sign for status, look in LOOKS.items()}
STATES = {status: look.word for status, look in LOOKS.items()}
STYLES = {status: look.style for status, look in LOOKS.items()}
ADVICE = {Status.FAIL: "How to fix it", Status.PARTIAL: "How to fix it", Status.PASS: "Hint"}
FAULTS = {
    "submission": "The problem is in what was submitted: fix it and submit it again.",
    "machine": "The grading machine is at fault, not you. No points are lost for good: "
    "it only has to be graded again.",
    "grader": "The grader itself is at fault, not you. No points are lost for good: "
    "your teacher can have it graded again.",
}


def count_points(value: float) -> str:
    """Return `1 point`, `2.5 points`."""
    return plural(value, "point")


def verdict(result: GradingResult, rubric: Rubric, hidden: int, to_fix: int) -> tuple[str, str]:
    """Return whether it passed as a status of the page and in a few words. Without a pass mark, points are not passed
    or failed: then it is `to_fix`, how many things there are to fix."""
    if not_graded(result):
        return "error", "Not graded"
    if not hidden and passed(rubric, result):
        return "pass", "Passed"
    if result.status != "graded":
        return "inconclusive", "Not decided yet"
    if hidden:
        reached = all(c.status is Status.PASS for c in result.criteria if c.is_required)
        return ("pass", "So far, so good") if reached else ("partial", "There is something to fix")
    if rubric.pass_mark is None:
        return "partial", f"{to_fix} to fix" if to_fix else ""
    return "fail", "Not passed yet"


def pass_mark(result: GradingResult, rubric: Rubric, hidden: int) -> str:
    """Return what it takes to pass; empty where the rubric has no pass mark."""
    if rubric.pass_mark is None:
        return ""
    mark = f"To pass, you need {count_points(rubric.pass_mark)} of {number(rubric.max_points)}"
    if not_graded(result):
        return f"{mark}."
    if hidden:
        return f"{mark}, including those of criteria that run at grading."
    missing = rubric.pass_mark - result.points
    return (
        f"{mark}: {count_points(missing)} {'is' if missing == 1 else 'are'} missing."
        if missing > 0
        else f"{mark}."
    )


def in_short(result: GradingResult, view: ReportView) -> str:
    """Return what was lost, in one or two sentences."""
    lost = sum(loss.points for loss in view.lost)
    if not_graded(result):
        return "Nothing could be judged."
    late = result.late.points_before - result.late.points if result.late else 0.0
    if lost <= 0 and late <= 0 and not view.open and not result.gate:
        return "You lost nothing: every criterion that counts is met. Well done!"
    said = [] if late > 0 or result.gate else ["You lost nothing."]
    if lost > 0:
        one = len(view.lost) == 1
        first = "" if one else f", the first one alone {number(view.lost[0].points)}"
        said = [
            f"{'One mistake costs' if one else f'{len(view.lost)} mistakes cost'} {count_points(lost)}{first}."
        ]
    if result.gate:
        cost = result.gate.points_before - result.gate.at_most
        said.append(f"Without {result.gate.criterion}, {count_points(cost)} do not count.")
    if late > 0:
        said.append(f"Being late costs you {count_points(late)}.")
    if view.open:
        still = sum(loss.points for loss in view.open)
        said.append(f"{count_points(still)} {'is' if still == 1 else 'are'} not decided yet.")
    return " ".join(said)


def points_line(result: GradingResult, view: ReportView) -> str:
    """Return `95 of 100 points`, or `20 of 100 points so far, 80 not decided yet` where not all is settled."""
    still = sum(loss.points for loss in view.open)
    return f"{number(result.points)} of {number(result.max_points)} points" + (
        f" so far, {number(still)} not decided yet" if still else ""
    )


def lost_words(loss: Loss) -> str:
    """Return what one mistake costs: `-5 here, -25 in all: also chatter-rate -15 and message -5`. Empty where nothing
    else is lost, for what it costs itself stands beside it."""
    together = (loss.criterion, *loss.alike) if missing_file(loss.criterion) else (loss.criterion,)
    others = [c for c in (*loss.alike, *loss.blocked) if c.missing and c not in together]
    if not others:
        return ""
    if loss.criterion.status.is_open:
        return f"{count_points(loss.points)} in all, with {join_words(c.id for c in others)}"
    own = sum(c.missing for c in together)
    also = join_words(f"{c.id} {minus(c.missing)}" for c in others)
    return f"{f'{minus(own)} here, ' if own else ''}{minus(loss.points)} in all: also {also}"


def minus(points: float) -> str:
    """Return the points with a minus sign in front: what is lost."""
    return f"{MINUS}{number(points)}"


MINUS = "\N{MINUS SIGN}"


def is_own_fault(criterion: CriterionResult) -> bool:
    """Return whether what the criterion asks for is wrong, and not only what a repaired copy has right."""
    if (repaired := criterion.repaired) and not repaired.charged:
        return criterion.points < repaired.share * criterion.max_points
    return criterion.status in {Status.FAIL, Status.PARTIAL}
