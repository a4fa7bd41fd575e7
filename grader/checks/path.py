"""Whether a robot takes the way that it should."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from grader.checks.registry import check
from grader.checks.support.absence import no_message
from grader.checks.support.geometry import followed, relative
from grader.checks.support.lateness import NO_EXCUSE, Lateness, lateness
from grader.checks.support.names import GlobalName
from grader.checks.support.path_deviation import Way, measured, metres, spot, stands, what_is_wrong
from grader.checks.support.tracks import Track, run_seconds, track
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed, unjudged
from grader.wording import join_words, significant

LATE_MS = 25.0
LATE_P95_MS = 5.0
"""Each turn may be late: at 1.6 rad/s, 25 ms in each of four are 0.16 rad, and 0.3 m beside a line of 2 m."""
ORIGIN = (0.0, 0.0)

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]


class PathParams(Record):
    """`points` in metres, `[x, y]`, in the order in which they have to be passed.

    With `relative` they are seen from the start, x being forward there and y to the left; the start itself is put
    before them. A velocity holds until the next one, but no longer than `hold_s` (null: for ever).
    """

    topic: GlobalName
    points: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=1)]
    tolerance_m: Annotated[float, Field(gt=0)]
    relative: bool = True
    hold_s: Annotated[float, Field(gt=0)] | None = 1.0

    @model_validator(mode="after")
    def _is_a_way(self) -> PathParams:
        way = self.way.points
        if len(way) < 2:
            raise ValueError("points: a way needs two points at least")
        shortest_m = min(math.dist(a, b) for a, b in pairwise(way))
        if self.tolerance_m > shortest_m / 2:
            near = f"two points that follow each other are {shortest_m:g} m apart"
            raise ValueError(f"tolerance_m, {self.tolerance_m:g}, is too large: {near}")
        return self

    @property
    def way(self) -> Way:
        added = self.relative and math.dist(self.points[0], ORIGIN) > self.tolerance_m
        return Way((ORIGIN, *self.points) if added else self.points, self.tolerance_m, added)


@check("path", params=PathParams, messages_only=True)
def path(package: PackageFacts, run: Run, params: PathParams) -> Verdict:
    """The robot takes the right way.

    What it checks
        That the path passes the points in their order, each within the tolerance, strays from the straight
        line between two of them no farther than that, and ends at the last one.

    Why it matters on a robot
        Time and speed make the way. A turn that lasts a tenth of a second too long leaves the robot beside
        its door, and every later turn adds to it.

    How it is measured
        Velocities (geometry_msgs/Twist) are added up over time, along exact arcs, each of them until the
        next one came or its robot would have stopped by itself. Poses (turtlesim/Pose, Odometry) are taken
        as they are. In a run with a fast clock, time is the clock's.

    How to fix
        Distance is speed times time, an angle is `angular.z` times time, in radians: a quarter turn is
        `math.pi / 2`. Publish at a steady rate while it has to move, and a zero velocity at the end.
    """
    found = track(run, params.topic, params.hold_s)
    if found is None:
        verdict = _nothing(package, run, params)
    elif found.misfit:
        hint = f"rostopic info {params.topic} shows their type"
        verdict = unjudged(f"the messages on {params.topic} {found.misfit}", measured=found.misfit, hint=hint)
    elif found.fault:
        hint = "print what you publish: a division by zero, or a square root of a negative number?"
        verdict = failed(f"the messages on {params.topic} {found.fault}", measured=found.fault, hint=hint)
    else:
        verdict = _judged(found, run, params)
    span = EvidenceCitation(evidence=run.evidence, topic=params.topic)
    return verdict.model_copy(
        update={
            "expected": f"a way through {join_words(map(spot, params.points))}, within {metres(params.tolerance_m)}",
            "measured": verdict.measured or "no path",
            "citations": (*verdict.citations, span),
        }
    )


def _nothing(package: PackageFacts, run: Run, params: PathParams) -> Verdict:
    if run_seconds(run) is None:
        return inconclusive("the run's fast clock was not recorded", hint="grade again")
    return no_message(package, run, params.topic)


def _judged(found: Track, run: Run, params: PathParams) -> Verdict:
    taken = relative(found.path) if params.relative else list(found.path)
    course = followed(taken, params.way.points, params.tolerance_m)
    figures = measured(taken, course, params.way)
    if course.done:
        count = f"{len(params.points)} points" if len(params.points) > 1 else "its point"
        return passed(f"the path passes {count} within {significant(params.tolerance_m)} m", measured=figures)
    if stands(taken):
        hint = "publish a velocity that is not 0, again and again while it has to drive"
        return unjudged("it never moves", measured=figures, hint=hint)
    words = what_is_wrong(taken, params.way, course, mirror=params.relative)
    nearly = followed(taken, params.way.points, 2 * params.tolerance_m).done
    verdict = failed(words.message, hint=words.hint, measured=figures)
    return _excused(verdict, run, nearly=nearly)


def _excused(verdict: Verdict, run: Run, *, nearly: bool) -> Verdict:
    """Where the machine itself was late, a robot that only just strays may have strayed with it."""
    late, whole = (lateness(run, run.start_ns, run.end_ns, own=own) for own in (False, True))
    if not nearly or late is None or whole is None:
        return verdict
    if _kept_waiting(late):
        late_by = f"late itself, by up to {late.max_ms:.0f} ms"
        message = f"{verdict.message}; but the grading machine was {'busy' if late.full else late_by}"
        hint = "grade again while the machine has less to do"
        return inconclusive(message, hint=hint, measured=verdict.measured)
    if _kept_waiting(whole):
        return verdict.model_copy(update={"message": f"{verdict.message}; {NO_EXCUSE}"})
    return verdict


def _kept_waiting(late: Lateness) -> bool:
    """Whether the machine was so late, or so busy, that a robot may have strayed by it."""
    return late.full or late.max_ms >= LATE_MS or late.p95_ms >= LATE_P95_MS
