"""A criterion as it is read: its points, the places that it cites, and its message and hint in pieces; and a result as
its student may see it, without hidden criteria before grading, with one row for them once published."""

from __future__ import annotations

import re
from collections.abc import Iterator
from unicodedata import east_asian_width

from grader.errors import blame
from grader.judging.settle import awarded, lateness, status_after_overrides
from grader.judging.summary import total_fields, total_points
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Citation, FileCitation, Status
from grader.rubric.model import Rubric
from grader.untrusted_text import CITATIONS_MAX, clip, visible
from grader.wording import number, plural

ON_COPY = re.compile(r"judged on a copy with .*? (?:renamed|repaired): ")
PLACE_CHARS = 300
SOURCE_CHARS = 60


def not_graded(result: GradingResult) -> bool:
    """Return whether it could not be graded, and no person has decided instead."""
    return result.error is not None and result.status == "error"


def is_students_fault(result: GradingResult) -> bool:
    """Return whether nothing could be graded because of what was submitted, not because of machine or grader."""
    return result.error is not None and blame(result.error.kind) == "submission"


def points_of(criterion: CriterionResult) -> str:
    """Return `5/10`; `+5/+10` of a bonus, `-5` of a penalty, `not counted` of what its group leaves out."""
    return of_points(criterion).replace(" of ", "/")


def of_points(criterion: CriterionResult) -> str:
    """Return `5 of 10`; `+5 of +10` of a bonus, `-5` of a penalty, `not counted` of what its group leaves out."""
    if criterion.left_out is not None:
        return "not counted"
    if criterion.extra > 0:
        return f"+{number(criterion.points)} of +{number(criterion.extra)}"
    return (
        number(criterion.points)
        if criterion.extra
        else f"{number(criterion.points)} of {number(criterion.max_points)}"
    )


def places(criterion: CriterionResult) -> list[str]:
    """Return where it was seen: `src/talker.py:17`, `real.mcap /chatter, 6.0 s`; the first twenty."""
    return [clip(_place(citation), PLACE_CHARS) for citation in criterion.citations[:CITATIONS_MAX]]


def file_places(criterion: CriterionResult) -> list[str]:
    """Return those of `places` that are files of the student's, each line once: `src/talker.py:17`."""
    return list(dict.fromkeys(clip(_place(citation), PLACE_CHARS) for citation in _cited_files(criterion)))


def _cited_files(criterion: CriterionResult) -> list[FileCitation]:
    cited = [c for c in criterion.citations[:CITATIONS_MAX] if isinstance(c, FileCitation)]
    lined = {c.file for c in cited if c.line is not None}
    return [c for c in cited if c.line is not None or c.file not in lined]


def hint_beside(criterion: CriterionResult, place: str) -> str:
    """Return the hint as it stands beside the line of code at `place`: the line is named, its file is not."""
    hint = criterion.hint
    file, _, number = place.rpartition(":")
    if file:
        hint = re.sub(
            rf"(?:(?<=; )|^){re.escape(file)},? line (\d+): (?![^;]*\bline \1\b)", r"on line \1, ", hint
        )
    told = without_place(hint, place)
    whole = len(file_places(criterion)) == 1 and "line" not in told and WHOLE_LINE.match(told)
    return f"on line {number}, {told}" if file and whole else told


WHOLE_LINE = re.compile(
    r"write (?=\S*[^\w\s])(?!.*( at | above| below| before| after| inside| in place of| every| each))",
    re.DOTALL,
)
"""A hint that says which code to write, and not where."""


def without_place(text: str, place: str) -> str:
    """Return what is said of a place (`src/talker.py:17`) that stands beside it, without naming its file again."""
    file, _, number = place.rpartition(":")
    if not file:
        return text
    beginnings = [f"{file}{comma} line {number}: " for comma in ("", ",", ":")]
    text = next((text.removeprefix(one) for one in beginnings if text.startswith(one)), text)
    text = text.replace(f" ({file}, line {number})", "").replace(f"line {number} of {file}", f"line {number}")
    text = text.replace(f"; in {file}, line {number} ", f"; line {number} ")
    text = text.replace(f"in {file}, line {number}", f"on line {number}")
    return text.replace(f"{file}, line {number}", f"line {number}")


