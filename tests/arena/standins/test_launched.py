"""What a student's package asks of packages and programs that this machine lacks, in one real run."""

from __future__ import annotations

import itertools
from statistics import median

import pytest

from grader.evidence.run import Run
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import make_place, printed, run

pytestmark = pytest.mark.ros

LAUNCH = """<launch>
  <node name="talker" pkg="rospy_tutorials" type="talker" output="screen"/>
  <node name="listener" pkg="rospy_tutorials" type="listener.py" output="screen"/>
  <node name="page" pkg="lab" type="page.sh" output="screen"/>
  <node name="imports" pkg="lab" type="imports.py" output="screen"/>
</launch>
"""
PAGE = """#!/bin/bash
URL="https://www.e-yantra.org/?a=<b>&c"
echo "** Opening $URL **"
firefox -new-window "$URL"
xdg-open $'bell\\a' é
echo "done $?"
"""
IMPORTS = """#!/usr/bin/env python
import rospy, webbrowser
from rospy_tutorials.msg import Floats, HeaderString
from rospy_tutorials.srv import AddTwoInts, AddTwoIntsResponse
from std_srvs.srv import *
from turtlesim.msg import Color, Pose
from turtlesim.srv import *
rospy.init_node("imports")
print(Pose(x=1.5).x, AddTwoIntsResponse(3).sum, SpawnRequest(name="t").name, EmptyResponse.__name__)
print(webbrowser.open("http://example.org"))
rospy.spin()
"""
FILES = {"launch/all.launch": LAUNCH, "launch/page.sh": PAGE, "scripts/imports.py": IMPORTS}


@pytest.fixture(scope="module", params=["auto", "none"])
def launched(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    start = (Start(name="all", launch="all.launch"),)
    until = Until(window_s=2.5, topics=("/chatter",), first_message_s=20)
    scenario = Scenario(title="stand-ins", start=start, until=until)
    folder = tmp_path_factory.mktemp("launched")
    with make_place(FILES, sandbox=request.param) as place:
        (place.workspace.repaired / "lab" / "launch" / "page.sh").chmod(0o755)
        return run(place, scenario, folder / "run.mcap")


@pytest.mark.full
def test_talker_and_listener_are_connected_under_the_launch_files_names(launched: Run) -> None:
    (channel,) = launched.student_channels("/chatter")
    assert (channel.callerid, channel.type) == ("/talker", "std_msgs/String")
    texts = channel.data
    assert 10 <= len(texts) <= 32
    seconds = [float(text.removeprefix("hello world ")) for text in texts]
    gaps_s = [later - earlier for earlier, later in itertools.pairwise(seconds)]
    assert min(gaps_s) > 0
    assert median(gaps_s) == pytest.approx(0.1, rel=0.2)
    told = [line.partition(": /listenerI heard ")[2] for line in printed(launched, "all")]
    heard = [text for text in told if text]
    assert set(heard) <= set(texts)
    assert len(heard) > len(texts) / 2
    assert any("/listener" in e.subscribers.get("/chatter", ()) for _, e in launched.graph)


def test_what_was_opened_is_told(launched: Run) -> None:
    opened = [(e.actor, e.value) for _, e in launched.actors if e.action == "open"]
    assert opened[0] == ("firefox", ["-new-window", "https://www.e-yantra.org/?a=<b>&c"])
    assert ("xdg-open", ["bell\ufffd", "é"]) in opened
    assert len([actor for actor, _ in opened if actor not in {"firefox", "xdg-open"}]) == 1
    lines = printed(launched, "all")
    assert "done 0" in lines
    assert "True" in lines


def test_messages_and_services_can_be_imported(launched: Run) -> None:
    assert "1.5 3 t EmptyResponse" in printed(launched, "all")
