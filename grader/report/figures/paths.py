"""The way that a robot took, as the check `path` measures it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.checks.path import PathParams
from grader.checks.support.geometry import Pose, followed, relative, track
from grader.evidence.run import Run
from grader.model.figure import POINTS_MAX, PathFigure
from grader.report.figures.bounded import finite, named, spread

AROUND = 20
CORNERS_MAX = 100


def path_figures(run: Run, params: PathParams) -> Iterator[PathFigure]:
    """Seen from its start where the points are."""
    found = track(run, params.topic, params.hold_s)
    if found is None or not found.path:
        return
    taken = relative(found.path) if params.relative else list(found.path)
    way = params.way
    course = followed(taken, way.points, params.tolerance_m)
    kept = _kept(taken, course.strayed)
    yield PathFigure(
        topic=named(params.topic),
        scenario=named(run.scenario),
        points=tuple(_spot(taken[i].point) for i in kept),
        corners=tuple(map(_spot, way.points[:CORNERS_MAX])),
        tolerance_m=finite(params.tolerance_m),
        reached=course.reached,
        strayed=None if course.strayed is None else kept.index(course.strayed),
        messages=sum(len(c.messages) for c in run.channels if c.topic == params.topic and not c.by_grader),
    )


def _spot(point: tuple[float, float]) -> tuple[float, float]:
    return round(finite(point[0]), 4), round(finite(point[1]), 4)


def _kept(path: Sequence[Pose], strayed: int | None) -> list[int]:
    """Its ends, what is around the place where it strays, and a fair choice of the others where it moves."""
    every = range(len(path))
    spots = [_spot(pose.point) for pose in path]
    moves = [i for i in every[1:] if spots[i] != spots[i - 1]]
    near = every[max(0, strayed - AROUND) : strayed + AROUND] if strayed is not None else ()
    own = {every[0], every[-1], *near}
    return sorted({*own, *spread(moves, POINTS_MAX - len(own))})
