"""What is the same diagnosis, and what is not."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from grader.model.batch import Entry
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.report.class_page.submissions import WORDINGS_MAX, Diagnosis, gather, reduced
from tests.report.class_page.made_up import made_up_rows, made_up_run


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("src/talker.py is not executable", "scripts/my_talker.py is not executable"),
        ("/chatter has 5.02 Hz, not 10 Hz", "/chatter has 4.9 Hz, not 10 Hz"),
        ("there is no node /talker; there is /tolker", "there is no node /talker; there are /a, /b and /c"),
        ("NameError: name 'rospyy' is not defined", "NameError: name 'pub' is not defined"),
        ("src/a.cpp:12: expected ';'", "src/node.cpp:7: expected ')'"),
        ("prints 3 of 8 messages", "prints 0 of 8 messages"),
        ("after 127 comes -128", "after 12 comes 1"),
    ],
)
def test_numbers_and_names_are_no_difference(one, other) -> None:
    assert reduced(one) == reduced(other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("src/talker.py is not executable", "src/talker.py has no shebang line"),
        ("catkin_make failed", "catkin_make took too long"),
        ("no message came on /chatter", "only the first message is printed"),
    ],
)
def test_other_words_are(one, other) -> None:
    assert reduced(one) != reduced(other)


def of(*messages: str) -> list[GradingResult]:
    """Submissions that lost the first criterion with these messages, and all others for nothing."""
    found = []
    for message, (_, result) in zip(messages, made_up_rows(10 * len(messages)), strict=False):
        lost = result.criteria[0].model_copy(update={"status": Status.FAIL, "message": message})
        found.append(result.model_copy(update={"criteria": (lost,), "overrides": (), "error": None}))
    return found


def grouped(results: Sequence[GradingResult]) -> Sequence[Diagnosis]:
    return gather(made_up_run(1), [(Entry(id="ada", source=""), result) for result in results]).diagnoses


def test_the_largest_comes_first_in_the_words_of_most() -> None:
    first, second = grouped(of("a is 1", "b is 2", "b is 2", "x", "b is 3", "a is 1"))[:2]
    assert (first.criterion, first.message, first.members) == ("manifest", "b is 2", [1, 2, 4])
    assert second.message == "a is 1"


def test_a_diagnosis_of_very_many_wordings_stays_small() -> None:
    (found,) = grouped(of(*(f"{number} Hz" for number in range(100))))
    assert len(found.members) == 100
    assert len(found.wordings) == WORDINGS_MAX
    assert found.more


def test_what_a_person_decided_keeps_the_words_of_the_check() -> None:
    decided = [result for _, result in made_up_rows(300) if result.overrides]
    assert decided
    assert not any("A. Miller" in found.message for found in grouped(decided))
