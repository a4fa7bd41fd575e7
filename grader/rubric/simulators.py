"""Simulators that come with the grader, as rubrics use them: their topics and types, and the parameters they read."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, TypeGuard

from grader.checks.support.fields import is_number
from grader.checks.support.geometry import off_m
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    as_map,
    as_maps,
    as_texts,
    set_in,
    starts_of,
)
from grader.wording import closest

Spot = tuple[float, float]
LIKELY, SURE = 0.7, 0.85
WHOLE_TURN = 6.3
"""In radians, rounded up."""


class Program(NamedTuple):
    """A program's node, its topics with their types, those on which it alone publishes, and its private parameters: all
    of them where the grader alone has it, while an installed one may have others."""

    node: str
    topics: Mapping[str, str]
    published: re.Pattern[str]
    params: frozenset[str]
    is_installed: bool = False


PROGRAMS: Mapping[str, Program] = {
    "turtlesim/turtlesim_node": Program(
        "turtlesim",
        {
            "/turtle1/cmd_vel": "geometry_msgs/Twist",
            "/turtle1/pose": "turtlesim/Pose",
            "/turtle1/color_sensor": "turtlesim/Color",
        },
        re.compile(r"/turtle\d+/(pose|color_sensor)"),
        frozenset({"background_r", "background_g", "background_b"}),
        is_installed=True,
    ),
    "robot_world/robot_world": Program(
        "robot_world",
        {
            "/cmd_vel": "geometry_msgs/Twist",
            "/scan": "sensor_msgs/LaserScan",
            "/base_scan": "sensor_msgs/LaserScan",
            "/odom": "nav_msgs/Odometry",
            "/base_pose_ground_truth": "nav_msgs/Odometry",
            "/collision": "std_msgs/Bool",
        },
        re.compile(r"/(scan|base_scan|odom|base_pose_ground_truth|collision)"),
        frozenset({
            "angle_max", "angle_min", "boxes", "cmd_vel_timeout", "laser_frame", "laser_x", "map", "max_angular",
            "max_linear", "noise", "odom_hz", "radius", "range_max", "range_min", "robot", "samples", "scan_hz",
            "scan_topic", "seed", "start", "walls",
        }),
    ),
}  # fmt: skip
TRUE_POSE = "/base_pose_ground_truth"
"""Where the robot world says where its robot is, as Stage does."""
# The same numbers as in `arena/standins/robot_world/world_node.py`, which cannot be imported without rospy.
ROBOTS = {
    "turtlebot3": {"max_linear": 0.22, "samples": 360, "radius": 0.105},
    "stage": {"max_linear": 1.0, "samples": 271, "radius": 0.18},
}
"""What the robots of the robot world are like, where no parameter says otherwise."""
FIELD_M = 11.09
"""How long the field of turtlesim is on each side."""
AHEAD_M = 0.3
"""By so much a laser may be nearer to a wall than the robot's centre."""
OTHERS_SCAN = {"/base_scan": {"turtlebot3": "/scan"}, "/scan": {"stage": "/base_scan"}}
"""By a topic that one robot of the robot world has, that of the other robot."""


def topics_of_programs(scenario: dict[str, Any]) -> dict[str, str]:
    """Return the topics, with their types, of the programs that a scenario starts. Arguments may rename them."""
    programs = [PROGRAMS[program] for program in _plain_programs(scenario) if program in PROGRAMS]
    return {topic: kind for program in programs for topic, kind in program.topics.items()}


def _plain_programs(scenario: dict[str, Any]) -> list[str]:
    """Return the programs that a scenario starts without arguments, which could give them other names and topics."""
    return [str(start.get("program")) for start in starts_of(scenario) if not start.get("args")]


def robot_of(scenario: dict[str, Any]) -> dict[str, Any]:
    """Return what the robot world's robot is like in a scenario, by the names of its parameters; empty where it is not
    started, or under another name."""
    if "robot_world/robot_world" not in _plain_programs(scenario):
        return {}
    given = _robot_world_params(scenario)
    return {"start": [0, 0, 0], **ROBOTS.get(str(given.get("robot", "turtlebot3")), {}), **given}


def _robot_world_params(scenario: dict[str, Any]) -> dict[str, Any]:
    names = (
        (str(one.get("name")).strip("/").partition("/"), one.get("value")) for _, one in set_in(scenario)
    )
    return {name: value for (node, _, name), value in names if node == "robot_world"}


def only_publisher(topic: str, scenario: dict[str, Any]) -> str:
    """Return the program of the grader's that publishes there, and no one else would; "" for none."""
    programs = _plain_programs(scenario)
    found = (name for name, p in PROGRAMS.items() if name in programs and p.published.fullmatch(topic))
    return next(found, "")


