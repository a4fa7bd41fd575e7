"""Which scenarios a saved file concerns: for all labs, and in doubt all of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.watching.labs import LABS, append, concerned_by, copy_of, rubric, write

LEEDS = "leeds-comp3631-lab1"
PYTHON = "#!/usr/bin/env python3\n"

SAVED = [
    (LEEDS, "src/numeric_talker.py", {"talker", "wraps"}),
    (LEEDS, "src/numeric_listener.py", {"listener"}),
    (LEEDS, "src/talker.py", {"launch"}),
    (LEEDS, "launch/lab1.launch", {"launch"}),
    ("sheffield-com2009-week1", "src/publisher.py", {"publisher", "launch"}),
    ("sheffield-com2009-week1", "src/subscriber.py", {"subscriber", "launch"}),
    ("sheffield-com2009-week1", "launch/pub_sub.launch", {"launch"}),
    ("mcr2-basic-comms", "scripts/talker.py", {"talker", "launch"}),
    ("mcr2-basic-comms", "scripts/listener.py", {"listener", "launch"}),
    ("mcr2-basic-comms", "launch/activity1.launch", {"launch"}),
    ("york-ele00118m-lab7", "scripts/sender.py", {"sender", "two-senders"}),
    ("york-ele00118m-lab7", "scripts/receiver.py", {"receiver", "two-senders"}),
    ("eyantra-ros-basics", "scripts/node_hello_ros.py", {"hello", "web"}),
    ("eyantra-ros-basics", "scripts/node_param_get_set.py", {"param", "load-yaml"}),
    ("eyantra-ros-basics", "config/config_my.yaml", {"config", "param", "load-yaml"}),
    ("eyantra-ros-basics", "launch/chatter.launch", {"chatter"}),
    ("eyantra-ros-basics", "launch/turtlesim.launch", {"turtlesim"}),
    ("eyantra-ros-basics", "launch/load_yaml.launch", {"load-yaml"}),
    ("eyantra-ros-basics", "launch/webpage_launch.sh", {"web"}),
]


def shown(value: str | set[str]) -> str:
    """In a test's name: the same in every process, which a set alone is not."""
    return value if isinstance(value, str) else ",".join(sorted(value))


@pytest.mark.parametrize(("lab", "path", "expected"), SAVED, ids=shown)
def test_a_saved_file_concerns_the_scenarios_that_use_it(lab, path, expected, tmp_path) -> None:
    package = copy_of(lab, tmp_path)
    file = package / path
    change = "\n<!-- changed -->\n" if file.suffix == ".launch" else "\n# changed\n"
    assert concerned_by(lab, package, lambda: append(file, change)) == expected


@pytest.mark.parametrize("lab", LABS)
@pytest.mark.parametrize(
    "path",
    ["package.xml", "CMakeLists.txt", "msg/Count.msg", "srv/Add.srv", "action/Go.action", "src/node.cpp",
     "include/node.h", "cmake/more.cmake", "setup.py", "src/rospy.py", "scripts/random.py", "lib/yaml/__init__.py"],
)  # fmt: skip
def test_what_decides_the_build_or_every_import_concerns_everything(lab, path, tmp_path) -> None:
    package = copy_of(lab, tmp_path)
    text = (package / path).read_text() + "\n" if (package / path).exists() else "int8 n\n"
    everything = frozenset(rubric(lab).rubric.scenarios)
    assert concerned_by(lab, package, lambda: write(package / path, text)) == everything


@pytest.mark.parametrize("lab", LABS)
@pytest.mark.parametrize("path", ["README.md", "docs/notes.txt", "rviz/view.rviz", "scripts/scratch.py"])
def test_what_no_run_uses_concerns_none(lab, path, tmp_path) -> None:
    package = copy_of(lab, tmp_path)
    assert concerned_by(lab, package, lambda: write(package / path, "x = 1\n")) == frozenset()


@pytest.mark.parametrize("lab", LABS)
def test_nothing_changed_concerns_none(lab, tmp_path) -> None:
    package = copy_of(lab, tmp_path)
    assert concerned_by(lab, package, lambda: os.utime(package / "package.xml")) == frozenset()


@pytest.mark.parametrize("lab", LABS)
def test_every_file_that_a_scenario_starts_concerns_it(lab, tmp_path) -> None:
    for name, scenario in rubric(lab).rubric.scenarios.items():
        for start in scenario.start:
            wanted = start.script or start.launch or start.load
            if wanted is not None:
                package = copy_of(lab, tmp_path / f"{name}-{start.name}")
                (file,) = package.rglob(Path(wanted).name)
                assert name in concerned_by(lab, package, file.unlink)


