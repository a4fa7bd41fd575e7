"""The rubric of the e-Yantra lab: its fixed ids and points, and whole submissions as evidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.judging import judge
from grader.package.launch import parse_launch_files
from tests.judging.labs import SHEBANG, STOPPED, assert_sound, lost_of, rubric_of
from tests.support.timeline import build_runs

POINTS = {
    "manifest": 5,
    "cmake": 5,
    "build": 5,
    "hello-executable": 5,
    "hello-node": 5,
    "hello-log": 10,
    "config-yaml": 10,
    "param-executable": 5,
    "param-get": 10,
    "param-set": 10,
    "load-yaml-launch": 10,
    "chatter-launch": 10,
    "turtlesim-launch": 5,
    "web-launch": 5,
}
ROOT = Path(__file__).parents[2]
RUBRIC = rubric_of("eyantra-ros-basics")
PACKAGE = ROOT / "reference_solutions" / "eyantra-ros-basics" / "pkg_ros_basics"
NAMES = ("name/first", "name/last", "contact/address", "contact/phone")
DETAILS = dict(zip(NAMES, ("PwkbXwuuI", "QmvRtaalE", "HhdOtsbcU", 50378), strict=True))
DEPENDS = ("roscpp", "rospy", "std_msgs")
LAUNCHED = {"processes": [{"name": "roslaunch", "exit_s": 9, **STOPPED}]}


def submission(
    *,
    node: str = "/node_hello_ros_11_1700000000001",
    log: dict[str, Any] | None = None,
    loaded: dict[str, Any] | None = None,
    printed: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
    url: str = "https://www.e-yantra.org/",
    depends: tuple[str, ...] = DEPENDS,
    launch: dict[str, tuple[str, str]] | None = None,
) -> dict[str, Any]:
    """The reference solution's evidence, but for what is given; `launch` replaces text in a launch file."""
    texts = {f"launch/{p.name}": p.read_text(encoding="utf-8") for p in PACKAGE.glob("launch/*.launch")}
    for name, (old, new) in (launch or {}).items():
        assert old in texts[f"launch/{name}"]
        texts[f"launch/{name}"] = texts[f"launch/{name}"].replace(old, new)
    files = parse_launch_files({path: text.encode() for path, text in texts.items()}, ("pkg_ros_basics",))
    return {
        "runs": {
            "programs": {"outcome": "ended"},
            "hello": _hello(node, log or {"level": 2, "msg": "Hello World!"}),
            "config": {
                "processes": [{"name": "load", "exit_code": 0, "exit_s": 1}],
                "params": _params(DETAILS if loaded is None else loaded, "/rosparam-2"),
            },
            "param": _param(DETAILS if printed is None else printed, after or {"contact/phone": 55555}),
            "load-yaml": {
                **LAUNCHED,
                "graph": [{"nodes": ["/node_param_get_set"]}],
                "params": _params(DETAILS if loaded is None else loaded, "/roslaunch"),
            },
            "chatter": {
                **LAUNCHED,
                "topics": [{"topic": "/chatter", "callerid": "/talker"}],
                "subscribers": {"/chatter": ["/listener"]},
            },
            "turtlesim": _turtlesim(texts["launch/turtlesim.launch"]),
            "web": {
                **LAUNCHED,
                "graph": [{"nodes": ["/node_hello_ros"]}],
                "actors": [{"action": "open", "actor": "firefox", "value": ["-new-window", url]}],
            },
            "package": {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0}]},
        },
        "package": _package(depends, [file.model_dump() for file in files]),
    }


def _package(depends: tuple[str, ...], launch_files: list[dict[str, Any]]) -> dict[str, Any]:
    scripts = ("scripts/node_hello_ros.py", "scripts/node_param_get_set.py")
    return {
        "name": "pkg_ros_basics",
        "manifest": {
            "dependencies": [["buildtool_depend", "catkin"], *(["exec_depend", d] for d in depends)]
        },
        "cmake": {"calls": [["project", "pkg_ros_basics"], ["find_package", "catkin"], ["catkin_package"]]},
        "files": [
            {"path": "config/config_my.yaml", "executable": False},
            {"path": "launch/webpage_launch.sh", "shebang": "#!/bin/bash"},
            *({"path": path, "shebang": SHEBANG} for path in scripts),
        ],
        "launch_files": launch_files,
    }


def _hello(node: str, log: dict[str, Any]) -> dict[str, Any]:
    return {
        "topics": [{"topic": "/rosout", "type": "rosgraph_msgs/Log", "callerid": node, "values": [log]}],
        "processes": [{"name": "hello", "nodes": [node], "exit_s": 5, **STOPPED}],
        "actors": [{"action": "interrupt", "actor": "grader", "detail": "hello", "at_s": 4.8}],
    }


def _params(values: dict[str, Any], caller: str, at_s: float = 0.2) -> list[dict[str, Any]]:
    return [
        {"name": f"/details/{name}", "value": value, "caller_id": caller, "at_s": at_s}
        for name, value in values.items()
    ]


