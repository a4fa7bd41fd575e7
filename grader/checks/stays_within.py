"""Whether a robot stays where it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.driving import (
    IN_ITS_WAY,
    NEARLY,
    ROUNDING,
    SLOW_M_S,
    STOPS_S,
    Place,
    Stretch,
    answers_late,
    commands_in,
    excuse_nearly,
    metres,
    never_moves,
    spot,
    tell_end,
    why_unreadable,
)
from grader.checks.support.geometry import (
    MOVED_M,
    TURNING_RAD,
    Area,
    Band,
    Pose,
    Region,
    Spot,
    Track,
    aside,
    circles,
    circling,
    commands_of,
    length_m,
    out_along,
    relative,
    rests_along,
    share_inside,
    shown_walls,
    stands,
    track,
    turned_rad,
    turns_away,
)
from grader.checks.support.processes import run_slips
from grader.checks.support.scans import scan_near, with_scan
from grader.checks.support.topics import cite, topics_with
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict, failed, failed_or_blocked, grade_again, inconclusive, passed
from grader.wording import join_words, significant

TURNS_S = 3.0
"""A robot that turns for so long, and does not drive, finds no way."""
STILL_TURNS = "set angular.z to 0 where the way is free: a velocity keeps what was set in it before"
CIRCLES = "make angular.z depend on where the wall is, ahead or beside the robot, and not only on how far away it is"
TOWARDS = "turn towards the wall where it is too far away: a positive angular.z turns to the left"
PLACES = 200
"""So many of a robot's poses are enough to see to which side it turns."""
OTHER_SIDE = "turn to the other side where the wall is too near: a positive angular.z turns to the left"
AHEAD = "drive on where the way is clear: look at the ranges in front alone, by their angles in radians"
RARELY, MOSTLY = 0.05, 0.5
"""Shares of the time for which it stands."""


class StaysWithinParams(Place):
    """The region: give `box`, `polygon`, or `min_m`, `max_m` or both."""

    box: tuple[Spot, Spot] | None = None
    """Two opposite corners `[x, y]`, in metres."""
    polygon: Annotated[tuple[Spot, ...], Field(min_length=3)] | None = None
    """Its corners `[x, y]` in turn, in metres."""
    walls: tuple[Annotated[tuple[Spot, ...], Field(min_length=1)], ...] = ()
    """Lines through points `[x, y]`, or single points, in metres; empty: the walls that the run's simulator shows."""
    min_m: Annotated[float, Field(ge=0)] | None = None
    """The least distance from the nearest of the walls; null: no bound."""
    max_m: Annotated[float, Field(gt=0)] | None = None
    """The greatest distance from the nearest of the walls; null: no bound."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The share of the time for which it has to be inside."""
    from_s: Annotated[float, Field(ge=0)] = 0.0
    """The time after it sets off that does not count."""
    least_m: Annotated[float, Field(ge=0)] = 0.0
    """The least length of the path."""

    @model_validator(mode="after")
    def _is_one_region(self) -> StaysWithinParams:
        by_distance = self.min_m is not None or self.max_m is not None
        if sum((self.box is not None, self.polygon is not None, by_distance)) != 1:
            raise ValueError("give one of box, polygon, and min_m, max_m or both")
        if self.walls and not by_distance:
            raise ValueError("walls: give min_m or max_m, the distance from them")
        if self.min_m is not None and self.max_m is not None and self.min_m >= self.max_m:
            raise ValueError(f"min_m, {self.min_m:g}, is not less than max_m, {self.max_m:g}")
        return self

    def region(self, run: Run) -> Region:
        """Return where it may be in this run."""
        if self.box is not None:
            (x0, y0), (x1, y1) = self.box
            words = f"within the box from {spot(self.box[0])} to {spot(self.box[1])}"
            return Area(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), words)
        if self.polygon is not None:
            return Area(self.polygon, f"within the polygon {join_words(map(spot, self.polygon))}")
        return Band(self.walls or shown_walls(run), self.min_m, self.max_m)