def test_an_executable_bit_is_a_change(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    found = concerned_by(LEEDS, package, lambda: (package / "src/numeric_talker.py").chmod(0o644))
    assert found == {"talker", "wraps"}


def test_a_renamed_script_concerns_who_started_the_one_and_who_starts_the_other(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    change = lambda: (package / "src/numeric_talker.py").rename(package / "src/listener.py")  # noqa: E731
    assert concerned_by(LEEDS, package, change) == {"talker", "wraps", "launch"}


def test_a_second_script_of_the_same_name_may_be_the_one_that_is_started(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    assert concerned_by(LEEDS, package, lambda: write(package / "scripts/numeric_talker.py", PYTHON)) == {
        "talker", "wraps"
    }  # fmt: skip


@pytest.mark.parametrize(
    "line",
    ["import helper", "from helper import count", "from lab1.helper import count", "from .helper import count",
     "from . import helper", "def f():\n    import helper", "with open('helper.py'): pass",
     "import helper\nthis is no Python"],
)  # fmt: skip
def test_who_imports_a_module_is_concerned_by_it(line, tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    write(package / "src/helper.py", "count = 1\n")
    append(package / "src/numeric_listener.py", f"\n{line}\n")
    assert concerned_by(LEEDS, package, lambda: write(package / "src/helper.py", "count = 2\n")) == {
        "listener"
    }


def test_imports_are_followed_through_other_modules(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    deep = write(package / "src/lab1/deep.py", "count = 1\n")
    write(package / "src/lab1/__init__.py", "from .deep import count\n")
    append(package / "src/numeric_listener.py", "\nimport lab1\n")
    assert concerned_by(LEEDS, package, lambda: append(deep)) == {"listener"}


def test_includes_are_followed_through_launch_files(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    part = write(
        package / "launch/parts/b.launch", '<launch><rosparam file="$(find lab1)/config/c.yaml"/></launch>'
    )
    config = write(package / "config/c.yaml", "a: 1\n")
    write(
        package / "launch/lab1.launch",
        '<launch><include file="$(find lab1)/launch/parts/b.launch"/></launch>',
    )
    assert concerned_by(LEEDS, package, lambda: append(part, " ")) == {"launch"}
    assert concerned_by(LEEDS, package, lambda: append(config)) == {"launch"}


@pytest.mark.parametrize(
    "written",
    ['<node pkg="lab1" type="$(arg who).py" name="n"/>', '<include file="$(find lab1)/launch/$(env ROBOT).launch"/>',
     '<node pkg="lab1" type="tal&#107;er2.py" name="n"/>', '<param name="a" command="cat whatever"/>'],
)  # fmt: skip
def test_a_launch_file_that_works_names_out_is_concerned_by_any_file(written, tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    write(package / "launch/lab1.launch", f"<launch>{written}</launch>")
    assert concerned_by(LEEDS, package, lambda: write(package / "notes.txt", "x")) == {"launch"}


@pytest.mark.parametrize(
    "line",
    ["open(name)", "import importlib", "import glob", "subprocess.call(words)", "os.system(words)",
     "__import__(name)", "rospkg.RosPack().get_path('lab1')", "exec(text)", "os.path.dirname(here)"],
)  # fmt: skip
def test_a_script_that_finds_files_by_itself_is_concerned_by_any_file(line, tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    append(package / "src/numeric_listener.py", f"\n{line}\n")
    assert concerned_by(LEEDS, package, lambda: write(package / "data/odd.bin", "x")) == {"listener"}


def test_a_file_that_is_only_part_of_anothers_name_is_another_one(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    write(
        package / "launch/lab1.launch",
        '<launch><node pkg="lab1" type="numeric_talker.py" name="t"/></launch>',
    )
    assert concerned_by(LEEDS, package, lambda: append(package / "src/talker.py")) == frozenset()


def test_a_file_that_cmake_reads_concerns_everything(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    append(package / "CMakeLists.txt", "\nexecute_process(COMMAND cat ${somewhere})\n")
    everything = frozenset(rubric(LEEDS).rubric.scenarios)
    assert concerned_by(LEEDS, package, lambda: write(package / "notes.txt", "x")) == everything


def test_a_file_that_cmake_only_installs_concerns_who_uses_it(tmp_path) -> None:
    package = copy_of("mcr2-basic-comms", tmp_path)
    assert "listener.py" in (package / "CMakeLists.txt").read_text()
    found = concerned_by("mcr2-basic-comms", package, lambda: append(package / "scripts/listener.py"))
    assert found == {"listener", "launch"}


def test_a_link_is_followed_inside_of_the_package(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    real = write(package / "lib/real.py", PYTHON)
    (package / "src/numeric_listener.py").unlink()
    (package / "src/numeric_listener.py").symlink_to("../lib/real.py")
    assert concerned_by(LEEDS, package, lambda: append(real)) == {"listener"}


def test_a_package_that_is_built_with_it_concerns_everything(tmp_path) -> None:
    package = copy_of(LEEDS, tmp_path)
    other = copy_of("mcr2-basic-comms", tmp_path)
    manifest = package / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", "<depend>basic_comms</depend></package>"))
    from tests.watching.labs import concerned, picture  # noqa: PLC0415

    before = picture(tmp_path)
    assert {path.split("/")[0] for path in before.others} == {"basic_comms"}
    append(other / "scripts/talker.py")
    assert concerned(rubric(LEEDS).rubric, before, picture(tmp_path)) == set(rubric(LEEDS).rubric.scenarios)


LINES = st.sampled_from(
    [
        "import a",
        "from b import x",
        "x = 1",
        "open(n)",
        "'c.yaml'",
        "<node type='a.py'/>",
        "import",
        "$(arg x)",
        "\x00",
    ]
)
NAMES = (
    "src/numeric_talker.py",
    "src/a.py",
    "src/b.py",
    "launch/lab1.launch",
    "config/c.yaml",
    "src/x/__init__.py",
)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    texts=st.dictionaries(st.sampled_from(NAMES), st.lists(LINES, max_size=4).map("\n".join)), data=st.data()
)
def test_a_change_and_its_way_back_concern_the_same(texts, data, tmp_path_factory) -> None:
    package = copy_of(LEEDS, tmp_path_factory.mktemp("lab"))
    name = data.draw(st.sampled_from(NAMES))
    for path, text in texts.items():
        write(package / path, text)
    kept = (package / name).read_text() if (package / name).exists() else None
    there = concerned_by(LEEDS, package, lambda: write(package / name, "changed = 2\n"))

    def back() -> None:
        (package / name).unlink() if kept is None else write(package / name, kept)

    assert concerned_by(LEEDS, package, back) == there
