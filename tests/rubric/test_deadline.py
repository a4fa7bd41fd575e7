"""A rubric's deadline and late policy: how they are written, and every fault with its line."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest
import yaml
from jsonschema import Draft202012Validator

from grader.rubric.load import load_rubric
from grader.rubric.model import Late, Rubric
from grader.rubric.schema import rubric_schema
from tests.rubric.samples import SOUND, faults, spoiled

DEADLINE = "2026-11-20T23:59:00+01:00"
TIME = "must be a time with its zone, such as 2026-11-20T23:59:00+01:00"
LATE = "late: {lost: 10, of: possible, per: hour, grace_minutes: 15, cap: 50, cut_off_days: 7}"


def with_lines(*lines: str) -> tuple[str, str]:
    """A change that puts these lines below the package's."""
    return "package: lab1\n", "\n".join(["package: lab1", *lines, ""])


@pytest.mark.parametrize(
    "written",
    [
        DEADLINE,
        f'"{DEADLINE}"',
        "2026-11-20T22:59:00Z",
        "2026-11-20 23:59:00 +1",
        "2026-11-20 23:59:00+01:00",
        "2026-11-20T23:59+01:00",
        "2026-11-20t23:59:00.0+01:00",
    ],
)
def test_a_deadline_as_yaml_and_iso_8601_write_it(tmp_path, written):
    loaded = load_rubric(str(spoiled(tmp_path, with_lines(f"deadline: {written}"))))
    expected = datetime(2026, 11, 20, 23, 59, tzinfo=timezone(timedelta(hours=1)))
    assert loaded.rubric.deadline == expected
    assert loaded.rubric.late is None


def test_a_late_policy(tmp_path):
    loaded = load_rubric(str(spoiled(tmp_path, with_lines(f"deadline: {DEADLINE}", LATE))))
    assert loaded.rubric.late == Late(
        lost=10, of="possible", per="hour", grace_minutes=15, cap=50, cut_off_days=7
    )
    assert Rubric.model_validate_json(loaded.rubric.model_dump_json(by_alias=True)) == loaded.rubric


def test_what_a_late_policy_need_not_say(tmp_path):
    loaded = load_rubric(str(spoiled(tmp_path, with_lines(f"deadline: {DEADLINE}", "late: {lost: 10}"))))
    late = loaded.rubric.late
    assert (late.of, late.per, late.grace_minutes, late.cap, late.cut_off_days) == (
        "reached",
        "day",
        0,
        100,
        None,
    )


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("2026-11-20T23:59:00", f'{TIME}, not "2026-11-20T23:59:00"'),
        ("2026-11-20", f'{TIME}, not "2026-11-20"'),
        ("20.11.2026 23:59", f'{TIME}, not "20.11.2026 23:59"'),
        ("2026-11-20T23:59:00 Europe/Berlin", f'{TIME}, not "2026-11-20T23:59:00 Europe/Berlin"'),
        ("tomorrow", f'{TIME}, not "tomorrow"'),
        ("20261120", f"{TIME}, not 20261120"),
        ('"20261120"', "must be a time of the years 2000 to 2999"),
        ("0001-01-01T00:00:00+14:00", "must be a time of the years 2000 to 2999"),
        ("9999-12-31T23:59:59-12:00", "must be a time of the years 2000 to 2999"),
        ("[]", f"{TIME}, not a list"),
    ],
)
def test_what_is_no_deadline(tmp_path, written, fault):
    assert faults(spoiled(tmp_path, with_lines(f"deadline: {written}"))) == [f"lab.yaml:6: deadline: {fault}"]


def test_a_day_that_is_none(tmp_path):
    assert faults(spoiled(tmp_path, with_lines("deadline: 2026-11-31T00:00:00Z"))) == [
        "lab.yaml:6: 2026-11-31T00:00:00Z cannot be read"
    ]


def test_a_time_elsewhere_is_still_no_text(tmp_path):
    change = ("title: A sample", "title: 2026-11-20")
    assert faults(spoiled(tmp_path, change)) == [
        "lab.yaml:3: title: must be text or a number: put 2026-11-20 in quotes"
    ]


def test_all_faults_of_a_policy_at_once(tmp_path):
    lines = (
        "late:",
        "  lost: 110",
        "  of: all",
        "  per: week",
        "  grace_minutes: 15 min",
        "  cap: -1",
        "  cutoff_days: 7",
    )
    assert faults(spoiled(tmp_path, with_lines(*lines))) == [
        "lab.yaml:6: late: needs a deadline: deadline: 2026-11-20T23:59:00+01:00",
        "lab.yaml:7: late.lost: must be at most 100, not 110",
        'lab.yaml:8: late.of: must be "reached" or "possible", not "all"',
        'lab.yaml:9: late.per: must be "day" or "hour", not "week"',
        'lab.yaml:10: late.grace_minutes: must be a number, not "15 min": write 15',
        "lab.yaml:11: late.cap: must be at least 0, not -1",
        'lab.yaml:12: late.cutoff_days: is not known here (did you mean "cut_off_days"?)',
    ]


@pytest.mark.parametrize(
    ("late", "fault"),
    [
        ("{}", "late.lost: is missing"),
        ("10", "late: must be a map of keys and values, not 10"),
        (
            "{lost: 1, grace_minutes: 2000, cut_off_days: 1}",
            "late.grace_minutes: is longer than cut_off_days, after which nothing counts: 1",
        ),
        ("{lost: 1, cut_off_days: 1000000}", "late.cut_off_days: must be at most 3660, not 1000000"),
    ],
)
def test_a_policy_that_cannot_be(tmp_path, late, fault):
    assert faults(spoiled(tmp_path, with_lines(f"deadline: {DEADLINE}", f"late: {late}"))) == [
        f"lab.yaml:7: {fault}"
    ]


def test_editors_offer_both_keys():
    validator = Draft202012Validator(rubric_schema())
    for deadline, late, sound in (
        (f'"{DEADLINE}"', LATE, True),
        ("7", LATE, False),
        (f'"{DEADLINE}"', "late: 7", False),
    ):
        old, new = with_lines(f"deadline: {deadline}", late)
        assert validator.is_valid(yaml.safe_load(SOUND.replace(old, new))) is sound
    assert "percent" in rubric_schema()["$defs"]["Late"]["description"]
