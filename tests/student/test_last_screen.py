"""Five typical mistakes on a terminal of 80 by 24: what is wrong, where, and how to fix it, without scrolling."""

from __future__ import annotations

import os
import re
import shutil
import sys
from contextlib import suppress
from pathlib import Path

import pexpect
import pyte
import pytest

from fixtures.make import faulty_package
from grader.report.sentences import MINUS

ROOT = Path(__file__).resolve().parents[2]
COLUMNS, ROWS = 80, 24
SECONDS = 300
FULL = pytest.mark.full
MISTAKES = [
    (
        "mcr2-basic-comms/talker-semicolon",
        f"✗ talker-executable {MINUS}25 in all scripts/talker.py:11",
        "SyntaxError: the line that begins a block ends with `:`",
        "while not rospy.is_shutdown();",
        "fix: on line 11, write `while not rospy.is_shutdown():`",
    ),
    (
        "mcr2-basic-comms/message-without-time",
        f"✗ message {MINUS}5",
        "a message reads 'hello world'",
        "scripts/talker.py:12",
        'fix: publish "hello world %s" % rospy.get_time()',
    ),
    (
        "mcr2-basic-comms/launch-wrong-package",
        "◐ launch-xml",
        "launch/activity1.launch:3",
        "there is no talker.py in a package basic_coms",
        '3 | <node name="talker" pkg="basic_coms"',
        'fix: on line 3, write pkg="basic_comms"',
    ),
    (
        "mcr2-basic-comms/rate-sleep-without-brackets",
        "✗ chatter-rate",
        "scripts/talker.py:",
        "rate.sleep",
        "fix: ",
    ),
    (
        "mcr2-basic-comms/listener-not-executable",
        f"◐ cmake-install {MINUS}10 in all CMakeLists.txt:48",
        "fix: write scripts/listener.py into it, after PROGRAMS; the build then makes scripts/listener.py executable",
        f"also costs: listener-executable {MINUS}5",
    ),
]


def last_screen(argv: list[str], folder: Path) -> list[str]:
    """Run it at a terminal, and return the rows that are seen at the end."""
    screen = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.Stream(screen)
    child = pexpect.spawn(
        sys.executable,
        ["-m", "grader", *argv],
        cwd=str(folder),
        env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "LC_ALL": "C.UTF-8"},
        encoding="utf-8",
        timeout=SECONDS,
        dimensions=(ROWS, COLUMNS),
    )
    with suppress(pexpect.EOF):
        while True:
            stream.feed(child.read_nonblocking(4096, timeout=SECONDS))
    child.close()
    return [row.rstrip() for row in screen.display]


@pytest.mark.ros
@pytest.mark.parametrize(
    "mistake",
    [pytest.param(one, marks=[FULL] if index else [], id=one[0]) for index, one in enumerate(MISTAKES)],
)
def test_the_last_screen_says_what_where_and_how(mistake: tuple[str, ...], tmp_path: Path) -> None:
    lab, _, name = mistake[0].partition("/")
    shutil.copytree(faulty_package(lab, name), tmp_path / "src")
    (package,) = (path.parent for path in (tmp_path / "src").rglob("package.xml"))
    rows = last_screen(["check", "--rubric", lab], package)
    seen = " ".join(" ".join(rows).split())
    assert [words for words in mistake[1:] if words not in seen] == [], "\n".join(rows)
    assert "Report: " in seen
    assert re.search(r"\d thing(s)? to fix", seen)
    assert (package.parent / ".grader" / package.name / "report.html").is_file()
    assert (package.parent / ".grader" / ".gitignore").read_text() == "*\n"
