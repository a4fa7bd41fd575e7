"""Launch files that are not well-formed, and the one plain edit that makes each so."""

from __future__ import annotations

import pytest

from grader.package.launch import parse_launch
from grader.package.repairs.well_formed import well_formed

TALKER = '<node pkg="lab" type="talker.py" name="talker" output="screen"/>'
RIGHT = f"""\
<launch>
  {TALKER}
  <node pkg="lab" type="listener.py" name="listener"/>
</launch>
"""
EDITED = {
    "no slash": ("/>\n  <node", ">\n  <node"),
    "no slash in both": ("/>", ">"),
    "no end": (' output="screen"/>', ' output="screen"'),
    "half an end": ("/>\n  <node", "/\n  <node"),
    "root left open": ("</launch>\n", ""),
    "root misspelt": ("</launch>", "</lauch>"),
    "root in capitals": ("</launch>", "</Launch>"),
    "root opened twice": ("</launch>", "<launch>"),
    "no quotes": ('"talker.py"', "talker.py"),
    "no quotes in both": ('"lab"', "lab"),
    "no closing quote": ('"talker.py"', '"talker.py'),
    "no opening quote": ('"talker.py"', 'talker.py"'),
    "no last quote": ('"screen"', '"screen'),
    "typographic quotes": ('"talker.py"', "\u201ctalker.py\u201d"),
    "no space between attributes": ('"lab" type', '"lab"type'),
    "no equals sign": ('output="', 'output"'),
    "space after the bracket": ('<node pkg="lab" type="t', '< node pkg="lab" type="t'),
    "space in the end": ('"screen"/>', '"screen"/ >'),
    "two brackets": ('<node pkg="lab" type="t', '<<node pkg="lab" type="t'),
    "closes nothing": ("</launch>", "</node>\n</launch>"),
    "blank before the declaration": ("<launch>", "\n<?xml version='1.0'?>\n<launch>"),
    "a browser's line above the root": ("<launch>", "This file has no style of its own.\n<launch>"),
    "dashes in a comment": ("<launch>", "<launch>\n  <!-- first -- second --->"),
    "less than": ('"screen"', '"screen" if="$(eval 1 < 2)"'),
    "ampersand": ('"screen"', '"screen" args="a & b"'),
    "a quote here, the root there": ('"talker.py"', '"talker.py'),
}
"""What is written in place of what."""


@pytest.mark.parametrize("case", EDITED)
def test_a_plain_edit_brings_the_nodes_back(case: str) -> None:
    text = RIGHT.replace(*EDITED[case])
    text = text.replace("</launch>", "") if "root there" in case else text
    assert parse_launch(text.encode(), "a.launch").fault is not None
    found = parse_launch(well_formed(text, "a.launch", root="launch")[-1].encode(), "a.launch")
    assert found.fault is None
    nodes = [(node.pkg, node.type, node.name, node.unknown) for node in found.nodes]
    assert nodes == [("lab", "talker.py", "talker", ()), ("lab", "listener.py", "listener", ())]
    assert found.nodes[0].output == "screen"


def test_a_tag_over_several_lines_keeps_its_attributes() -> None:
    text = '<launch>\n<node\n pkg="lab"\n type="talker.py"\n name="talker"\n>\n</launch>\n'
    found = parse_launch(well_formed(text, "a.launch", root="launch")[-1].encode(), "a.launch")
    assert [(node.pkg, node.type, node.name) for node in found.nodes] == [("lab", "talker.py", "talker")]


def test_a_group_is_closed_behind_its_nodes() -> None:
    text = f'<launch>\n<group ns="left">\n{TALKER}\n</launch>\n'
    found = parse_launch(well_formed(text, "a.launch", root="launch")[-1].encode(), "a.launch")
    assert [node.full_name for node in found.brings] == ["/left/talker"]


@pytest.mark.parametrize(
    "text",
    [
        RIGHT,
        "",
        "roslaunch lab a.launch",
        RIGHT + "more text\n",
        f"<launch>\n<<<<<<< HEAD\n{TALKER}\n=======\n>>>>>>> main\n</launch>\n",
        RIGHT.replace('name="talker"', 'name="talker" name="other"'),
        "<launch>" + "<a" * 5_000,
    ],
)
def test_what_is_right_or_has_no_plain_edit_stays(text: str) -> None:
    assert well_formed(text, "a.launch", root="launch") == []


def test_a_root_that_is_opened_where_it_is_to_end_is_told_so() -> None:
    fault = parse_launch(RIGHT.replace("</launch>", "<launch>").encode(), "a.launch").fault
    assert fault is not None
    assert (fault.line, fault.advice) == (4, "line 4: write `</launch>`")


@pytest.mark.parametrize(
    ("lost", "place"),
    [("    </node>\n", "above line 6, write `</node>`"), ("  </group>\n", "above line 7, write `</group>`")],
)
def test_a_tag_with_tags_in_it_is_closed_below_them(lost: str, place: str) -> None:
    whole = """\
<launch>
  <group ns="arm">
    <node pkg="lab" type="a.py" name="a">
      <param name="rate" value="10"/>
      <remap from="in" to="out"/>
    </node>
  </group>
  <node pkg="lab" type="b.py" name="b"/>
</launch>
"""
    text = whole.replace(lost, "")
    fault = parse_launch(text.encode(), "a.launch").fault
    assert fault is not None
    assert fault.advice == place
    assert well_formed(text, "a.launch", root="launch") == [whole]


def test_the_attributes_of_another_tag_make_it_that_tag() -> None:
    text = '<launch>\n  <param command="load" file="a.yaml"/>\n</launch>\n'
    assert well_formed(text, "a.launch", root="launch") == [text.replace("param", "rosparam")]
