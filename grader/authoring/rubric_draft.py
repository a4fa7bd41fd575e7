"""A rubric in the making: scenarios, criteria and points that add up, and its text as YAML that people can edit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

import yaml

from grader.rubric.consistency import TOTAL_POINTS
from grader.untrusted_text import line, uncommanded, visible

WEIGHTS = {
    "manifest": 1, "cmake": 1, "build": 1, "executable": 1, "node-lives": 1, "node-name": 1, "topic-type": 2, "rate": 3,
    "counter-start": 1, "counter-step": 1, "counter-wrap": 3, "message": 1, "hears": 2, "service": 2, "latched": 1,
    "cmake-install": 2, "launch-xml": 2, "launch-runs": 2,
}  # fmt: skip

Entry = dict[str, Any]


class Sheet:
    """Collects the parts of a rubric. `notes` are for the author: what was seen and is not covered."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.scenarios: dict[str, Entry] = {}
        self.criteria: list[Entry] = []

    def add(self, id_: str, title: str, check: str, parameters: Entry, **more: object) -> str:
        """Add a criterion without points and return its id, numbered where it is taken."""
        taken = {c["id"] for c in self.criteria}
        name = next(n for n in (id_, *(f"{id_}-{i}" for i in range(2, 100))) if n not in taken)
        entry = {"id": name, "title": title, "points": 0, "check": check}
        self.criteria.append(
            entry | ({"with": parameters} if parameters else {}) | {k: v for k, v in more.items() if v}
        )
        return name


def drop_empty(**lists: list[str]) -> Entry:
    """Return the lists that are not empty."""
    return {name: items for name, items in lists.items() if items}


def assign_points(criteria: list[Entry]) -> None:
    """Set each criterion's points by its check's weight: whole numbers, together 100."""
    weights = [WEIGHTS.get(c["check"], 1) for c in criteria]
    exact = [TOTAL_POINTS * w / sum(weights) for w in weights]
    for criterion, points in zip(criteria, exact, strict=True):
        criterion["points"] = int(points)
    order = sorted(range(len(exact)), key=lambda i: (int(exact[i]) - exact[i], i))
    for index in order[: TOTAL_POINTS - sum(c["points"] for c in criteria)]:
        criteria[index]["points"] += 1


def format_number(number: float) -> float | int:
    return int(number) if number == int(number) else number


def label_of(name: str) -> str:
    """Return a topic's or service's name as part of a criterion's id: letters, digits and hyphens."""
    letters: Iterator[str] = (c if c.isalnum() and c.isascii() else "-" for c in name.lower())
    label = "-".join(part for part in "".join(letters).split("-") if part)
    return label if label[:1].isalpha() else f"t-{label}"


# ---- as YAML

NOTE_CHARS = 300
HEAD = """\
# Proposed by `grader rubric new` from a run of a correct package. Look through it: it asks for what this package does,
# and only you know what the handout asks for. `grader explain CHECK` tells more about each check, and
# `grader rubric test` whether the rubric notices what students do wrong.
"""


class _Dumper(yaml.SafeDumper):
    """Short lists and maps on one line, long ones not."""

    def ignore_aliases(self, _data: object) -> bool:
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: ARG002 - PyYAML's own
        """Indent the entries of lists."""
        super().increase_indent(flow, False)


def _quoted(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    """What a CI's log could take for a command stands in double quotes, where `uncommanded` writes escapes."""
    style = '"' if "##" in text or "::" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _quoted)


def rubric_text(
    package: str,
    rubric_id: str,
    scenarios: dict[str, Any],
    criteria: list[dict[str, Any]],
    notes: Iterable[str],
) -> str:
    """Return the text of the rubric's file."""
    about = {
        "schema": "grader.rubric/1",
        "id": rubric_id,
        "title": f"The lab {rubric_id}",
        "version": "1",
        "package": package,
    }
    parts = [HEAD + "".join(f"# NOTE: {_one_line(note)}\n" for note in notes), _block(about)]
    runs = [_indented({name: scenario}) for name, scenario in scenarios.items()]
    parts.append("scenarios:\n" + "\n".join(runs) if runs else "scenarios: {}\n")
    parts.append("criteria:\n" + "\n".join(_indented([criterion]) for criterion in criteria))
    return "\n".join(parts)


def _block(data: object) -> str:
    return _dumped(data, flow=False)


def _indented(data: object) -> str:
    """Innermost lists and maps in flow style: `[rospy, std_msgs]`."""
    rows = _dumped(data, flow=None).removesuffix("\n").split("\n")
    return "".join(f"  {row}\n" if row else "\n" for row in rows)


def _dumped(data: object, *, flow: bool | None) -> str:
    """Names of topics and texts come from a program: where one holds what cannot be seen, letters are escaped."""

    def dump(*, letters: bool) -> str:
        return yaml.dump(
            data, Dumper=_Dumper, sort_keys=False, allow_unicode=letters, width=110, default_flow_style=flow
        )

    text = uncommanded(dump(letters=True))
    return text if visible(text, lines=True) == text else uncommanded(dump(letters=False))


def _one_line(text: str) -> str:
    return line(re.sub(r"\s+", " ", text), NOTE_CHARS)
