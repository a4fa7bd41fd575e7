from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.package.launch import is_launch_file, parse_launch, read_launch_files

LAUNCH = """<launch>
  <remap from="a" to="b"/>
  <!-- <node pkg="lab1" type="old.py" name="old"/> -->
  <node pkg="lab1" type="talker.py" name="talker" output="screen" launch-prefix="xterm -e" args="-x"/>
  <group ns="robot">
    <remap from="c" to="d"/>
    <node pkg="lab1" type="listener.py"
          name="listener" ns="n">
      <remap from="e" to="f"/>
    </node>
  </group>
  <include file="$(find lab1)/launch/other.launch"/>
  <remap from="late" to="later"/>
  <node pkg="lab1" type="off.py" name="off" if="false"/>
  <node pkg="lab1" type="off.py" name="off" unless="1"/>
  <node pkg="lab1" type="maybe.py" name="maybe" if="$(arg x)"/>
</launch>
"""


def test_nodes_remaps_includes_and_lines():
    launch = parse_launch(LAUNCH.encode(), "launch/a.launch")
    assert launch.fault is None
    assert [(n.name, n.line) for n in launch.nodes] == [("talker", 4), ("listener", 7), ("maybe", 16)]
    talker, listener, maybe = launch.nodes
    assert (talker.output, talker.launch_prefix, talker.args, talker.ns) == ("screen", "xterm -e", "-x", None)
    assert talker.remaps == (("a", "b"),)
    assert listener.remaps == (("a", "b"), ("c", "d"), ("e", "f"))
    assert maybe.remaps == (("a", "b"), ("late", "later"))
    assert launch.includes == ("$(find lab1)/launch/other.launch",)


def test_remaps_below_all_nodes_of_their_place_are_late():
    assert parse_launch(LAUNCH.encode(), "a.launch").late_remaps == ()
    node, remap = '<node pkg="p" type="t" name="{}"/>', '<remap from="{}" to="b"/>\n'
    text = f'<launch>\n<group ns="g">\n{node.format("n")}\n{remap.format("x")}</group>\n{remap.format("y")}</launch>'
    late = parse_launch(text.encode(), "a.launch").late_remaps
    assert [(one.value, one.line, one.namespace, one.above) for one in late] == [
        ("x", 4, "/g/", 3),
        ("y", 6, "/", 2),
    ]
    assert parse_launch(f"<launch>{remap.format('x')}</launch>".encode(), "a.launch").late_remaps == ()


def test_attributes_that_are_not_there_are_none():
    (node,) = parse_launch(b'<launch><node type=""/></launch>', "a.launch").nodes
    assert (node.pkg, node.type, node.name, node.remaps) == (None, "", None, ())


@pytest.mark.parametrize(
    ("text", "line", "cause"),
    [
        ("", 1, "the file is empty"),
        ("hello <launch/>", 1, "there is something before the first tag"),
        ("<launch>\n<!-- a -- b -->\n</launch>", 2, "`--` is not allowed inside a comment"),
        ("<launch>\n<!-- a\n</launch>", 2, "never closed: write `-->`"),
        ("<launch>\n<!-- a -->\n<!-- b\n<node/>\n</launch>", 3, "never closed: write `-->`"),
        (
            '<launch>\n<node pkg="lab" type="<your script>" name="a"/>\n</launch>',
            2,
            "`<your script>` stands for what you have to write there: write that in its place",
        ),
        (
            '<launch>\n<node pkg="a">\n</launch>',
            2,
            "`<node>` on line 2 is still open where `</launch>` comes",
        ),
        ("<launch>\n</node>\n</launch>", 2, "`</node>` closes nothing"),
        (
            '<launch>\n<group ns="a">\n<remap from="a" to="b"/>\n</node>\n</group>\n</launch>',
            4,
            "no `<node>` is open there",
        ),
        (
            '<launch>\n<group>\n<!-- <node name="a"> -->\n<remap from="a" to="b"/>\n</node>\n</group>\n</launch>',
            3,
            "only a part of an element is in a comment",
        ),
        ("<launch>\n<group>\n<!-- </group> -->\n</launch>", 3, "only a part of an element is in a comment"),
        ("<launch>\n<node/>\n", 1, "`<launch>` on line 1 is never closed"),
        ('<launch\n<node pkg="a"/></launch>', 1, "the tag `<launch` is not finished"),
        ('<launch>\n<node pkg="a"type="b"/>\n</launch>', 2, "a space before each attribute"),
        ('<launch>\n<node_pkg = "a" type = "b"/>\n</launch>', 2, "write `<node pkg`: without that space"),
        ("<launch>\n<node pkg=a/></launch>", 2, "no quotes around it"),
        ("<launch>\n<node pkg=\u201ca\u201d/></launch>", 2, "typographic quote \u201c"),
        ('<launch>\n<node pkg="a/>\n<node/></launch>', 2, "closing quote is missing"),
        ("<launch>\n<group>\n</gruop>\n</launch>", 3, "write `</group>`"),
        ("<launch>\n<node pkg/></launch>", 2, "`pkg` has no value"),
        ('<launch>\n<node a="1" a="2"/></launch>', 2, "`a` is given twice"),
        ("<launch></launch>\n<launch></launch>", 2, "this line repeats the one above: delete line 2"),
        ("<launch></launch>\nbye", 2, "only one `<launch>`"),
        (
            "<launch>\n<node/>\n</launch>\n<node/>\n</launch>",
            3,
            "delete that one, since there is another",
        ),
        (
            "<launch>\n<!-- </launch> -->\n</launch>\n<node/>\n<node/>",
            3,
            "move that `</launch>` to the end",
        ),
        (
            "<launch>\n</launch>\n<launch>\n<node/>\n</launch>",
            3,
            "delete lines 2 and 3, `</launch>` and `<launch>`",
        ),
        (
            "<launch>\n<arg/>\n</launch>\n<launch>\n<arg/>\n</launch>",
            4,
            "text comes after the first block: delete it",
        ),
        ("<Launch></Launch>", 1, "`<Launch>`; roslaunch wants `<launch>` in lower case"),
        ("<robot/>", 1, "`<robot>`; roslaunch wants `<launch>`"),
        ("<launch>\n<launch/></launch>", 2, "a second `<launch>`"),
        ("<launch>a & b</launch>", 1, "`&amp;`"),
        ('<launch>\n<param name="a" value="1 < 2"/>\n</launch>', 2, "`<` within a value is written `&lt;`"),
        ("<launch>\n< node/></launch>", 2, "delete the space after it"),
        ("<launch>\n<<<<<<< HEAD\n</launch>", 2, "merge markers"),
        ("\n<?xml version='1.0'?><launch/>", 2, "comes before `<?xml ... ?>`: delete it"),
        ("<launch>" + "<group>" * 400, None, "nested"),
    ],
)
def test_faults_in_plain_words(text, line, cause):
    launch = parse_launch(text.encode(), "a.launch")
    assert launch.nodes == ()
    assert cause in launch.fault.explanation
    assert line in {None, launch.fault.line}


