"""Times as people, programs and spreadsheets write them."""

from __future__ import annotations

import time
from datetime import datetime, timedelta, timezone

import pytest

from grader.classes.roster.entries import parse_days, parse_time, time_fault

UTC = timezone.utc


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2026-11-20T23:59:00+01:00", datetime(2026, 11, 20, 22, 59, tzinfo=UTC)),
        ("2026-11-20T23:59:00Z", datetime(2026, 11, 20, 23, 59, tzinfo=UTC)),
        ("2026-11-20T23:59:00.123Z", datetime(2026, 11, 20, 23, 59, 0, 123000, tzinfo=UTC)),
        ("2026-11-20T23:59:00.123456789z", datetime(2026, 11, 20, 23, 59, 0, 123456, tzinfo=UTC)),
        ("2026-11-20 23:59:07,5 -0330", datetime(2026, 11, 21, 3, 29, 7, 500000, tzinfo=UTC)),
        ("2026-11-20 23:59 +01", datetime(2026, 11, 20, 22, 59, tzinfo=UTC)),
        (" 2026/11/20  9:05 UTC", datetime(2026, 11, 20, 9, 5, tzinfo=UTC)),
    ],
)
def test_times_with_a_zone(text: str, expected: datetime) -> None:
    assert parse_time(text) == expected
    assert time_fault(text) == ""


@pytest.fixture
def in_tokyo(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    "text", ["2026-11-20 23:59", "2026-11-20T23:59", "2026-11-20 23:59:00", "2026/11/20 23:59"]
)
def test_times_without_a_zone_are_of_this_machine(text: str, in_tokyo) -> None:
    assert parse_time(text) == datetime(2026, 11, 20, 14, 59, tzinfo=UTC)
    assert parse_time(text).utcoffset() == timedelta(hours=9)


def test_a_day_begins_at_midnight(in_tokyo) -> None:
    assert parse_time("2026-11-20") == datetime(2026, 11, 19, 15, tzinfo=UTC)


@pytest.mark.parametrize(
    "text", ["20/11/2026 23:59", "11/20/2026", "20.11.2026 23:59", "5-6-26", "1/2/2026 3:04 PM"]
)
def test_what_could_be_two_days(text: str) -> None:
    assert parse_time(text) is None
    assert "the day or the month first: write it as 2026-11-20 23:59" in time_fault(text)


@pytest.mark.parametrize(
    "text",
    [
        "yesterday",
        "2026-11-20 24:00",
        "2026-13-01",
        "2026-11-20T23:59+25:00",
        "46346.99",
        "2026-11-20 11:59 PM",
        "2026-11-20 23:59 CET",
        "2026-11-20T",
        "0001-01-01 00:00 +14:00",
        "0000-01-01",
        "\uff12026-11-20",
    ],
)
def test_what_is_no_time(text: str) -> None:
    assert parse_time(text) is None
    assert "is not a time such as" in time_fault(text)


@pytest.mark.parametrize(
    ("text", "days"), [("2", 2), ("1.5", 1.5), ("1,5", 1.5), ("0", 0), ("+3", 3), ("3660", 3660)]
)
def test_days(text: str, days: float) -> None:
    assert parse_days(text) == days


@pytest.mark.parametrize("text", ["", "-1", "nan", "inf", "1e3", "1_0", "3661", "2 days", "\u0663", "0x1"])
def test_no_days(text: str) -> None:
    assert parse_days(text) is None
