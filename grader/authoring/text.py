"""A proposed rubric as YAML, laid out as people write it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import yaml

from grader.untrusted_text import line, uncommanded, visible

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
    """The rubric's file."""
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
