from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from grader.model.result import ErrorInfo
from grader.model.verdict import Status
from grader.report.junit import render_junit
from tests.report.hostile import result
from tests.support.a_class import criterion


def test_one_case_a_criterion_with_its_outcome_and_points():
    suite = etree.fromstring(render_junit(result())).find("testsuite")
    outcomes = {case.get("name"): [child.tag for child in case][:-1] for case in suite.iter("testcase")}
    assert outcomes == {
        "manifest": [],
        "chatter-rate": ["failure"],
        "talker-node": ["failure"],
        "counter-start": ["skipped"],
        "counter-step": ["skipped"],
        "counter-wrap": ["skipped"],
        "listener-chatter": ["failure"],
        "build": ["error"],
        "launch": ["error"],
        "style": ["skipped"],
        "talker-name": ["failure"],
    }
    assert [suite.get(k) for k in ("tests", "failures", "errors", "skipped")] == ["11", "4", "2", "4"]
    partial = suite.find("properties/property[@name='points:listener-chatter']")
    assert partial.get("value") == "7.5/15"
    assert "\npoints: 7.5/15" in suite.findtext("testcase[@name='listener-chatter']/system-out")


@given(st.text(st.characters(codec="utf-8"), max_size=40), st.sampled_from(list(Status)))
def test_any_text_is_well_formed(text, status):
    hostile = criterion("c", status, 0, 1, message=text, hint=text, measured=text, title=text)
    root = etree.fromstring(render_junit(result(criteria=(hostile,))))
    assert root.find("testsuite/testcase").get("name") == "c"


@pytest.mark.parametrize("character", ["\x00", "\x1b", "\x0b", "\ufffe", "\uffff", "\U0001ffff", "]]>"])
def test_what_xml_cannot_hold_is_written_out(character):
    xml = render_junit(result(criteria=(criterion("c", Status.FAIL, 0, 1, message=f"a{character}b"),)))
    message = etree.fromstring(xml).find("testsuite/testcase/failure").get("message")
    assert message.startswith("a")
    assert message.endswith("b")
    assert message == "a]]>b" if character == "]]>" else "\\" in message


def test_an_error_of_the_whole_grading_is_a_case_of_its_own():
    failed = result(
        criteria=(), status="error", error=ErrorInfo(kind="arena", message="no master", hint="try again")
    )
    suite = etree.fromstring(render_junit(failed)).find("testsuite")
    assert suite.get("errors") == "1"
    assert suite.find("testcase/error").get("message") == "no master"
