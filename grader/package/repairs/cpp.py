"""What a C++ node lacks to stay alive and to hear, where a line or a few words are missing."""

from __future__ import annotations

import re

from grader.package.repairs.editing import Files

SPIN = "ros::spin();"
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_WAITS = re.compile(r"\b(?:subscribe|advertiseService|createTimer)\s*(?:<[^;()]*>)?\s*\(")
_STAYS = re.compile(r"\b(?:spin|spinOnce|waitForShutdown|ok|while)\b|\bfor\s*\(\s*;\s*;")
_END = re.compile(r"(?P<indent>[ \t]*)(?:return\b[^;\n]*;|(?P<brace>\}))")


_DROPPED = re.compile(r"(?P<indent>\s*)(?P<call>\w+\.(?P<name>subscribe|advertiseService)\b.*)")
KEPT = {"subscribe": ("ros::Subscriber", "sub"), "advertiseService": ("ros::ServiceServer", "server")}
"""What a call returns, and a name for it: without one it is gone at once."""


def repair_cpp(files: Files, path: str) -> None:
    """Find both in a source."""
    _keep_subscribers(files, path)
    _repair_spin(files, path)


def _keep_subscribers(files: Files, path: str) -> None:
    """Give a name to what `nh.subscribe(…);` returns."""
    text = files.text(path) or ""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        found = _DROPPED.fullmatch(line)
        before = _COMMENT.sub("", lines[number - 1]).rstrip() if number else ""
        if found is None or (before and not before.endswith((";", "{", "}"))):
            continue
        kind, name = KEPT[found["name"]]
        name = name if not re.search(rf"\b{name}\b", text) else f"{name}_{number + 1}"
        lines[number] = f"{found['indent']}{kind} {name} = {found['call']}"
        call = f"{found['name']}(…)"
        message = f"line {number + 1} of {path}: what {call} returns is dropped, and with it the "
        message += "subscription" if found["name"] == "subscribe" else "service"
        files.change("missing-call", path, "\n".join(lines), message)


def _repair_spin(files: Files, path: str) -> None:
    """Call `ros::spin()` at the end of a program that makes its node, waits for callbacks, and ends at once."""
    text = files.text(path) or ""
    code = _COMMENT.sub("", text)
    if "ros::init" not in code or not _WAITS.search(code) or _STAYS.search(code):
        return
    lines = text.split("\n")
    at, end = next(
        ((n, end) for n, line in reversed([*enumerate(lines)]) if (end := _END.fullmatch(line))), (0, None)
    )
    above = _END.fullmatch(lines[at - 1]) if end is not None and end["brace"] else None
    if above is not None and not above["brace"]:
        at, end = at - 1, above
    if end is None or "main" not in code:
        return
    indent = "  " if end["brace"] else end["indent"]
    message = f"{path} ends as soon as it has subscribed, because nothing keeps it running"
    files.change("missing-call", path, "\n".join([*lines[:at], f"{indent}{SPIN}", *lines[at:]]), message)