HEADLINE_CHARS = 110
STOPS = re.compile(r"; |(?<!Error)(?<!Exception)(?<!failed): (?!')")
PLACE_LAST = re.compile(r"(\bline \d+|:\d+)$")
"""A place says nothing by itself: what is wrong there belongs to it."""
LAST_BRACKET = re.compile(r" \((?=[a-z]+ [^()]*\)$)")
"""Where a message may go on with what is less important."""


def headline(text: str) -> tuple[str, str]:
    """Return what a message says first, and the rest of a long one: what follows its last stop that leaves no more than
    `HEADLINE_CHARS`. A message without one is a headline as a whole. What was judged on a repaired copy says so last.
    """
    if copy := ON_COPY.match(text):
        first, rest = headline(text[copy.end() :])
        return first, "; ".join(filter(None, (rest, copy[0].removesuffix(": "))))
    if len(text) <= HEADLINE_CHARS:
        return text, ""
    stops = [
        at
        for at in _outside(text, STOPS)
        if HEADLINE_LEAST <= at.start() <= HEADLINE_CHARS and not PLACE_LAST.search(text, 0, at.start())
    ]
    if text.endswith(")"):
        stops += [at for at in _outside(text, LAST_BRACKET) if HEADLINE_LEAST <= at.start() <= HEADLINE_CHARS]
    # a semicolon separates more than a colon; of the same kind, the last
    best = max(stops, key=lambda at: (at[0] == "; ", at.start()), default=None)
    if best is None:
        return text, ""
    return text[: best.start()], text[best.end() :].removesuffix(")" if best[0] == " (" else "")


HEADLINE_LEAST = 20
STEPS = re.compile(r"; (?:and )?(?:then )?")
ORDERS = re.compile(
    r"""(\S+\ line\ \d+:\ |line\ \d+:\ |on\ line\ \d+,\ |first\ )?
    (add|begin|call|change|check|chmod|correct|create|declare|delete|dos2unix|end|fill|fix|git|give|hand|indent|install|keep|let
    |list|look|make|move|name|open|pass|print|publish|put|remove|rename|replace|run|send|set|start|stop|subscribe|take|test_\w+|try|use|write)\b
    """,
    re.VERBOSE,
)


def steps(hint: str) -> list[str]:
    """Return what a hint tells to do, one thing after the other; a hint that tells one thing is its only one."""
    ends = list(_outside(hint, STEPS))
    begins = [0, *(at.end() for at in ends)]
    found = [hint[a:b] for a, b in zip(begins, [*(at.start() for at in ends), len(hint)], strict=True)]
    return found if all(map(ORDERS.match, found)) else [hint]


def _outside(text: str, wanted: re.Pattern[str]) -> Iterator[re.Match[str]]:
    """Yield where it is found outside of brackets, quotes and code."""
    found = {match.start(): match for match in wanted.finditer(text)}
    depth, quoted = 0, ""
    for i, letter in enumerate(text[: max(found, default=-1) + 1]):
        if not quoted and not depth and i in found:
            yield found[i]
        if quoted:
            quoted = "" if letter == quoted else quoted
        # an apostrophe within a word opens no quotation
        elif letter in '`"' or (letter == "'" and not text[i - 1 : i].isalnum()):
            quoted = letter
        else:
            depth = max(0, depth + (letter in "([{<") - (letter in ")]}>"))


def commands_in(reproduce: str) -> Iterator[tuple[str, bool]]:
    """Yield what shows a loss in pieces, and of each whether it is a command. A text without any between backticks is
    one command."""
    parts = COMMAND.split(reproduce)
    alone = len(parts) == 1
    for i, part in enumerate(parts):
        if part.strip():
            yield part.strip(), alone or i % 2 == 1


