"""What roslaunch makes of a launch file: arguments, namespaces, includes, parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.model.launch_file import LaunchFile
from grader.model.package import PackageFacts
from grader.package.launch import Beside, parse_launch, read_launch_files
from grader.package.launch_loader import _is_slip


def loaded(
    folder: Path, files: dict[str, str], name: str = "launch/a.launch", others: tuple[str, ...] = ()
) -> LaunchFile:
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    found = read_launch_files(folder, [(p, p) for p in files], ("pkg", "folder", "arm_lab"), others=others)
    return next(f for f in found if f.path == name)


def one(folder: Path, body: str) -> LaunchFile:
    return loaded(folder, {"launch/a.launch": f"<launch>{body}</launch>"})


@pytest.mark.parametrize(
    ("body", "names"),
    [
        ('<node name="pub"/>', ["/pub"]),
        ('<node name="pub" ns="robot"/>', ["/robot/pub"]),
        ('<node name="pub" ns="/robot/"/>', ["/robot/pub"]),
        (
            '<group ns="a"><group ns="b"><node name="pub"/></group><node name="x"/></group>',
            ["/a/b/pub", "/a/x"],
        ),
        ('<group ns="a"><node name="pub" ns="/b"/></group>', ["/b/pub"]),
        ('<arg name="n" default="pub"/><node name="$(arg n)"/>', ["/pub"]),
        ('<arg name="n" value="pub"/><node name="$(arg n)_$(arg n)"/>', ["/pub_pub"]),
        ('<arg name="a" default="x"/><arg name="b" default="$(arg a)y"/><node name="$(arg b)"/>', ["/xy"]),
        ('<node name="$(arg n)"/>', ["/$(arg n)"]),
        ('<node name="$(anon talker)"/>', ["/$(anon talker)"]),
        ('<node name="$(optenv NAME pub)"/>', ["/pub"]),
        (
            '<arg name="on" default="false"/><node name="x" if="$(arg on)"/><node name="y" unless="$(arg on)"/>',
            ["/y"],
        ),
        ('<group if="0"><node name="x"/></group><group unless="1"><node name="y"/></group>', []),
        ('<node name="x" if="$(eval 1 == 2)"/>', ["/x"]),
        (
            '<group><arg name="n" value="in"/></group><arg name="n" default="out"/><node name="$(arg n)"/>',
            ["/out"],
        ),
    ],
)
def test_names(tmp_path: Path, body: str, names: list[str]) -> None:
    assert [n.full_name for n in one(tmp_path, body).brings] == names


def test_own_nodes_stay_as_written(tmp_path: Path) -> None:
    file = one(tmp_path, '<arg name="n" default="pub"/><node name="$(arg n)"/>')
    assert [n.name for n in file.nodes] == ["$(arg n)"]


@pytest.mark.parametrize(
    ("written", "text", "nodes"),
    [
        ("$(find msgs)/launch/b.launch", '<node name="n" pkg="pkg" type="n.py"/>', ["/h/n"]),
        ("$(find msgs)/launch/b.launch", '<include file="$(dirname)/c.launch"/>', ["/h/c"]),
        ("$(find msgs)/launch/b.launch", '<include file="$(find msgs)/launch/c.launch"/>', ["/h/c"]),
        ("$(find msgs)/launch/b.launch", '<include file="$(find pkg)/launch/own.launch"/>', ["/h/own"]),
        ("$(find msgs)/launch/b.launch", '<include file="$(dirname)/own.launch"/>', []),
        ("$(find msgs)/../msgs/launch/b.launch", '<node name="n"/>', []),
        ("$(find other)/launch/b.launch", '<node name="n"/>', []),
    ],
)
def test_includes_of_another_package(tmp_path: Path, written: str, text: str, nodes: list[str]) -> None:
    own = {
        "launch/a.launch": f'<include file="{written}" ns="h"/>',
        "launch/own.launch": '<node name="own"/>',
    }
    other = {"launch/b.launch": text, "launch/c.launch": '<node name="c"/>'}
    for folder, files in (("pkg", own), ("msgs", other)):
        for path, body in files.items():
            (tmp_path / folder / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / folder / path).write_text(f"<launch>{body}</launch>")
    beside = {"msgs": Beside("../msgs", tmp_path / "msgs", list(other))}
    found = read_launch_files(tmp_path / "pkg", [(p, p) for p in own], ("pkg",), beside=beside)
    assert [one.path for one in found] == list(own)
    assert [node.full_name for node in found[0].brings] == nodes


@pytest.mark.parametrize(
    "path", ["$(find pkg)/launch/b.launch", "$(find folder)/launch/b.launch", "$(dirname)/b.launch"]
)
def test_includes_of_the_package(tmp_path: Path, path: str) -> None:
    files = {
        "launch/a.launch": f'<launch><arg name="n" default="outer"/><group ns="g"><include file="{path}" ns="h">'
        '<arg name="m" value="$(arg n)"/></include></group></launch>',
        "launch/b.launch": '<launch><arg name="m"/><arg name="n" default="inner"/>'
        '\n<node name="$(arg m)_$(arg n)"/></launch>',
    }
    file = loaded(tmp_path, files)
    assert [(n.full_name, n.file, n.line) for n in file.brings] == [
        ("/g/h/outer_inner", "launch/b.launch", 2)
    ]
    assert file.nodes == ()
    assert file.include_faults == ()


def test_pass_all_args(tmp_path: Path) -> None:
    files = {
        "launch/a.launch": '<launch><arg name="n" value="pub"/>'
        '<include file="$(dirname)/inc/b.xml" pass_all_args="true"/></launch>',
        "launch/inc/b.xml": '<launch><arg name="n" default="other"/><node name="$(arg n)"/></launch>',
    }
    assert [n.full_name for n in loaded(tmp_path, files).brings] == ["/pub"]


@pytest.mark.parametrize(
    ("other", "text", "message"),
    [
        ("b.launch", "<launch/>", "it includes launch/c.launch, and it is not in the package"),
        (
            "c.launch",
            "<launch>",
            "it includes launch/c.launch, and it is not well-formed: `<launch>` on line 1 is never",
        ),
        (
            "c.launch",
            '<launch><include file="$(dirname)/a.launch"/></launch>',
            "include each other endlessly",
        ),
    ],
)
def test_includes_that_fail(tmp_path: Path, other: str, text: str, message: str) -> None:
    files = {
        "launch/a.launch": '<launch>\n<include file="$(find pkg)/launch/c.launch"/><node name="x"/></launch>',
        f"launch/{other}": text,
    }
    file = loaded(tmp_path, files)
    assert "/x" in [n.full_name for n in file.brings]
    (fault,) = [f for f in file.include_faults if f.file == "launch/a.launch"][:1] or file.include_faults[:1]
    assert message in fault.message


@pytest.mark.parametrize(
    ("path", "condition", "others", "faults"),
    [
        ("$(find pkg)/launch/c_$(env ARM).launch", "", (), 0),
        ("$(find pkg)/launch/$(arg arm)/c.launch", "", (), 0),
        ("$(dirname)/c.launch", ' if="$(eval 1 == 1)"', (), 0),
        ("$(dirname)/c.launch", "", (), 1),
        ("$(find arm_sim)/launch/a.launch", "", (), 0),
        ("$(find arm_sim)/launch/b.launch", "", (), 1),
        ("$(find arm_sim)/launch/b.launch", "", ("arm_sim",), 0),
        ("$(find camera_launch)/launch/b.launch", "", (), 0),
    ],
)
def test_a_file_that_may_be_there_is_no_fault(
    tmp_path: Path, path: str, condition: str, others: tuple[str, ...], faults: int
) -> None:
    files = {
        "launch/a.launch": f'<launch><include file="{path}"{condition}/></launch>',
        "launch/b.launch": "<launch/>",
    }
    assert len(loaded(tmp_path, files, others=others).include_faults) == faults


def test_includes_that_multiply_come_to_an_end(tmp_path: Path) -> None:
    twice = '<include file="$(dirname)/a.launch"/>' * 2
    assert loaded(tmp_path, {"launch/a.launch": f"<launch>{twice}</launch>"}).include_faults


def test_other_packages_are_left_alone(tmp_path: Path) -> None:
    file = one(tmp_path, '<include file="$(find turtlesim)/launch/x.launch"/><include file="/etc/passwd"/>')
    assert file.include_faults == ()
    assert file.includes == ("$(find turtlesim)/launch/x.launch", "/etc/passwd")


@pytest.mark.parametrize(
    ("body", "names"),
    [
        ('<param name="x" value="1"/>', ["/x"]),
        ('<group ns="g"><param name="x" value="1"/><param name="/y" value="1"/></group>', ["/g/x", "/y"]),
        ('<node name="n"><param name="x" value="1"/></node>', ["/n/x"]),
        (
            '<node name="n" ns="g"><param name="~x" value="1"/><param name="/y" value="1"/></node>',
            ["/g/n/x", "/g/n/y"],
        ),
        ('<param name="~x" value="1"/><node name="n"/><node name="m"/>', ["/n/x", "/m/x"]),
        ('<group><param name="~x" value="1"/></group><node name="n"/>', []),
        ('<node name="n"><rosparam param="x">1</rosparam></node>', ["/n/x"]),
        ('<group ns="g"><rosparam param="x">[1, 2]</rosparam></group>', ["/g/x"]),
        ('<rosparam param="x">\na: 1\nb: 2\n</rosparam><rosparam>c: 1</rosparam>', []),
        ('<rosparam param="x" file="x.yaml"/><rosparam param="y" command="delete"/>', []),
    ],
)
def test_params(tmp_path: Path, body: str, names: list[str]) -> None:
    assert [p.name for p in one(tmp_path, body).params] == names


@pytest.mark.parametrize(
    ("body", "source", "namespace"),
    [
        ('<rosparam file="$(find pkg)/config/c.yaml"/>', "$(find pkg)/config/c.yaml", "/"),
        (
            '<rosparam command="load" file="$(dirname)/../c.yaml" ns="g"/>',
            "$(find pkg)/launch/../c.yaml",
            "/g/",
        ),
        ('<node name="n"><rosparam file="a.yaml" param="p"/></node>', "a.yaml", "/n/p/"),
        ("<rosparam>a: 1</rosparam>", None, "/"),
    ],
)
def test_loads(tmp_path: Path, body: str, source: str | None, namespace: str) -> None:
    (load,) = one(tmp_path, body).loads
    assert (load.source, load.namespace, load.command) == (source, namespace, "load")


def test_tests_and_unknown_tags(tmp_path: Path) -> None:
    file = one(
        tmp_path, '<test test-name="t" pkg="pkg" type="t.py"/>\n<Node name="x"/><group>\n<nodes/></group>'
    )
    assert [t.type for t in file.tests] == ["t.py"]
    assert file.brings == ()
    assert file.unknown_tags == (("Node", 2), ("nodes", 3))


def test_remaps_reach_included_nodes(tmp_path: Path) -> None:
    files = {
        "launch/a.launch": '<launch><remap from="chatter" to="talk"/><include file="$(dirname)/b.launch"/></launch>',
        "launch/b.launch": '<launch><node name="n"><remap from="a" to="b"/></node></launch>',
    }
    assert loaded(tmp_path, files).brings[0].remaps == (("chatter", "talk"), ("a", "b"))


def test_one_broken_file_does_not_speak_for_the_next() -> None:
    parse_launch("<launch>\n<node name=“x”/></launch>".encode(), "a.launch")
    fault = parse_launch(b'<launch\n<node pkg="a"/></launch>', "b.launch").fault
    assert fault is not None
    assert fault.cause.startswith("the tag `<launch` is not finished")


def test_arguments_that_a_run_gives_decide_the_names(tmp_path: Path) -> None:
    """A scenario starts `roslaunch pkg a.launch robot:=tb3`: the names of its nodes are not those of the defaults."""
    text = '<launch><arg name="robot" default="r"/><node pkg="pkg" type="x.py" name="x" ns="$(arg robot)"/></launch>'
    (tmp_path / "a.launch").write_text(text)
    found = read_launch_files(tmp_path, [("a.launch", "a.launch")], ("pkg",), {("a.launch", ("robot:=tb3",))})
    facts = PackageFacts(
        name="pkg", path=".", manifest=None, manifest_fault=None, cmake=None, files=(), launch_files=found[:1],
        launched=found[1:],
    )  # fmt: skip
    other = ("roslaunch", "pkg", "a.launch")
    names = [
        facts.as_launched([argv]).launch_files[0].brings[0].full_name
        for argv in (other, (*other, "robot:=tb3"))
    ]
    assert names == ["/r/x", "/tb3/x"]


@pytest.mark.parametrize(
    ("asked", "name", "is_slip"),
    [
        ("hearrer", "hearer", True),
        ("Talker", "talker", True),
        ("out", "output", True),
        ("map", "map_file", False),
        ("x_pose", "y_pose", False),
        ("robot_a", "robot_b", False),
        ("robot1", "robot2", False),
    ],
)
def test_arguments_that_one_letter_tells_apart_on_purpose_are_no_slip(asked, name, is_slip):
    assert _is_slip(asked, name) is is_slip
