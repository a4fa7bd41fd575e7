"""`index.html`, the page of a class: one file that needs nothing else. Begin reading at `write_class_page`."""

from __future__ import annotations

import json
import secrets
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Template
from markupsafe import Markup

from grader.files import atomic_write
from grader.model.batch import BatchRun, CriterionInfo, Entry
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.report.class_page.statistics import (
    HeatMap,
    MistakeCost,
    costs,
    heat_map,
    histogram,
    most_first,
    span,
    spread_of,
    timing,
)
from grader.report.class_page.submissions import (
    CHARS,
    LETTERS,
    MESSAGE_CHARS,
    REPORT,
    SALT_BYTES,
    Diagnosis,
    Gathered,
    SubmissionRow,
    gather,
    gather_anonymous,
    link_to,
    passed_by_none,
)
from grader.report.html.shell import environment, own_file, policy, script, style
from grader.report.sentences import SIGNS, STATES
from grader.report.text import html
from grader.untrusted_text import line
from grader.wording import plural

UNWALLED_MAX = 3
SHARED_MAX, SHARED_FIRST, ALONE_MAX, WORDINGS_MAX = 100, 12, 100, 12
"""So many diagnoses are listed that several submissions share (the first ones not folded), and that one has alone; so
many wordings of each."""
COPYING = "report.js"


@dataclass(frozen=True, kw_only=True)
class Listed:
    """A diagnosis in the page's list; `place` is its own in the page's data."""

    place: int
    title: str
    worth: float
    found: Diagnosis


def write_class_page(
    run: BatchRun,
    rows: Iterable[tuple[Entry, GradingResult]],
    target: Path,
    *,
    anonymous: bool = False,
    salt: bytes | None = None,
) -> None:
    """Write the page of a class to the file `target`; `rows` are read one by one. Links lead to reports beside it.

    An `anonymous` page says nothing of who anybody is: no ids, names, groups, sources, commits, no links and no
    commands. The same `salt` gives everybody the same pseudonym each time (`salt_in` keeps one); without one they are
    new each time. Raises OutputError or HostError where the file cannot be written.
    """
    if anonymous:
        found = gather_anonymous(run, rows, salt or secrets.token_bytes(SALT_BYTES))
        page = _page(run, found, None)
    else:
        page = _page(run, gather(run, rows), target.parent)
    atomic_write(target, page.encode("utf-8"))


def _page(run: BatchRun, found: Gathered, out: Path | None) -> str:
    """Return the page. Without `out`, nothing is said of where anything is."""
    lines = found.lines
    judged = [one for one in lines if one.judged]
    heat = heat_map(lines, run.criteria)
    points = spread_of([one.points for one in judged], run.max_points)
    cost = costs(lines, run.criteria)
    shared, alone = _list_diagnoses(run, found.diagnoses)
    parts: dict[str, Any] = {
        "run": run,
        "anonymous": out is None,
        "lines": lines,
        "states": Counter(one.state for one in lines),
        "unwalled": Counter(one.unwalled for one in lines if one.unwalled).most_common(UNWALLED_MAX),
        "todos": list(todos(run, lines, out)),
        "points": points,
        "histogram": histogram(points) if points else "",
        "costs": most_first(cost),
        "unlost": [one.criterion.title for one in cost if one.judged and not one.touched],
        "late": [one for one in lines if one.late_s > 0],
        "shared": shared,
        "alone": alone,
        "heat": heat,
        "timing": timing(run, lines),
        "columns": list(_columns(lines)),
        "data": page_data(lines, run.criteria, [one.found.members for one in (*shared, *alone)], cost, heat),
    }
    return _template().render(parts)


def _list_diagnoses(run: BatchRun, found: Sequence[Diagnosis]) -> tuple[list[Listed], list[Listed]]:
    """Return the diagnoses that several share, and those that one has alone."""
    known = {criterion.id: (criterion.title, criterion.max_points) for criterion in run.criteria}
    shared = [one for one in found if len(one.members) > 1][:SHARED_MAX]
    alone = [one for one in found if len(one.members) == 1][:ALONE_MAX]
    listed = []
    for place, one in enumerate((*shared, *alone)):
        title, worth = known.get(one.criterion, ("", 0.0))  # what could not be graded has no criterion
        listed.append(Listed(place=place, title=title, worth=worth, found=one))
    return listed[: len(shared)], listed[len(shared) :]