def _param(printed: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """The grader's made-up details, what the node prints of them, and what it sets and prints afterwards."""
    lines = [f">> {name}: {value}" for name, value in printed.items()]
    return {
        "processes": [
            {"name": "param", "script": "scripts/node_param_get_set.py", "exit_code": 0, "exit_s": 1}
        ],
        "actors": [
            {"action": "param", "actor": "grader", "topic": f"/details/{name}", "value": value, "at_s": 0.1}
            for name, value in DETAILS.items()
        ],
        "params": [*_params(DETAILS, "/grader", 0.1), *_params(after, "/node_param_get_set_2", 0.5)],
        "console": [
            {"process": "param", "lines": lines, "at_s": 0.45, "every_s": 0.001},
            {"process": "param", "line": ">> New Phone: 55555", "at_s": 0.55},
        ],
    }


def _turtlesim(text: str) -> dict[str, Any]:
    """The parameters that roslaunch sets for the node, as the launch file has them."""
    green = {"background_r": 34, "background_g": 139, "background_b": 34}
    return {
        **LAUNCHED,
        "graph": [{"nodes": ["/node_turtlesim_node", "/node_turtle_teleop_key"]}],
        "params": [
            {"name": f"/node_turtlesim_node/{n}", "value": v, "caller_id": "/roslaunch", "at_s": 0.2}
            for n, v in green.items()
            if f'"{n}"' in text
        ],
    }


def lost(**changes: Any) -> dict[str, str]:
    return lost_of(RUBRIC, judge(RUBRIC, build_runs(submission(**changes))))


def test_ids_and_points() -> None:
    assert_sound(RUBRIC, POINTS)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"url": "e-yantra.org"},
        {"url": "https://e-yantra.org"},
        {"after": {"contact/phone": "55555"}},
        {"launch": {"load_yaml.launch": ("<rosparam file", '<rosparam command="load" file')}},
        {"launch": {"chatter.launch": ('type="talker"', 'type="talker.py"')}},
        {"launch": {"web_node.launch": ('name="webpage_launch"', 'name="webpage-launch"')}},
    ],
)
def test_full_marks(changes: dict[str, Any]) -> None:
    assert lost(**changes) == {}


@pytest.mark.parametrize(
    ("changes", "points"),
    [
        ({"log": {"level": 2, "msg": "hello world!"}}, {"hello-log": 5}),
        ({"log": {"level": 2, "msg": "Hello ROS World!"}}, {"hello-log": 5}),
        ({"log": {"level": 2, "msg": "Hello, World"}}, {"hello-log": 5}),
        ({"log": {"level": 2, "msg": "Good morning"}}, {"hello-log": 0}),
        ({"log": {"level": 4, "msg": "Hello World"}}, {"hello-log": 0}),
        ({"loaded": dict([*DETAILS.items()][:2])}, {"config-yaml": 5, "load-yaml-launch": 7.5}),
        ({"loaded": dict([*DETAILS.items()][1:])}, {"config-yaml": 7.5, "load-yaml-launch": 8.8}),
        ({"printed": dict([*DETAILS.items()][:1])}, {"param-get": 2.5}),
        ({"after": {"contact/phone": 55555, "name/last": "X"}}, {"param-set": 6.7}),
        ({"after": {"contact/phone": 5555}}, {"param-set": 0}),
        ({"launch": {"turtlesim.launch": ('"background_b"', '"blue"')}}, {"turtlesim-launch": 4.2}),
        ({"launch": {"turtlesim.launch": ('"background_', '"bg_')}}, {"turtlesim-launch": 2.5}),
        ({"url": "https://www.ros.org/"}, {"web-launch": 2.5}),
    ],
)
def test_what_is_right_earns_its_share(changes: dict[str, Any], points: dict[str, float]) -> None:
    results = judge(RUBRIC, build_runs(submission(**changes)))
    assert {r.id: r.points for r in results if r.status.value != "pass"} == points
    for one in results:
        assert ("of the points for what is right: " in one.message) == (0 < one.points < one.max_points)


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ({"depends": ("rospy", "std_msgs")}, {"manifest": "fail"}),
        ({"node": "/node_hello_ros"}, {"hello-node": "fail"}),
        ({"node": "/hello_11_1700000000001"}, {"hello-node": "fail"}),
        ({"log": {"level": 4, "msg": "Hello World!"}}, {"hello-log": "fail"}),
        ({"log": {"level": 2, "msg": "Hello World"}}, {"hello-log": "partial"}),
        ({"loaded": {"name/first": "a"}}, {"config-yaml": "partial", "load-yaml-launch": "partial"}),
        ({"printed": {**DETAILS, "name/last": "Kulkarni"}}, {"param-get": "partial"}),
        ({"after": {"phone": 55555}}, {"param-set": "fail"}),
        ({"after": {"contact/phone": 55555, "name/first": "Asha"}}, {"param-set": "partial"}),
        ({"url": "https://www.ros.org/"}, {"web-launch": "partial"}),
        (
            {
                "launch": {
                    "chatter.launch": (
                        'pkg="rospy_tutorials" type="talker"',
                        'pkg="roscpp_tutorials" type="talker"',
                    )
                }
            },
            {"chatter-launch": "partial"},
        ),
        ({"launch": {"turtlesim.launch": ("background_g", "background_r")}}, {"turtlesim-launch": "partial"}),
        ({"launch": {"turtlesim.launch": ("</node>", "")}}, {"turtlesim-launch": "fail"}),
        (
            {"launch": {"load_yaml.launch": ("node_param_get_set.py", "node_hello_ros.py")}},
            {"load-yaml-launch": "fail"},
        ),
    ],
)
def test_one_fault_costs_its_own_criterion(changes: dict[str, Any], wanted: dict[str, str]) -> None:
    assert lost(**changes) == wanted
