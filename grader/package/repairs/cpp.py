"""What a C++ node lacks to stay alive and to hear, where a line or a few words are missing."""

from __future__ import annotations

import re

from grader.package.cpp import end_of_block
from grader.package.repairs.editing import Files

SPIN = "ros::spin();"
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_WAITS = re.compile(r"\b(?:subscribe|advertiseService|createTimer)\s*(?:<[^;()]*>)?\s*\(")
_STAYS = re.compile(r"\b(?:spin|spinOnce|waitForShutdown|ok|while|RUN_ALL_TESTS)\b|\bfor\s*\(\s*;\s*;")
_LASTS = re.compile(r"\b(?:spin|ok|while|for|do|sleep|wait)[A-Z]?\w*\b")
"""A function that waits itself keeps its variables for as long."""
_END = re.compile(r"(?P<indent>[ \t]*)(?:return\b[^;\n]*;|(?P<brace>\}))")


_DROPPED = re.compile(
    r"(?P<indent>\s*)(?P<call>(?P<of>\w+)\.(?P<name>subscribe|advertiseService)\b[^(]*\(?\s*(?P<text>\")?.*)"
)
KEPT = {"subscribe": ("ros::Subscriber", "sub"), "advertiseService": ("ros::ServiceServer", "server")}
"""What a call returns, and a name for it: without one it is gone at once."""


_LOCAL = re.compile(
    r"^(?P<indent>[ \t]*)(?:const\s+)?(?:ros::(?:Subscriber|ServiceServer)|auto)\s+(?P<name>\w+)\s*=\s*"
    r"[\w.>-]+(?:\.|->)(?P<call>subscribe|advertiseService)\b",
    re.MULTILINE,
)
_FUNCTION = re.compile(r"\b(?P<name>~?\w+)\s*\([^;{}]*\)\s*(?:const\s*)?(?::[^;{}]*)?$")
_BLOCK = frozenset({"if", "while", "for", "switch", "catch"})
HEAD_CHARS_MAX = 500


def repair_cpp(files: Files, path: str) -> None:
    """Find all of it in a source."""
    _keep_subscribers(files, path)
    _keep_locals(files, path)
    _repair_spin(files, path)


def _keep_locals(files: Files, path: str) -> None:
    """Keep a subscriber that is a variable of a constructor, or of another function that ends before the node does."""
    text = files.text(path) or ""
    code = _COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    lines = text.split("\n")
    for found in _LOCAL.finditer(code):
        function = _function_around(code, found.start())
        body = code[found.end() : end_of_block(code, found.end())]
        used = re.search(rf"\b{found['name']}\b", body) or _LASTS.search(body)
        if function in ("", "main") or function.startswith("TEST") or used:
            continue
        number = code.count("\n", 0, found.start()) + 1
        line = lines[number - 1]
        lines[number - 1] = f"{found['indent']}static {line.lstrip()}"
        what = "subscription" if found["call"] == "subscribe" else "service"
        where = f"line {number} of {path}"
        message = (
            f"{where}: {found['name']} is a variable of the function {function}, and the {what} ends with it"
        )
        fix = f"make {found['name']} a member of the class, or write `static` before it"
        files.change("missing-call", path, "\n".join(lines), message, fix)


def _function_around(code: str, at: int) -> str:
    """Return the name of the function in whose body a place is, not in a loop or an `if` of it; "" for none."""
    depth = 0
    for brace in reversed([*re.finditer(r"[{}]", code[:at])]):
        depth += 1 if brace[0] == "}" else -1
        if depth < 0:
            head = _FUNCTION.search(code, max(0, brace.start() - HEAD_CHARS_MAX), brace.start())
            return head["name"] if head and head["name"] not in _BLOCK else ""
    return ""


def _keep_subscribers(files: Files, path: str) -> None:
    """Give a name to what `nh.subscribe(…);` returns."""
    text = files.text(path) or ""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        found = _DROPPED.fullmatch(line)
        # What the line above begins may keep it: `sub =`, or another call's brackets.
        before = _COMMENT.sub("", lines[number - 1]).rstrip() if number else ""
        if found is None or (before and not before.endswith((";", "{", "}"))) or not _is_of_node(found, text):
            continue
        kind, name = KEPT[found["name"]]
        name = name if not re.search(rf"\b{name}\b", text) else f"{name}_{number + 1}"
        lines[number] = f"{found['indent']}{kind} {name} = {found['call']}"
        what = "subscription" if found["name"] == "subscribe" else "service"
        message = (
            f"line {number + 1} of {path}: what {found['name']}(…) returns is dropped, and with it the {what}"
        )
        files.change("missing-call", path, "\n".join(lines), message)


def _is_of_node(call: re.Match[str], text: str) -> bool:
    """Return whether it is the call of a NodeHandle, which begins with a topic's name. The subscribers of
    message_filters and image_transport keep what they are given, and begin with a handle."""
    of = re.escape(call["of"])
    if call["text"]:
        return re.search(rf"\bImageTransport\s*[&*]?\s*{of}\b", text) is None
    return re.search(rf"\bNodeHandle\s*[&*]?\s*{of}\b", text) is not None


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
    # Below `return 0;` nothing is reached.
    above = _END.fullmatch(lines[at - 1]) if end is not None and end["brace"] else None
    if above is not None and not above["brace"]:
        at, end = at - 1, above
    if end is None or "main" not in code:
        return
    indent = "  " if end["brace"] else end["indent"]
    message = f"{path} ends as soon as it is set up, because nothing keeps it running"
    files.change("missing-call", path, "\n".join([*lines[:at], f"{indent}{SPIN}", *lines[at:]]), message)
