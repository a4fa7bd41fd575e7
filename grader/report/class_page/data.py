"""What the page's script reads: JSON that stays inside its element, whatever the texts are."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from urllib.parse import quote

from markupsafe import Markup

from grader.model.batch import CriterionInfo
from grader.report.class_page.lines import Line

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
        "rows": [_row(line) for line in lines],
        "criteria": [[criterion.id, criterion.title, criterion.max_points] for criterion in criteria],
        "diagnoses": [list(members) for members in diagnoses],
        "heat": [list(column) for column in columns],
    }
    return in_script(json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")))


def in_script(text: str) -> Markup:
    """JSON as the content of a `<script>`: nothing in it ends the element or begins another one."""
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)  # noqa: S704 - what HTML looks for is written out


def link_to(line: Line) -> str:
    """The submission's report; empty where it has none."""
    return f"{quote(line.folder, safe='')}/{REPORT}" if line.folder else ""


def _row(line: Line) -> list[object]:
    link = link_to(line)
    usual = link == f"{line.id}/{REPORT}"
    return [
        line.id,
        line.name,
        line.group,
        1 if usual else link or 0,
        line.state,
        line.points,
        line.letters,
        line.earned or 0,
        round(line.late_s),
        [line.decided, line.look_again] if line.decided else 0,
        round(line.wall_s, 1),
    ]