def test_encodings_and_line_ends():
    text = '<?xml version="1.0" encoding="{}"?>\r\n<launch>\r\n<!-- \xe9 -->\r\n<node name="x"/></launch>'
    assert parse_launch(text.format("ISO-8859-1").encode("latin-1"), "a.launch").nodes[0].line == 4
    for name in (
        "latin-1",
        "latin1",
        "L1",
        "iso8859_15",
    ):  # as Python names them, whose XML reader roslaunch uses
        assert parse_launch(text.format(name).encode("latin-1"), "a.launch").nodes[0].line == 4
    unknown = parse_launch(text.format("uft-8").encode(), "a.launch")
    assert (unknown.fault.line, "`uft-8` is not the name" in unknown.fault.explanation) == (1, True)
    broken = parse_launch(text.format("UTF-8").encode("latin-1"), "a.launch")
    assert (broken.fault.line, "UTF-8" in broken.fault.explanation) == (3, True)
    assert parse_launch(b"\xef\xbb\xbf<launch/>", "a.launch").fault is None


def test_external_entities_are_not_read(tmp_path):
    (tmp_path / "secret").write_text("tell-nobody")
    text = f'<!DOCTYPE l [<!ENTITY x SYSTEM "{tmp_path}/secret">]><launch><node name="n">&x;</node></launch>'
    launch = parse_launch(text.encode(), "a.launch")
    assert launch.fault.kind == "Entity"
    assert "tell-nobody" not in launch.model_dump_json()


def test_found_by_name_and_never_followed_out(tmp_path):
    assert [is_launch_file(p) for p in ("Launch/A.launch", "b.launch.xml", "t.test", "launch.py")] == [
        True,
        True,
        True,
        False,
    ]
    (tmp_path / "out.launch").symlink_to("/etc/passwd")
    (launch,) = read_launch_files(tmp_path, [("out.launch", "out.launch")])
    assert launch.fault.kind == "OutsideLink"


@settings(derandomize=True)
@given(st.binary(max_size=200), st.integers(0, len(LAUNCH)))
def test_never_raises(noise, at):
    text = LAUNCH.encode()
    for data in (noise, text[:at] + noise + text[at:]):
        launch = parse_launch(data, "a.launch")
        assert launch.fault is not None or launch.root == "launch"


def test_nodes_of_a_file_that_is_not_well_formed_can_be_read():
    file = parse_launch(
        b'<launch>\n  <node pkg="a" type="b">\n  <node pkg="c" type="d"/>\n</launch>', "a.launch"
    )
    assert file.fault is not None
    assert [(node.line, node.type) for node in file.readable] == [(2, "b"), (3, "d")]
    assert parse_launch(b"", "a.launch").readable == file.nodes == file.brings == ()
