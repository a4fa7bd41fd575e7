"""What the page's script reads: JSON that stays inside its element, whatever the texts are."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from urllib.parse import quote

from markupsafe import Markup

from grader.model.batch import CriterionInfo
from grader.report.class_page.lines import CHARS, Line
from grader.untrusted_text import line

REPORT = "report.html"
COLUMNS = ("id", "name", "group", "link", "state", "points", "letters", "earned", "late", "decided", "time")


def page_data(
    lines: Iterable[Line],
    criteria: Iterable[CriterionInfo],
    diagnoses: Iterable[Sequence[int]],
    columns: Iterable[Sequence[int]],
) -> Markup:
    """`rows` (each as `COLUMNS` says), `criteria`, and by places in `rows` the members of diagnoses and heat map."""
    data = {
        "rows": [_row(one) for one in lines],
        "criteria": [[line(c.id, CHARS), line(c.title, CHARS), c.max_points] for c in criteria],
        "diagnoses": [list(members) for members in diagnoses],
        "heat": [list(column) for column in columns],
    }
    return in_script(json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")))


def in_script(text: str) -> Markup:
    """JSON as the content of a `<script>`: nothing in it ends the element or begins another one."""
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)  # noqa: S704 - what HTML looks for is written out


def link_to(one: Line) -> str:
    """The submission's report; empty where it has none."""
    return f"{quote(one.folder, safe='', errors='replace')}/{REPORT}" if one.folder else ""


def _row(one: Line) -> list[object]:
    link = link_to(one)
    usual = link == f"{one.id}/{REPORT}"
    return [
        one.id,
        one.name,
        one.group,
        1 if usual else link or 0,
        one.state,
        one.points,
        one.letters,
        one.earned or 0,
        round(one.late_s),
        [one.decided, one.look_again] if one.decided else 0,
        round(one.wall_s, 1),
    ]