@check("stays-within", params=StaysWithinParams, messages_only=True, of_callbacks=True)
def stays_within(package: PackageFacts, run: Run, params: StaysWithinParams) -> Verdict:
    """The robot stays where it may be.

    What it checks
        That the robot's path stays in a region: in a box or a polygon, or at a distance from walls or points.

    Why it matters on a robot
        A robot that cuts a corner too closely loses its bumper there, and one that drifts away from the
        wall that it follows has nothing to steer by.

    How it is measured
        By the positions that the simulator publishes, or else those of the package's own nodes; velocities
        are added up over time. The robot's centre counts. If the lab asks for a share (say 90 %), it is one of
        the time after the robot sets off; each position holds until the next one.

    How to fix
        The report draws the path and where it leaves the region. Stop, or turn away, before the robot is there:
        at 0.2 m/s and ten scans a second it drives 2 cm from scan to scan.
    """
    found, region = track(run, params.topic, params.hold_s, params.fields), params.region(run)
    verdict = why_unreadable(found, package, run, params) or _no_walls(region)
    if verdict is None and found is not None:
        path = placed(found, params)
        early = f"no position came on {params.topic} after the first {significant(params.from_s)} s"
        verdict = (
            tell_end(_stays(path, region, run, params, package), package, run) if path else grade_again(early)
        )
        verdict = answers_late(verdict, run)
    assert verdict is not None  # noqa: S101 - one of them always is
    share = f" for {params.share:.0%} of the time" if params.share < 1 else ""
    measured = verdict.measured or "no position"
    cited = (cite(run, params.topic),)
    return verdict.about(expected=f"{region.words}{share}", measured=measured, citations=cited)


def placed(found: Track, params: StaysWithinParams) -> list[Pose]:
    """Return the part of the path that counts: how long it stood before it set off is no one's doing."""
    path = relative(found.path) if params.relative else list(found.path)
    moved = next((i for i, pose in enumerate(path) if math.dist(pose.point, path[0].point) > MOVED_M), 0)
    # The pose before the one that has moved is where it set off.
    from_s = path[max(0, moved - 1)].time_s + params.from_s
    return [pose for pose in path if pose.time_s >= from_s]


def _no_walls(region: Region) -> Verdict | None:
    if not isinstance(region, Band) or region.walls:
        return None
    message = "no simulator of this run shows its walls, and the rubric gives none"
    return inconclusive(message, hint="tell your instructor")


def _stays(
    path: Sequence[Pose], region: Region, run: Run, params: StaysWithinParams, package: PackageFacts
) -> Verdict:
    out, long_m = out_along(path, region), length_m(path)
    inside = share_inside(path, out)
    figures = f"{inside:.0%} of the time inside, {metres(max(out))} outside at most, {metres(long_m)} long"
    if stands(path) and (params.least_m or not any(out)):
        hears = topics_with(run, "subscribers", lambda node: node in run.grader_nodes)
        own = [c for c in run.student_channels() if c.topic in hears or not hears]
        last = [one for c in own for _, one in commands_of(c)[-1:]]
        if any(one.forward > SLOW_M_S for one in last) and turned_rad(path) <= TURNING_RAD:
            return failed_or_blocked(
                "it never moves, though it is told to drive", measured=figures, hint=IN_ITS_WAY
            )
        return never_moves(path, figures, run)
    # A pose that lasts no time at all counts as well where all has to be inside.
    if inside < params.share - ROUNDING or (params.share == 1 and any(out)):
        verdict = _outside(path, out, region, inside, params)
        wrong = _turns_wrong(path, out, region, run) if isinstance(region, Band) else None
        if wrong is not None:
            verdict = verdict.explained(f"it turns to the {wrong[0]} there, {wrong[1]}", wrong[2])
            verdict = verdict.lost_by("steers-wrong", wrong[0])
        elif isinstance(region, Band) and (scan := scan_near(path, out, region, run)):
            verdict = with_scan(verdict, scan, run_slips(package, run, "ranges-read"))
        elif isinstance(region, Band) and (around := circles(path, out)) > 1:
            verdict = verdict.explained(f"it drives in circles there, {around:.1f} times around", CIRCLES)
    elif long_m < params.least_m:
        verdict = drives_too_little(path, region, params.least_m)
    elif (
        params.least_m
        and isinstance(region, Band)  # in a box, circles may be what is asked for
        and (way_m := long_m - length_m((end := circling(path, region))[0])) < params.least_m
    ):
        message = f"it drives in circles at {spot(path[-1].point)} in the end, {end[1]:.1f} times around"
        verdict = failed(message, hint=CIRCLES if params.max_m is not None else STILL_TURNS)
        long_m = way_m
    else:
        always = f"for {inside:.0%} of the time" if any(out) else "all the time"
        return passed(f"it is {region.words} {always}", measured=figures)
    nearly = inside * NEARLY >= params.share and long_m * NEARLY >= params.least_m
    return excuse_nearly(verdict.about(measured=figures), run, nearly=nearly)


