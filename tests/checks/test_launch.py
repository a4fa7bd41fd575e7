"""roslaunch's own words, as version 1.15 prints them, and what the checks make of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.checks.support.launch import died, finished, is_exact, name_pattern, refusal, why_died
from grader.checks.support.launch_slips import right_remap
from grader.checks.support.parameters import explain_yaml, explain_yaml_line
from grader.checks.support.shell_scripts import find_obstacle, unclosed_quote, value_given
from grader.evidence.run import Run
from grader.judging.facts import NO_PACKAGE
from grader.model.file_fault import Fault
from grader.model.launch_file import LaunchFile, LaunchLine, LaunchNode
from tests.package.trees import facts_of
from tests.support.timeline import build_runs

RED = "\x1b[31m{}\x1b[0m"


def printed(*lines: str) -> Run:
    console = [{"process": "roslaunch", "stream": "stderr", "line": line} for line in lines]
    return build_runs({"processes": [{"name": "roslaunch"}], "console": console})["run"]


def node(name: str, namespace: str = "/") -> LaunchNode:
    given = dict.fromkeys(("pkg", "type", "ns", "output", "launch_prefix", "args"))
    return LaunchNode(**given, name=name, namespace=namespace, remaps=(), line=1)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (["RLException: roslaunch file contains multiple nodes named [/a]."], "two nodes are named /a"),
        (["RLException: Invalid <node> tag: node name cannot contain a namespace. "], "slash in it"),
        (["RLException: <node> tag is missing required attribute: 'name'. Node xml is <node/>"], "no name"),
        (
            ["RLException: error loading <rosparam> tag: ", "\tfile does not exist [/w/config/cc.yaml]"],
            "cc.yaml",
        ),
        (
            [
                "RLException: error loading <rosparam> tag: ",
                "\tfile does not exist [$find(lab)/config/cc.yaml]",
            ],
            "$find(lab) is no substitution of roslaunch",
        ),
        (["Resource not found: pubsub_exampl", "ROS path [0]=/tmp"], "no package pubsub_exampl"),
        (
            [
                'Resource not found: The following package was not found in <arg default="$(find robt)/a"/>: robt'
            ],
            "no package robt",
        ),
        (
            [
                'Resource not found: The following package was not found in <arg default="$(find xacro)/a"/>: xacro'
            ],
            "it needs the package xacro, which this grading machine lacks",
        ),
        (["RLException: [/w/launch/arg.launch] requires the 'nm' arg to be set"], 'name="nm"'),
        (["RLException: Invalid <node> tag: output must be one of 'log', 'screen'. "], "lower case"),
        (
            ["RLException: Unable to launch [ns-10]. ", "If it is a script, you may be missing a '#!'"],
            "of ns",
        ),
        (
            [
                "RLException: error loading <rosparam> tag: ",
                "\t'param' attribute must be set for non-dictionary values",
                "XML is <rosparam>",
                "      red:34",
                "      green:139",
                "    </rosparam>",
            ],
            "red:34 has no space in it",
        ),
        (
            [
                "RLException: error loading <rosparam> tag: ",
                "\t'param' attribute must be set for non-dictionary values",
                'XML is <rosparam command="load" file="a.yaml"/>',
            ],
            "cannot load its file",
        ),
        (["RLException: ERROR: unknown machine [raspi]"], "no <machine> of the name raspi"),
        (["RLException: multiple files named [a.launch] in package [p]:"], "two launch files"),
        (
            ["RLException: Unknown substitution command [param hz]. Valid commands are"],
            "can read its <arg>s, and no parameters",
        ),
        (["RLException: Unknown substitution command [findpkg p]. Valid commands are"], "findpkg p"),
        (
            ["TypeError: cannot marshal None unless allow_none is enabled"],
            "a name in a <rosparam> has no value",
        ),
        (["RLException: Invalid roslaunch XML syntax: mismatched tag: line 3, column 2"], "not well-formed"),
    ],
)
def test_refusals(said: list[str], why: str) -> None:
    found = refusal(printed(*(RED.format(line) for line in said)), NO_PACKAGE)
    assert found is not None
    assert why in found.why
    assert found.hint
    assert not found.of_script


def test_a_refused_file_is_named_with_its_line() -> None:
    fault = Fault(file="launch/b.launch", line=3, kind="XMLSyntaxError", message="x", fix="write `</launch>`")
    file = LaunchFile(path="launch/b.launch", root=None, nodes=(), includes=(), fault=fault)
    package = NO_PACKAGE.model_copy(update={"launch_files": (file,)})
    found = refusal(
        printed(RED.format("RLException: Invalid roslaunch XML syntax: no element found")), package
    )
    assert found is not None
    assert "launch/b.launch is not well-formed" in found.why
    assert found.hint == fault.advice
    assert found.citations == (fault.place,)


@pytest.mark.parametrize(
    ("said", "hint"),
    [
        ("aro out", "write $(arg out)"),
        ("rg out", "write $(arg out)"),
        ("argout", "write $(arg out)"),
        ("out", 'write $(arg out), with <arg name="out" default="…"/> above it'),
        ("findlab", "write $(find "),
        ("fnd lab", "write $(find "),
    ],
)
def test_what_an_unknown_substitution_is_meant_for(said: str, hint: str) -> None:
    line = f"RLException: Unknown substitution command [{said}]. Valid commands are"
    found = refusal(printed(RED.format(line)), NO_PACKAGE)
    assert found is not None
    assert found.hint.startswith(hint)


def test_no_refusal() -> None:
    run = printed("started roslaunch server http://127.0.0.1:43899/", "[fin-8] process has finished cleanly")
    assert refusal(run, NO_PACKAGE) is None


def test_ends_of_nodes() -> None:
    run = printed(
        "\x1b[31m[robot/dies-6] process has died [pid 2, exit code -11, cmd /w/dies.py __name:=dies].",
        "\x1b[1m[fin_vm_23746_5988648383355795529-8] process has finished cleanly",
        "\x1b[31m=====REQUIRED process [pub_node-2] has died!",
        "process has died [pid 7, exit code 1, cmd /w/pub.py __name:=pub_node].",
        "\x1b[31m=====REQUIRED process [set_once-3] has died!",
        "process has finished cleanly",
    )
    assert died(run, node("dies", "/robot/")) == -11
    assert died(run, node("dies")) is None
    assert died(run, node("pub_node")) == 1
    assert died(run, node("set_once")) is None
    assert finished(run, node("set_once"))
    assert not finished(run, node("pub_node"))
    assert finished(run, node("$(anon fin)"))
    assert not finished(run, node("fin"))


@pytest.mark.parametrize(
    ("written", "name", "fits"),
    [
        ("talker", "/talker", True),
        ("talker", "/talker_1", False),
        ("t.lker", "/talker", False),
        ("$(anon talker)", "/talker_vm_23746_5988648383355795529", True),
        ("$(anon talker)", "/listener_vm_23746_5988648383355795529", False),
        ("a_$(eval 1+1)_b", "/a_2_b", True),
        ("a_$(eval 1+1)_b", "/a_2_c", False),
    ],
)
def test_names(written: str, name: str, *, fits: bool) -> None:
    assert bool(name_pattern(node(written)).fullmatch(name)) is fits
    assert is_exact(node(written)) is ("$(" not in written)


def test_yaml_words_name_the_last_line() -> None:
    words = explain_yaml(
        [
            "while parsing a block mapping",
            '  in "<u>", line 2, column 3:',
            "expected <block end>,",
            '  in "<u>", line 4, column 4:',
        ]
    )
    assert words is not None
    assert words.line == 4
    assert "line 4" in words.why
    assert explain_yaml(["something else"]) is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('a:\n  b:"x"  # text\n  c: 1', 'line 2 has no space after its `:`; line 2: write `b: "x"`'),
        ("a = 3", "line 1 has `=` in place of `:`; line 1: write `a: 3`"),
        ('a; "x y"', 'line 1 has `;` in place of `:`; line 1: write `a: "x y"`'),
        ('a "x y"', 'line 1 has no `:` after its name; line 1: write `a: "x y"`'),
        ("a\n  b: 3", "line 1 has no `:` after its name; line 1: write `a:`"),
        ('a: "x', 'line 1 opens " and does not close it; line 1: write `a: "x"`'),
        ('a: ""x"', 'line 1 has " twice; line 1: write `a: "x"`'),
        ("a: 'x''", "line 1 has ' twice; line 1: write `a: 'x'`"),
        ("a::\n  b: 3", "line 1 has `::` in place of `:` after its name; line 1: write `a:`"),
        ("a;\n  b: 3", "line 1 has `;` in place of `:` after its name; line 1: write `a:`"),
        ("a: \"\"\nb: ''", ""),
        ("a: x: y", 'line 1 has a `:` in its value; line 1: write `a: "x: y"`'),
        ("# a = 3\na: 'x: y'\nb: http://x.y\nc: 12:30\n- d: [1, 2]\ne: it's", ""),
        ("a: |\n  b = 3", ""),
        ("a: 3\nb: 4\nc = 5\nd = 6", ""),
    ],
)
def test_the_line_of_a_yaml_file_that_lacks_something(text: str, told: str) -> None:
    found = explain_yaml_line(text, until=2)
    assert (f"{found.why}; {found.hint}" if found else "") == told


@pytest.mark.parametrize(
    ("line", "right"),
    [
        ("firefox -new-window URL", "firefox -new-window $URL"),
        ("firefox '$URL'", 'firefox "$URL"'),
        ("firefox ${URL", "firefox ${URL}"),
        ("firefox $ULR", "firefox $URL"),
        ('firefox "${url}"', 'firefox "$URL"'),
        ("firefox $URL", ""),
        ("firefox", ""),
    ],
)
def test_a_line_of_a_shell_that_is_not_given_the_variable(line: str, right: str) -> None:
    assert value_given(line, "URL") == right


def test_a_node_that_lacks_what_the_build_makes_has_not_been_built(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "CMakeLists.txt").write_text("generate_messages()\n")
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/Reading.msg").write_text("int8 value\n")
    run = printed(
        "Traceback (most recent call last):",
        '  File "/ws/src/lab/node.py", line 1, in <module>',
        "    from lab.msg import Reading",
        "ModuleNotFoundError: No module named 'lab'",
        "[a-2] process has died [pid 7, exit code 1, cmd /ws/src/lab/node.py __name:=a].",
    )
    found = why_died(facts_of(tmp_path), run, node("a"))
    assert found is not None
    assert found.unbuilt
    assert found.verdict("it died").basis.unbuilt


@pytest.mark.parametrize(
    ("args", "told"),
    [
        ("-O walk.bag", True),
        ("-o walk --duration 30 -j", True),
        ("-O walk.bag /steps", False),
        ("-a -O walk.bag", False),
        ("-e /step.*", False),
    ],
)
def test_a_recorder_without_a_topic(tmp_path: Path, args: str, *, told: bool) -> None:
    run = build_runs(
        {
            "topics": [{"topic": "/steps", "count": 3}],
            "processes": [{"name": "roslaunch"}],
            "console": [
                {
                    "process": "roslaunch",
                    "stream": "stderr",
                    "line": "[rec-2] process has died [pid 4, exit code 1, cmd x].",
                }
            ],
        }
    )["run"]
    recorder = node("rec").model_copy(update={"pkg": "rosbag", "type": "record", "args": args})
    found = why_died(facts_of(tmp_path, "lab"), run, recorder)
    assert found is not None
    assert (f'write args="{args} /steps" in this <node>' == found.hint) is told


@pytest.mark.parametrize(
    ("remap", "published", "hint"),
    [
        (("/state", "light"), "/left/state", '<remap from="state" to="light"/>'),
        (("light", "state"), "/left/state", '<remap from="state" to="light"/>'),
        (("state", "/light"), "/light", '<remap from="state" to="light"/>'),
        (("state", "ligth"), "/left/ligth", 'on line 4 of a.launch, write to="light"'),
        (("state", "light"), "/left/lamp/state", "look at its <remap>"),
    ],
)
def test_a_remap_that_does_not_make_the_topic(remap: tuple[str, str], published: str, hint: str) -> None:
    line = LaunchLine(tag="remap", value=remap[1], file="a.launch", line=4)
    lamp = node("lamp", "/left/").model_copy(update={"remaps": (remap,), "renaming": (line,)})
    place, told = right_remap(lamp, "/left/light", [published])
    assert hint in told
    assert place.line == (1 if "look" in hint else 4)


PAGE = "https://www.e-yantra.org/"


@pytest.mark.parametrize(
    ("script", "given", "told"),
    [
        ("#!/bin/bash\nfirefox $1\n", False, (2, f"on line 2, write {PAGE} in place of $1")),
        ("#!/bin/bash\nfirefox $1\n", True, None),
        ('URL=${1}\nfirefox -new-tab "$URL"\n', False, (1, f"on line 1, write URL={PAGE}")),
        ("echo hi\nexit 0\nfirefox page\n", True, (2, "delete line 2")),
        ("if [ -z $DISPLAY ]; then\n  exit 1\nfi\nfirefox page\n", True, None),
        ("for i in 1 2; do\n  break\n  firefox page\ndone\n", True, (2, "delete line 2")),
        ("for i in 1 2; do\n  break\ndone\nfirefox page\n", True, None),
        ("if true; then exit; fi\nfirefox page\n", True, None),
        ("[ -f x ] && exit\nfirefox page\n", True, None),
        (
            'if [ "$1" = go ]\nthen\n  firefox page\nfi\n',
            False,
            (1, "take line 3 out of the block that begins on line 1"),
        ),
        ("if true\nthen\n  exit\nelse\n  firefox page\nfi\n", True, None),
        ("page() {\n  return\n}\nfirefox page\n", True, None),
        ("firefox page\nexit 0\n", False, None),
    ],
)
def test_what_keeps_a_shell_script_from_its_page(
    script: str, given: bool, told: tuple[int, str] | None
) -> None:
    found = find_obstacle(script.splitlines(), "firefox", PAGE, given=given)
    assert (found and (found.number, found.fix)) == told


@pytest.mark.parametrize(
    ("script", "told"),
    [
        ('#!/bin/bash\nURL="https://a\necho "it is $URL"\n', (2, 'on line 2, write `URL="https://a"`')),
        ("echo 'a\nfirefox page\n", (1, "on line 1, write `echo 'a'`")),
        ('# it\'s a page\necho "two\nlines"\nfirefox page\n', None),
    ],
)
def test_a_quote_that_a_shell_script_never_closes(script: str, told: tuple[int, str] | None) -> None:
    found = unclosed_quote(script.splitlines())
    assert (found and (found.number, found.fix)) == told
