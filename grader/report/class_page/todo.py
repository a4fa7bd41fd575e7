"""What is left to do before all points are settled, and the command for it."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from grader.model.batch import BatchRun
from grader.report.class_page.submissions import CHARS, MESSAGE_CHARS, Line, link_to
from grader.report.text import html
from grader.untrusted_text import line


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
    return _typed(words)


def review(out: Path) -> Markup:
    """Where a person gives points."""
    return _typed(["grader", "review", str(out.absolute())])


def _typed(words: list[str]) -> Markup:
    """Whole, however long it is."""
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
    holds: Callable[[Line], bool]
    text: Callable[[Line], str]
    command: Callable[[BatchRun, Path], Markup]


def _problem(found: Line) -> str:
    return (
        " ".join(part for part in (found.problem.message, found.problem.hint) if part)
        if found.problem
        else ""
    )


KINDS = (
    _Kind(
        anchor="missing",
        title="Not graded yet",
        advice="The batch continues where it stopped:",
        holds=lambda found: found.state == "missing",
        text=lambda _: "",
        command=again,
    ),
    _Kind(
        anchor="inconclusive",
        title="Inconclusive",
        advice="These could not be decided this time, so they cost no points. Grade only these again:",
        holds=lambda found: found.state == "inconclusive",
        text=lambda found: found.why,
        command=lambda run, out: again(run, out, "inconclusive", static=False),
    ),
    _Kind(
        anchor="error",
        title="Could not be graded",
        advice="If a submission is at fault, its student has to fix it. Then run only these again:",
        holds=lambda found: found.problem is not None and not found.problem.roster,
        text=_problem,
        command=lambda run, out: again(run, out, "failed"),
    ),
    _Kind(
        anchor="manual",
        title="Points that a person awards",
        advice="Everything that can be checked is checked. Award the points in your browser:",
        holds=lambda found: found.state == "manual",
        text=lambda _: "",
        command=lambda _, out: review(out),
    ),
    _Kind(
        anchor="look-again",
        title="Decided by a person, and the check says something else now",
        advice="Check whether the points are still right:",
        holds=lambda found: found.look_again > 0,
        text=lambda _: "",
        command=lambda _, out: review(out),
    ),
)


def todos(run: BatchRun, lines: Sequence[Line], out: Path | None) -> Iterator[Todo]:
    """Without `out`, nothing is said of where anything is: no commands, no faults of the roster."""
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
    if run.faults:
        yield _faults(run, out)


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