def parameter_faults(scenario: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    """Yield parameters that a scenario sets for a program that reads none of that name, or no such value."""
    nodes: dict[str, Program] = {}
    for index, start in as_maps(scenario.get("start")):
        program = PROGRAMS.get(str(start.get("program")))
        if program is None:
            continue
        args = [(number, *text.partition(":=")[::2]) for number, text in as_texts(start.get("args"))]
        given = {name: value.strip("/") for _, name, value in args}
        nodes[f"{given.get('__ns', '')}/{given.get('__name', program.node)}".strip("/")] = program
        for number, name, _ in args:
            if re.match("_[a-z]", name) and (fault := _no_parameter(program, name[1:])):
                yield ("start", index, "args", number), fault
    for at, one in set_in(scenario):
        node, _, private = str(one.get("name")).strip("/").rpartition("/")
        owner = next((name for name, program in nodes.items() if private in program.params), "")
        if node in nodes and (fault := _no_parameter(nodes[node], private)):
            yield (*at, "name"), fault
        elif node in nodes and private in FORMS and "value" in one and not FORMS[private][1](one["value"]):
            yield (*at, "value"), f"{private} is {FORMS[private][0]}"
        elif not node and owner:
            yield (*at, "name"), f"{owner} reads private parameters: write /{owner}/{private}"


def _no_parameter(program: Program, private: str) -> str:
    if private in program.params:
        return ""
    near = closest(private, program.params, cutoff=LIKELY)
    if program.is_installed and not near:
        return ""
    instead = f' (did you mean "{near}"?)' if near else f": it has {', '.join(sorted(program.params))}"
    return f"{program.node} has no parameter {private}{instead}"


def _are_numbers(value: object, count: int) -> TypeGuard[list[float]]:
    return isinstance(value, list) and len(value) == count and all(map(is_number, value))


def _are_all(value: object, is_one: Callable[[object], bool], at_least: int = 0) -> bool:
    return isinstance(value, list) and len(value) >= at_least and all(map(is_one, value))


FORMS: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "robot": ("turtlebot3 or stage", lambda value: value in ["turtlebot3", "stage"]),
    "start": (
        "[x, y, heading], in metres and radians",
        lambda value: _are_numbers(value, 3) and abs(value[2]) <= WHOLE_TURN,
    ),
    "boxes": ("[[x0, y0, x1, y1], …]", lambda value: _are_all(value, lambda box: _are_numbers(box, 4))),
    "walls": (
        "[[[x, y], [x, y], …], …], lines of two points and more",
        lambda value: _are_all(
            value, lambda line: _are_all(line, lambda point: _are_numbers(point, 2), at_least=2)
        ),
    ),
}
"""What a parameter of the robot world has to be."""


def asked_faults(
    given: dict[str, Any], scenario: dict[str, Any], named: Collection[str]
) -> Iterator[tuple[KeyPath, str]]:
    """Yield what a criterion asks of such a program and it does not have. The rest of the rubric names the topics in
    `named`."""
    for at, topic in asked_topics(given):
        if topic not in named and (near := _near_topic(topic, scenario)):
            yield at, f'no program of the scenario has {topic} (did you mean "{near}"?)'
    nodes = {program.node: program for program in PROGRAMS.values()}
    topic = str(given.get("topic"))
    for key, is_publisher in (("publisher", True), ("subscriber", False)):
        node = nodes.get(str(given.get(key)))
        if node and topic in node.topics and bool(node.published.fullmatch(topic)) != is_publisher:
            does, never = ("hears what comes", "sends") if is_publisher else ("publishes", "hears")
            yield (key,), f"{node.node} {does} on {topic}, and {never} nothing there"
    for name in as_map(given.get("params")):
        for _, program in as_texts(given.get("programs")):
            known = PROGRAMS[program].params if program in PROGRAMS else ()
            private = str(name).rpartition("/")[2]
            near = "" if private in known else closest(private, known, cutoff=SURE)
            if near:
                yield ("params", name), f'{program} has no parameter {private} (did you mean "{near}"?)'


