"""`requests.csv`: what students ask about a criterion, as a form's export or a person writes it down."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from grader.classes.overrides import folder_key
from grader.files import read_untrusted
from grader.untrusted_text import line
from grader.wording import did_you_mean

FILE = "requests.csv"
COLUMNS = ("student", "criterion", "text", "when")
TEXT_CHARS, WHEN_CHARS = 2000, 40


@dataclass(frozen=True, kw_only=True)
class Request:
    """What one student asks, and `when`, in the student's or the form's own words."""

    text: str
    when: str


@dataclass(frozen=True, kw_only=True)
class Requests:
    """By submission, then by criterion; each fault says which row is left out, and why."""

    found: Mapping[str, Mapping[str, tuple[Request, ...]]]
    faults: tuple[str, ...] = ()


def read_requests(path: Path, ids: Collection[str], criteria: Collection[str]) -> Requests:
    """Return what is asked about these submissions and criteria; nothing where there is no such file."""
    raw = read_untrusted(path)
    if raw is None:
        return Requests(found={})
    rows = csv.DictReader(io.StringIO(raw.decode("utf-8-sig", "replace"), newline=""))
    names = {(name or "").strip().casefold(): name for name in rows.fieldnames or ()}
    missing = [name for name in COLUMNS[:3] if name not in names]
    if missing:
        return Requests(found={}, faults=(f"{FILE}:1: there is no column {missing[0]}",))
    known = {folder_key(name): name for name in ids}
    found: dict[str, dict[str, tuple[Request, ...]]] = {}
    faults = []
    for row in rows:
        student, criterion, text, when = (str(row.get(names.get(name)) or "").strip() for name in COLUMNS)
        submission = known.get(folder_key(student))
        if submission is None or criterion not in criteria:
            what = "submission" if submission is None else "criterion"
            near = did_you_mean(student, ids) if submission is None else did_you_mean(criterion, criteria)
            said = line(student if submission is None else criterion, 80)
            faults.append(f'{FILE}:{rows.line_num}: there is no {what} "{said}"{near}')
            continue
        of = found.setdefault(submission, {})
        asked = Request(text=text[:TEXT_CHARS], when=when[:WHEN_CHARS])
        of[criterion] = (*of.get(criterion, ()), asked)
    return Requests(found=found, faults=tuple(faults))