COMMAND = re.compile(r"(?<!`)`([^`]+)`(?!`)")
IN_PACKAGE = re.compile(r"(cat|grep|head|ls|sed|python3?|rosparam load)\b")
WITH_MASTER = re.compile(r"(rosrun|rosparam)\b")
WITH_NODES = re.compile(r"(rosnode|rosservice|rostopic)\b|rosparam get\b")


def see_words(reproduce: str) -> str:
    """Return how to see it, on one line: `rosrun lab1 talker.py (with roscore running)`."""
    where = where_to_type(reproduce).removesuffix(":")
    return f"{reproduce} ({where[:1].lower()}{where[1:]})" if where else reproduce


def where_to_type(reproduce: str) -> str:
    """Return where the commands of `reproduce` work: `In the folder of your package:`. Empty where they say it
    themselves, or work anywhere."""
    commands = [text for text, is_command in commands_in(reproduce) if is_command]
    if len(commands) != 1 or commands[0].startswith("cd "):
        return ""
    said = ["in the folder of your package"] if IN_PACKAGE.match(commands[0]) else []
    if WITH_NODES.match(commands[0]):
        said.append("with roscore and your nodes running")
    elif WITH_MASTER.match(commands[0]):
        said.append("with roscore running")
    words = ", ".join(said)
    return f"{words[:1].upper()}{words[1:]}:" if words else ""


STARTS = re.compile(
    r"""(a|add|after|all|an|another|at|both|bring|build|call|check|close|correct|create|declare|delete|do
    |does|drive|each|every|executable|fill|find|first|fix|from(?!\ \S+\ import)|give|hand|have|in|indent|install|it
    |its|judged|keep|leave|let|line|look|loop|make|more|move|negative|neither|no|nothing|on|once|one|only|open
    |order|pass|perhaps|print|publish|put|read|record|remove|rename|replace|reset|run|save|send|set
    |something|starts?|steer|brings?|loads?|stop|subscribe|take|tell|the|there|this|too|try|turn|twice|two|use|what|whether
    |which|while|with|wrap|write|wrong|your)[,:;]?(?=\ )""",
    re.VERBOSE,
)
"""Words that a message or a hint begins with and that are not command, name or code."""


def sentence(text: str) -> str:
    """Return the text with a capital where it begins with a plain word: on a page it stands as a sentence."""
    return text[:1].upper() + text[1:] if STARTS.match(text) else text


TAB = " " * 4
"""As which a tab of a cited line is shown."""


def pointed_at(criterion: CriterionResult, chars: int = SOURCE_CHARS) -> list[tuple[str, str]]:
    """Return each line of a file whose text is known, behind its number, and carets below what is meant:
    `12 | print "hello"` and `   |       ^`."""
    found = []
    for citation in _cited_files(criterion):
        if citation.line is not None and (place := caret(citation, chars)):
            number = str(citation.line)
            text, below = place
            found.append((f"{number} | {text}", f"{' ' * len(number)} | {below}"))
    return found