def _columns(lines: Sequence[SubmissionRow]) -> Iterator[tuple[str, str]]:
    """Yield the table's columns, as the script knows them and as they are called; what no one has is left out."""
    yield "id", "Submission"
    yield "points", "Points"
    if any(one.name for one in lines):
        yield "name", "Name"
    if any(one.group for one in lines):
        yield "group", "Group"
    yield "letters", "Criteria"
    yield "state", "Status"
    if any(one.late_s > 0 for one in lines):
        yield "late", "Late"
    if any(one.decided for one in lines):
        yield "decided", "Decided by a person"
    yield "time", "Time"


WORDS = {
    **STATES,
    Status.PARTIAL: "partly to fix",
    Status.ERROR: "not decided yet, the check broke",
    Status.MANUAL: "waits for a person",
}
"""As in `class.js`: those who look after a class have to know which of them is which."""


@cache
def _template() -> Template:
    copying, own = script(COPYING), Markup(own_file("class.js", __package__))  # noqa: S704 - ours
    shared = {
        "style": style() + Markup(own_file("class.css", __package__)),  # noqa: S704 - ours
        "scripts": (copying, own),
        "policy": Markup(policy(copying, own)),  # noqa: S704 - ours
        "signs": {LETTERS[status]: (sign, WORDS[status]) for status, sign in SIGNS.items()},
        "count": plural,
        "span": span,
        "link_to": link_to,
        "shared_first": SHARED_FIRST,
        "wordings_max": WORDINGS_MAX,
    }
    return environment().from_string(own_file("templates/index.html", __package__), globals=shared)


COLUMNS = ("id", "name", "group", "link", "state", "points", "letters", "earned", "late", "decided", "time")


def page_data(
    lines: Iterable[SubmissionRow],
    criteria: Iterable[CriterionInfo],
    diagnoses: Iterable[Sequence[int]],
    costs: Iterable[MistakeCost],
    heat: HeatMap | None,
) -> Markup:
    """Return the page's data: `rows` (each as `COLUMNS` says), `criteria`, and by places in `rows` the members of
    diagnoses, costs and the heat map, whose rows are places in `criteria`."""
    data = {
        "rows": [_row(one) for one in lines],
        "criteria": [[line(c.id, CHARS), line(c.title, CHARS), c.max_points] for c in criteria],
        "diagnoses": [list(members) for members in diagnoses],
        "costs": [cost.by for cost in costs],
        "heat": [list(column) for column in heat.columns] if heat else [],
        "heatRows": list(heat.rows) if heat else [],
    }
    # NaN and infinity are no JSON: a browser would show nothing at all
    return in_script(json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")))


def in_script(text: str) -> Markup:
    """Return JSON as the content of a `<script>`: nothing in it ends the element or begins another one."""
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)  # noqa: S704 - what HTML looks for is written out


def _row(one: SubmissionRow) -> list[object]:
    link = link_to(one)
    usual = link == f"{one.id}/{REPORT}"
    return [
        one.id,
        one.name,
        one.group,
        # 1 for the usual one: a class of thousands makes a large page
        1 if usual else link or 0,
        one.state,
        one.points,
        one.letters,
        one.earned or 0,
        round(one.late_s),
        [one.decided, one.look_again] if one.decided else 0,
        round(one.wall_s, 1),
    ]


def again(run: BatchRun, out: Path, only: str = "", *, static: bool | None = None) -> Markup:
    """Return the batch once more, from any folder; `only` as `--only` has it. `static` if not as it was."""
    roster = Path(run.roster)
    words = ["grader", "batch", str(roster.absolute() if roster.exists() else roster)]
    words += ["--rubric", run.rubric_source or run.rubric.id, "--out", str(out.absolute())]
    words += ["--static"] if (run.static_only if static is None else static) else []
    words += ["--before", run.before.isoformat()] if run.before else []
    words += [word for folder in run.allow_local for word in ("--allow-local", folder)]
    words += ["--remote-only"] if run.remote_only else []
    words += ["--cluster", run.cluster] if run.cluster else []
    words += ["--cluster-insecure"] if run.cluster_insecure else []
    words += ["--only", only] if only else []
    return _command_line(words)


def grade_one(run: BatchRun) -> list[str]:
    """Return the command that grades a package in FOLDER by the batch's rubric."""
    return ["grader", "grade", "FOLDER", "--rubric", run.rubric_source or run.rubric.id]