def asked_topics(given: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    """Yield the topics of a criterion's parameters, and where they stand."""
    if isinstance(given.get("topic"), str):
        yield ("topic",), given["topic"]
    yield from ((("topics", index), topic) for index, topic in as_texts(given.get("topics")))
    for key, inner in given.items():
        yield from (((key, *at), topic) for at, topic in asked_topics(as_map(inner)))


def _near_topic(topic: str, scenario: dict[str, Any]) -> str:
    """Return the topic of one of the scenario's programs for which this one stands; "" where it is none of theirs."""
    topics = topics_of_programs(scenario)
    if topic not in topics:
        _, node, last = f"{topic}//".split("/", 2)  # its topics do not begin with the program's name
        if node in {program.node for program in PROGRAMS.values()} and f"/{last.rstrip('/')}" in topics:
            return f"/{last.rstrip('/')}"
        others = [one for one in topics if re.sub(r"\d+", "1", topic) != one]  # /turtle2/pose is another's
        return closest(topic, others, cutoff=SURE)
    given = _robot_world_params(scenario)
    robot = str(given.get("robot", "turtlebot3"))
    return OTHERS_SCAN.get(topic, {}).get(robot, "") if "scan_topic" not in given else ""


def start_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield that the robot touches a wall before it has moved, or is in a box."""
    robot = robot_of(scenario)
    lines, place, radius_m = _lines(robot), _start(robot), robot.get("radius")
    if not lines or place is None or not is_number(radius_m):
        return
    away_m = min(off_m(place, *ends) for line in lines for ends in pairwise(line))
    boxes = [line for line in _boxes(robot) if _is_inside(place, line)]
    given = (at for at, one in set_in(scenario) if str(one.get("name")).endswith("/start"))
    where = (*path, *next(given, ("start",)))
    closed = [line for line in _lines(robot) if line[0] == line[-1] and line not in _boxes(robot)]
    rooms = [line for line in closed if any(_is_inside(box[0], line) for box in _boxes(robot))]
    if rooms and not any(_is_inside(place, line) for line in rooms):
        yield where, f"the robot starts at {pair(place)}, outside of the room that the walls make"
    elif boxes:
        inside = f"in the box from {pair(boxes[0][0])} to {pair(boxes[0][2])}"
        yield where, f"the robot starts at {pair(place)}, {inside}"
    elif away_m < radius_m:
        touches = f"{away_m:.2g} m from a wall, which it touches before it has moved"
        yield where, f"the robot starts at {pair(place)}, {touches}"


def room_faults(about: WrittenCriterion, most_s: float | None) -> Iterator[Fault]:
    """Yield distances from walls that the robot does not have at its start, and walls and goals to which it cannot come
    in a run of so many seconds."""
    robot, given, scenario = robot_of(about.scenario), about.given, about.scenario
    lines, place, radius_m = _lines(robot), _start(robot), robot.get("radius")
    if not lines or place is None or not is_number(radius_m) or any(start_faults((), scenario)):
        return
    away_m = min(off_m(place, *ends) for line in lines for ends in pairwise(line))
    if about.check == "stays-within" and given.get("topic") == TRUE_POSE:
        is_always = not given.get("walls") and not given.get("from_s") and given.get("share", 1) == 1
        for key, sign in (("min_m", 1), ("max_m", -1)):
            if is_always and is_number(given.get(key)) and sign * away_m < sign * given[key]:
                yield (*about.at, key), f"the robot starts {away_m:.2g} m from the nearest wall"
    cause, fastest = as_map(given.get("cause")), robot.get("max_linear")
    is_range = cause.get("topic") in OTHERS_SCAN and str(cause.get("field")).startswith("ranges[")
    way_m = fastest * most_s if most_s is not None and is_number(fastest) else math.inf
    most_m = cause.get("max") if about.check == "reacts" and is_range else None
    if is_number(most_m) and away_m - way_m - AHEAD_M > most_m:
        far = f"{away_m:.3g} m away, and {most_s:g} s at {fastest:g} m/s are {way_m:.3g} m"
        yield (*about.at, "cause", "max"), f"the nearest wall is {far}: the cause never comes"
    goal, tolerance_m = given.get("goal"), given.get("tolerance_m")
    is_place = about.check == "ends-at" and given.get("topic") == TRUE_POSE and not given.get("relative")
    if is_place and _are_numbers(goal, 2) and is_number(tolerance_m):
        spot = (goal[0], goal[1])
        for line in lines if math.dist(place, spot) - 2 * tolerance_m <= way_m else ():  # said elsewhere
            is_apart = line[0] == line[-1] and _is_inside(place, line) != _is_inside(spot, line)
            if is_apart and min(off_m(spot, *ends) for ends in pairwise(line)) > tolerance_m:
                fault = f"walls are between the start, {pair(place)}, and {pair(spot)}"
                yield (*about.at, "goal"), fault
                return


def _start(robot: dict[str, Any]) -> Spot | None:
    """Return where the robot starts; None where that is not known, or a map has walls too."""
    start = robot.get("start")
    if not _are_numbers(start, 3) or not FORMS["start"][1](start) or "map" in robot:
        return None
    return start[0], start[1]


def _lines(robot: dict[str, Any]) -> list[list[Spot]]:
    """Return the walls and the sides of the boxes; none where one of the two is not as it has to be."""
    walls = robot.get("walls", [])
    if not FORMS["walls"][1](walls) or not FORMS["boxes"][1](robot.get("boxes", [])):
        return []
    return [[(x, y) for x, y in line] for line in walls if line] + _boxes(robot)


def _boxes(robot: dict[str, Any]) -> list[list[Spot]]:
    return [[(a, b), (c, b), (c, d), (a, d), (a, b)] for a, b, c, d in robot.get("boxes", [])]


def _is_inside(spot: Spot, line: Sequence[Spot]) -> bool:
    """Return whether a closed line goes around a spot."""
    x, y = spot
    # A ray to the right crosses the line an odd number of times from inside.
    crossed = 0
    for (x0, y0), (x1, y1) in pairwise(line):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            crossed += 1
    return crossed % 2 == 1


def pair(spot: Spot) -> str:
    """Return a place as it is written: `(1, 2.5)`."""
    return f"({spot[0]:g}, {spot[1]:g})"
