"""The path that a robot took, by the measure of the check that judged it, and where it had to be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.checks.robot_path import PathParams, spot
from grader.checks.robot_places import (
    EndsAtParams,
    Place,
    StaysWithinParams,
    asked_stretch,
    judged_path,
    out_along,
    placed,
)
from grader.checks.support.geometry import Polyline, Pose, followed, relative, shown_walls, track
from grader.evidence.run import Run
from grader.model.figure import POINTS_MAX, PathFigure, PlaceFigure
from grader.report.figures.bounds import finite, named, short, spread

NEAR = 20
CORNERS_MAX = 100


def path_figures(run: Run, params: PathParams) -> Iterator[PathFigure]:
    """Seen from its start where the points are."""
    found = track(run, params.topic, params.hold_s, of=params.of)
    if found is None or not found.path:
        return
    taken = relative(found.path) if params.relative else list(found.path)
    way = params.way
    course = followed(taken, way.points, params.tolerance_m)
    kept = _shown_poses(taken, course.strayed)
    yield PathFigure(
        topic=named(params.topic),
        scenario=named(run.scenario),
        points=tuple(_spot(taken[i].point) for i in kept),
        corners=tuple(map(_spot, way.points[:CORNERS_MAX])),
        tolerance_m=finite(params.tolerance_m),
        reached=course.reached,
        first=0 if way.added else 1,
        strayed=None if course.strayed is None else kept.index(course.strayed),
        messages=sum(len(c.messages) for c in run.channels if c.topic == params.topic and not c.by_grader),
    )


SIDES_MAX = 1000


def end_figures(run: Run, params: EndsAtParams) -> Iterator[PlaceFigure]:
    """The path from when the goal was asked for."""
    found, asked = track(run, params.topic, params.hold_s, params.fields), asked_stretch(run, params)
    if found is None or asked is None:
        return
    taken = judged_path(found, asked, params)
    if taken:
        missed = not params.is_there(taken[-1])
        figure = _place_figure(run, params, taken, len(taken) - 1 if missed else None)
        goal = {"goal": _spot(params.goal), "tolerance_m": finite(params.tolerance_m)}
        end = f"It ends at {spot(taken[-1].point)}, which is {'not ' if missed else ''}{params.words}."
        yield figure.model_copy(update={**goal, "says": short(end)})


def region_figures(run: Run, params: StaysWithinParams) -> Iterator[PlaceFigure]:
    """The path, and the border of where it may be."""
    found, region = track(run, params.topic, params.hold_s, params.fields), params.region(run)
    taken = placed(found, params) if found is not None and found.path else []
    if not taken:
        return
    out = out_along(taken, region)
    worst = max(range(len(out)), key=out.__getitem__) if any(out) else None
    figure = _place_figure(run, params, taken, worst, params.walls)
    where = "" if worst is None else f"; it is {out[worst]:.2f} m outside at {spot(taken[worst].point)}"
    says = short(f"It has to be {region.words}{where}.")
    area = tuple(map(_spot, region.outline[:CORNERS_MAX]))
    yield figure.model_copy(update={"area": area, "says": says})


def _place_figure(
    run: Run, params: Place, taken: Sequence[Pose], wrong: int | None, walls: Sequence[Polyline] = ()
) -> PlaceFigure:
    """The path on the map that the simulator shows. Seen from its own start, a path has no place on a map."""
    kept = _shown_poses(taken, wrong)
    shown = walls or (() if params.relative else shown_walls(run))
    return PlaceFigure(
        topic=named(params.topic),
        scenario=named(run.scenario),
        points=tuple(_spot(taken[i].point) for i in kept),
        walls=tuple(tuple(map(_spot, wall[:CORNERS_MAX])) for wall in shown[:SIDES_MAX]),
        wrong=None if wrong is None else kept.index(wrong),
        says="",
        messages=sum(len(c.messages) for c in run.channels if c.topic == params.topic and not c.by_grader),
    )


def _spot(point: tuple[float, float]) -> tuple[float, float]:
    return round(finite(point[0]), 4), round(finite(point[1]), 4)


def _shown_poses(path: Sequence[Pose], strayed: int | None) -> list[int]:
    """Its ends, what is around the place where it strays, and a fair choice of the others where it moves."""
    every = range(len(path))
    spots = [_spot(pose.point) for pose in path]
    moves = [i for i in every[1:] if spots[i] != spots[i - 1]]
    near = every[max(0, strayed - NEAR) : strayed + NEAR] if strayed is not None else ()
    own = {every[0], every[-1], *near}
    return sorted({*own, *spread(moves, POINTS_MAX - len(own))})