def review(out: Path) -> Markup:
    """Return the command with which a person awards points."""
    return _command_line(["grader", "review", str(out.absolute())])


def _command_line(words: list[str]) -> Markup:
    """Return the whole command line, however long it is."""
    return Markup(html(shlex.join(words)))  # noqa: S704 - escaped


SHOWN_MAX = 200


@dataclass(frozen=True, kw_only=True)
class Item:
    id: str
    link: str
    name: str = ""
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class Todo:
    """Submissions with the same thing to do. `more` are not among `items`, which are bounded in number."""

    anchor: str
    title: str
    advice: str
    items: Sequence[Item]
    count: int
    command: Markup

    @property
    def more(self) -> int:
        return self.count - len(self.items)


@dataclass(frozen=True, kw_only=True)
class _Kind:
    anchor: str
    title: str
    advice: str
    holds: Callable[[SubmissionRow], bool]
    command: Callable[[BatchRun, Path], Markup]
    text: Callable[[SubmissionRow], str] = lambda _: ""


KINDS = (
    _Kind(
        anchor="missing",
        title="Not graded yet",
        advice="The batch continues where it stopped:",
        holds=lambda found: found.state == "missing",
        command=again,
    ),
    _Kind(
        anchor="inconclusive",
        title="Not decided yet",
        advice="These could not be judged this time, which costs no points. Grade only these again:",
        holds=lambda found: found.state == "inconclusive",
        text=lambda found: found.why,
        # not from the files alone again: a run is what can decide it
        command=lambda run, out: again(run, out, "inconclusive", static=False),
    ),
    _Kind(
        anchor="error",
        title="Could not be graded",
        advice="If a submission is at fault, its student has to fix it. Then run only these again:",
        holds=lambda found: found.problem is not None and not found.problem.roster,
        text=lambda found: f"{found.problem.message} {found.problem.hint}".strip() if found.problem else "",
        command=lambda run, out: again(run, out, "failed"),
    ),
    _Kind(
        anchor="manual",
        title="Points that a person awards",
        advice="Everything that can be checked is checked. Award the points in your browser:",
        holds=lambda found: found.state == "manual",
        command=lambda _, out: review(out),
    ),
    _Kind(
        anchor="look-again",
        title="Decided by a person, and the check says something else now",
        advice="Check whether the points are still right:",
        holds=lambda found: found.look_again > 0,
        command=lambda _, out: review(out),
    ),
)


def todos(run: BatchRun, lines: Sequence[SubmissionRow], out: Path | None) -> Iterator[Todo]:
    """Yield what is left to do. Without `out`, nothing is said of where anything is: no commands, no faulty rows."""
    for kind in KINDS:
        found = [one for one in lines if kind.holds(one)]
        if found:
            yield Todo(
                anchor=kind.anchor,
                title=kind.title,
                advice=kind.advice,
                items=[
                    Item(id=one.id, link=link_to(one), name=one.name, text=kind.text(one))
                    for one in found[:SHOWN_MAX]
                ],
                count=len(found),
                command=kind.command(run, out) if out else Markup(),
            )
    if by_none := passed_by_none(run.criteria, [one.letters for one in lines]):
        yield _suspects(run, by_none, out)
    if run.faults:
        yield _faults(run, out)


def _suspects(run: BatchRun, by_none: Mapping[int, int], out: Path | None) -> Todo:
    return Todo(
        anchor="rubric",
        title="Criteria that no one got full points for",
        advice="The mistake may be the rubric's. Before you publish, grade a package that you know to be correct:",
        items=[
            Item(
                id=run.criteria[place].id,
                link="",
                name=run.criteria[place].title,
                text=f"none of {decided}",
            )
            for place, decided in by_none.items()
        ],
        count=len(by_none),
        command=_command_line(grade_one(run)) if out else Markup(),
    )


def _faults(run: BatchRun, out: Path | None) -> Todo:
    faults = run.faults[:SHOWN_MAX] if out else ()
    return Todo(
        anchor="roster",
        title="Rows of the roster that cannot be graded",
        advice="Correct the roster, then run the batch again: what is complete is not done again.",
        items=[
            Item(id=line(fault.id or fault.where, CHARS), link="", text=line(str(fault), MESSAGE_CHARS))
            for fault in faults
        ],
        count=len(run.faults),
        command=again(run, out) if out else Markup(),
    )
