"""What a listener was sent, against what it printed, as the check `hears` compares them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.checks.hears import HearsParams
from grader.checks.support.console_output import (
    Line,
    Probe,
    chosen,
    line_finder,
    places_of,
    printed_lines,
    probes_on,
)
from grader.evidence.run import Run
from grader.model.figure import Heard, HeardFigure
from grader.report.figures.bounded import named, second, short

ROWS_MAX = 60
TEXT_LETTERS = 200


def heard_figures(run: Run, params: HearsParams) -> Iterator[HeardFigure]:
    """Nothing where nobody can tell what was printed of what."""
    probes = probes_on(run, params.topic)
    lines = printed_lines(run)
    places = places_of(run, probes, lines, params.template) if probes else None
    if places is None:
        return
    in_turn = chosen(places)
    find = line_finder(probes, lines, params.template)
    found = [
        None if not own else find(own[0] if turn is None else turn) for own, turn in _both(places, in_turn)
    ]
    kept = _kept(found)
    yield HeardFigure(
        scenario=named(run.scenario),
        rows=tuple(_row(run, params.topic, probes[i], found[i]) for i in kept),
        left_out=len(probes) - len(kept),
        out_of_order=all(places) and None in in_turn,
    )


def _both(
    places: Sequence[tuple[int, ...]], in_turn: Sequence[int | None]
) -> Iterator[tuple[tuple[int, ...], int | None]]:
    return zip(places, in_turn, strict=True)


def _row(run: Run, topic: str, probe: Probe, line: Line | None) -> Heard:
    return Heard(
        topic=named(topic),
        sent=short(probe.value, TEXT_LETTERS),
        at_s=second(run, probe.at_ns),
        heard=None if line is None else _said(line),
        after_s=None if line is None else max(0.0, round((line.at_ns - probe.at_ns) / 1e9, 6)),
    )


def _said(line: Line) -> str:
    """Without what stands between the node's name, which is cut off already, and its words."""
    return short(" ".join(line.text.split()).removeprefix(": "), TEXT_LETTERS)


def _kept(found: Sequence[Line | None]) -> list[int]:
    """Of many, the first, and the first that are missing."""
    every = range(len(found))
    if len(every) <= ROWS_MAX:
        return list(every)
    missing = [i for i in every if found[i] is None][: ROWS_MAX // 2]
    others = [i for i in every if i not in set(missing)]
    return sorted([*missing, *others[: ROWS_MAX - len(missing)]])