def drives_too_little(path: Sequence[Pose], region: Region, least_m: float) -> Verdict:
    """Return the loss of a robot whose path is too short: it is slow, stands, or turns on the spot in the end."""
    long_m, rests = length_m(path), rests_along(path)
    message = f"its path is {metres(long_m)} long; {significant(least_m)} m are asked for"
    hint, stood = "keep driving while the way is clear", 1 - share_inside(path, rests)
    recent = [pose for pose in path if pose.time_s >= path[-1].time_s - TURNS_S]
    turns = stands(recent) and turned_rad(recent) > TURNING_RAD
    if turns:
        message += f", and it turns on the spot at {spot(path[-1].point)} in the end"
        hint = AHEAD
        steps = (math.remainder(b.heading - a.heading, math.tau) for a, b in pairwise(recent))
        if abs(sum(steps)) < turned_rad(recent) / 2:
            message += ", now to the left and now to the right"
            hint = "once it turns, let it turn to the same side until the way in front is clear"
    elif stood < RARELY:
        mean_m_s = long_m / max(path[-1].time_s - path[0].time_s, STOPS_S)
        message, hint = f"{message}, and it drives all the time, at {mean_m_s:.2f} m/s", "drive faster"
    if turns and isinstance(region, Band) and region.max_m is not None:
        message += f", {metres(region.nearest_m(path[-1].point))} from the nearest wall; why is not known"
        hint = "print in each branch which one it is, and look at the condition that stays true there"
    elif stood > MOSTLY and (isinstance(region, Band) or not turns):
        message += f", and it stands, or turns on the spot, for {stood:.0%} of the time"
        if isinstance(region, Band):
            free_m = min(region.nearest_m(a.point) for a, still in zip(path, rests, strict=True) if still)
            message += f", at least {metres(free_m)} from any wall"
        why = "look at the condition under which it drives: it does not hold there"
        hint = f"{hint}; {why}" if turns else why
    verdict = failed(message, hint=hint)
    return verdict.stuck() if stands(recent) and not turns else verdict


def _turns_wrong(
    path: Sequence[Pose], out: Sequence[float], band: Band, run: Run
) -> tuple[str, str, str] | None:
    """Return to which side it is told to turn, where the wall is, and what to do: before it comes too near to a wall
    that is there, or while it is too far from one that is on the other side. None where it is neither."""
    outside = [pose for pose, far in zip(path, out, strict=True) if far]
    if band.nearest_m(outside[0].point) < (band.min_m or 0.0):
        side, until_s = aside(outside[0], band.towards(outside[0])), outside[0].time_s
        told = [one.turn * side for one in commands_in(run, Stretch(until_s - TURNS_S, until_s)) if one.turn]
        to_wall = min(told, default=0.0) > 0
        return ("left" if side > 0 else "right", "where the wall is", OTHER_SIDE) if to_wall else None
    too_far = [
        pose
        # Some of the places will do, as to look through all walls at each takes time.
        for pose in outside[:: 1 + len(outside) // PLACES]
        if band.nearest_m(pose.point) > (band.max_m or math.inf)
    ]
    away = [(pose, aside(pose, band.towards(pose))) for pose in too_far]
    sides = turns_away(away, commands_in(run, Stretch(-math.inf, math.inf)))
    return (sides[0], f"where the wall is too far away, on its {sides[1]}", TOWARDS) if sides else None


def _outside(
    path: Sequence[Pose], out: Sequence[float], region: Region, inside: float, params: StaysWithinParams
) -> Verdict:
    first = next(pose for pose, far in zip(path, out, strict=True) if far)
    peak = path[max(range(len(out)), key=out.__getitem__)]
    where = f"{metres(max(out))} at {spot(peak.point)}"
    after = f"{first.time_s - path[0].time_s + params.from_s:.1f} s after it set off"
    message = f"it is not {region.words} from {spot(first.point)} on, {after}; farthest out by {where}"
    if params.share < 1:
        message = f"only {inside:.0%} of the time it is {region.words}: farthest out by {where}"
    # what comes after it is too near follows from that
    return failed(message, hint=_keep(path, [peak, first] if params.share == 1 else [peak], region))


def _keep(path: Sequence[Pose], out: Sequence[Pose], region: Region) -> str:
    if not isinstance(region, Band):
        return "turn, or stop, before you are at the border"
    if any(region.nearest_m(pose.point) < (region.min_m or 0.0) for pose in out):
        if region.max_m is not None:
            return "steer away from what you follow while the distance is too small"
        return "turn away, or stop, earlier: look at all ranges in front of the robot, not only at the middle one"
    if region.max_m and (kept_m := region.kept_m(path[:: 1 + len(path) // PLACES]) or 0) > region.max_m:
        return f"for half of the time it is {metres(kept_m)} away or more: look at the distance that it steers by"
    return "steer towards what you follow while the distance is too large"