def caret(citation: FileCitation, chars: int = SOURCE_CHARS) -> tuple[str, str] | None:
    """Return the visible text of the cited line, `chars` of it around its column, and carets for the line below;
    None where the text is not known. Without a column all of the text is meant."""
    raw = citation.source.rstrip()
    if not raw.strip():
        return None
    column = (citation.column or len(raw) - len(raw.lstrip()) + 1) - 1
    # columns count a tab as one character, as the parsers do
    end_column = (
        citation.end_column - 1 if citation.end_column else column + 1 if citation.column else len(raw)
    )
    source = raw.replace("\t", TAB)
    begin, end = (at + raw[:at].count("\t") * (len(TAB) - 1) for at in (column, end_column))
    first = max(0, begin - chars // 2) if end > chars else 0
    left = "…" if first else ""
    shown, meant = source[first : first + chars], source[begin : min(end, first + chars)]
    right = "…" if len(source) > first + chars else ""
    return left + visible(shown) + right, " " * _cells(left + source[first:begin]) + "^" * max(
        1, _cells(meant)
    )


def _cells(text: str) -> int:
    """Return how many columns of a terminal the visible text takes."""
    shown = visible(text)
    # these letters are two columns wide
    return len(shown) + sum(east_asian_width(letter) in "WF" for letter in shown)


def _place(citation: Citation) -> str:
    if isinstance(citation, FileCitation):
        return citation.file if citation.line is None else f"{citation.file}:{citation.line}"
    stretch = ""
    if citation.from_ns is not None and citation.to_ns is not None and citation.to_ns > citation.from_ns:
        stretch = f", {(citation.to_ns - citation.from_ns) / 1e9:.1f} s"
    return f"{citation.evidence} {citation.topic}{stretch}"


def hidden_ids(rubric: Rubric) -> frozenset[str]:
    """Return the ids of the criteria that `grader check` does not show."""
    return frozenset(c.id for c in rubric.criteria if c.visibility == "hidden")


def without_hidden(result: GradingResult, rubric: Rubric) -> GradingResult:
    """Return the result as if the hidden criteria were not in the rubric: points, maximum, status and what being late
    costs follow, and what people decided about hidden criteria is left out."""
    hidden = hidden_ids(rubric)
    shown = tuple(c for c in result.criteria if c.id not in hidden)
    if len(shown) == len(result.criteria):
        return result
    decided = tuple(o for o in result.overrides if o.criterion not in hidden)
    visible = rubric.model_copy(update={"criteria": tuple(c for c in rubric.criteria if c.id not in hidden)})
    points = total_points(visible, shown)
    # a part of the points that show, not of all
    late = lateness(points, visible, result.late) if result.late else None
    update = {
        **total_fields(visible, shown),
        "criteria": shown,
        "overrides": decided,
        "late": late,
        "points": late.points if late else points,
        "max_points": round(sum(c.max_points for c in shown), 6),
        "status": status_after_overrides(result, shown, awarded(decided)),
    }
    return result.model_copy(update=update)


NOT_SHOWN = "not-shown"
"""The id of the row that stands for all hidden criteria."""


def for_student(result: GradingResult, hidden: frozenset[str]) -> GradingResult:
    """Return a published result as its student may read it: with the points that count.

    All criteria of the ids in `hidden` are one row with points and without words, and nothing speaks to those who mark.
    """
    unseen = [c for c in result.criteria if c.id in hidden]
    shown = [_unlink(c, hidden) for c in result.criteria if c.id not in hidden]
    # a note about such a run would tell what is hidden
    runs = {c.scenario for c in unseen} - {c.scenario for c in shown}
    gate = result.gate
    update = {
        "criteria": (*shown, *_in_one(unseen)),
        "overrides": tuple(
            o.model_copy(update={"changed": False}) for o in result.overrides if o.criterion not in hidden
        ),
        "notes": tuple(note for note in result.notes if note.scenario not in runs),
        "gate": gate.model_copy(update={"criterion": NOT_SHOWN})
        if gate and gate.criterion in hidden
        else gate,
    }
    return result.model_copy(update=update)


def _unlink(criterion: CriterionResult, hidden: frozenset[str]) -> CriterionResult:
    if criterion.blocked_by not in hidden:
        return criterion
    return criterion.model_copy(update={"blocked_by": NOT_SHOWN})


def _in_one(criteria: list[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return one row for these criteria; none where they are worth nothing."""
    counting = [c for c in criteria if c.counts]
    if not counting:
        return ()
    points, most = (round(sum(p), 6) for p in zip(*((c.points, c.max_points) for c in counting), strict=True))
    extra = 0.0 if most else round(sum(c.extra for c in counting), 6)
    full = points >= sum(c.full for c in counting)
    status = Status.PASS if full else Status.PARTIAL if points > 0 else Status.FAIL
    if any(c.status.is_open for c in counting):
        status = Status.INCONCLUSIVE
    title = f"{plural(len(counting), 'criterion', 'criteria')} that your course does not show"
    row = CriterionResult.unmeasured(
        id=NOT_SHOWN,
        title=title,
        status=status,
        points=points,
        max_points=most,
        extra=extra,
        message="" if full else title,
    )
    return (row,)
