"""Times and days as people and programs write them; what could be read in two ways is not read."""

from __future__ import annotations

import re
from datetime import datetime, timedelta, timezone

EXTENSION_DAYS_MAX = 3660.0
EXAMPLE = "2026-11-20 23:59"
_TIME = re.compile(
    r"(?P<year>\d{4})[-/](?P<month>\d{1,2})[-/](?P<day>\d{1,2})"
    r"(?:(?:T|\s+)(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,](?P<part>\d{1,12}))?)?"
    r"\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?)?",
    re.IGNORECASE | re.ASCII,
)
_DAY_AND_MONTH = re.compile(r"\d{1,2}([/.-])\d{1,2}\1\d{2,4}\b.*", re.ASCII | re.DOTALL)
_DAYS = re.compile(r"\+?\d{1,5}([.,]\d{1,6})?", re.ASCII)


def parse_time(text: str) -> datetime | None:
    """An ISO 8601 time, also with blanks and slashes; without a zone, of this machine's. None for what is none."""
    found = _TIME.fullmatch(text.strip())
    if found is None:
        return None
    numbers = {name: int(found[name] or 0) for name in ("year", "month", "day", "hour", "minute", "second")}
    part = int((found["part"] or "0")[:6].ljust(6, "0"))
    try:
        time = datetime(**numbers, microsecond=part, tzinfo=_zone(found["zone"]))
        return time.astimezone() if time.tzinfo is None else time.astimezone(timezone.utc)
    except (ValueError, OverflowError, OSError):
        return None


def time_fault(text: str) -> str:
    """Why `text` is no time; empty where it is one."""
    if parse_time(text) is not None:
        return ""
    if _DAY_AND_MONTH.fullmatch(text.strip()):
        return f"can be read with the day or the month first: write it as {EXAMPLE}"
    return f"is no time such as {EXAMPLE} or 2026-11-20T23:59:00+01:00"


def parse_days(text: str) -> float | None:
    """A number of days from 0 to ten years, with a point or a comma. None for what is none."""
    days = float(text.replace(",", ".")) if _DAYS.fullmatch(text) else None
    return days if days is not None and days <= EXTENSION_DAYS_MAX else None


def _zone(text: str | None) -> timezone | None:
    if text is None:
        return None
    if text[0] not in "+-":
        return timezone.utc
    digits = text[1:].replace(":", "").ljust(4, "0")
    offset = timedelta(hours=int(digits[:2]), minutes=int(digits[2:]))
    return timezone(-offset if text[0] == "-" else offset)
