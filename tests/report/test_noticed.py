"""Where notes are shown: every report says what was noticed, and that it costs nothing."""

from __future__ import annotations

import io
import json

from lxml import etree

from grader.model.result import Note
from grader.report.files import result_bytes
from grader.report.junit import render_junit
from grader.report.markdown import render_markdown
from grader.report.terminal import Terminal, open_console
from tests.report.hostile import result, rubric

NOTES = (
    Note(scenario="real", actor="talker.py", kind="refused", text="asked the master to shut down"),
    Note(scenario="package", actor="", kind="limit", text="had more than 400 processes"),
)
COSTS_NOTHING = "None of this cost any points."


def test_result_json_names_them_last_and_only_where_there_are_any():
    data = json.loads(result_bytes(result(notes=NOTES)))
    assert list(data)[-2:] == ["timing", "notes"]
    assert data["notes"][0] == {
        "scenario": "real",
        "actor": "talker.py",
        "kind": "refused",
        "text": "asked the master to shut down",
    }
    assert "notes" not in json.loads(result_bytes(result()))


def test_markdown_has_a_section():
    text = render_markdown(result(notes=NOTES), rubric())
    assert (
        f"<summary>Noticed while it ran (2)</summary>\n\n{COSTS_NOTHING}\n\n- `real, talker.py`: asked the master"
        in text
    )
    assert "- `build`: had more than 400 processes (over the limit)" in text
    assert "Noticed" not in render_markdown(result(), rubric())


def test_the_terminal_has_a_section():
    out = io.StringIO()
    Terminal(open_console(out)).report(result(notes=NOTES), rubric())
    assert "\nNoticed while it ran\n" in out.getvalue()
    assert "  real, talker.py: asked the master to shut down (refused)\n" in out.getvalue()
    assert COSTS_NOTHING in out.getvalue()


def test_junit_has_it_as_output_of_the_suite():
    suite = etree.fromstring(render_junit(result(notes=NOTES)))[0]
    assert suite[-1].tag == "system-out"
    assert suite[-1].text.splitlines() == [
        f"Noticed while it ran. {COSTS_NOTHING}",
        "real, talker.py: asked the master to shut down (refused)",
        "build: had more than 400 processes (over the limit)",
    ]
    assert etree.fromstring(render_junit(result())).find("testsuite/system-out") is None
