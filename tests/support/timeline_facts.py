"""Package facts of a timeline: what a fixture does not say is filled in with what a sound package has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from grader.model.package import PackageFacts

_PACKAGE = {
    "name": "lab1",
    "path": ".",
    "manifest": None,
    "manifest_fault": None,
    "cmake": None,
    "files": (),
    "launch_files": (),
}
_FILE = {"size_bytes": 100, "sha256": "0" * 64, "executable": True, "mode_source": "disk"}
_FAULT = {"line": 1, "kind": "fault"}
_NODE = {
    "pkg": None,
    "type": None,
    "name": None,
    "ns": None,
    "output": None,
    "launch_prefix": None,
    "args": None,
    "remaps": (),
    "line": 1,
}

Facts = dict[str, Any]


def complete_facts(given: Mapping[str, Any]) -> PackageFacts:
    """Raises pydantic's ValidationError for what does not belong into the facts."""
    facts = {**_PACKAGE, **given}
    facts["manifest"] = _manifest(facts["manifest"], facts["name"])
    facts["manifest_fault"] = _fault(facts["manifest_fault"], "package.xml")
    facts["cmake"] = _cmake(facts["cmake"])
    facts["files"] = [_file(file) for file in facts["files"]]
    facts["launch_files"] = [_launch(file) for file in facts["launch_files"]]
    facts["also"] = [complete_facts(one) for one in facts.get("also", ())]
    return PackageFacts.model_validate(facts)


def _manifest(given: Facts | None, package: str) -> Facts | None:
    if given is None:
        return None
    sound: Facts = {
        "file": "package.xml",
        "format": 2,
        "name": package,
        "name_line": 3,
        "version": "0.0.0",
        "maintainers": ({"name": "A Student", "email": "student@example.org", "line": 6},),
        "licenses": ("TODO",),
        "dependencies": (["buildtool_depend", "catkin"],),
        "build_type": "catkin",
    }
    manifest = {**sound, **given}
    pairs = enumerate(manifest["dependencies"])
    manifest["dependencies"] = [_dependency(entry, 10 + number) for number, entry in pairs]
    return manifest


def _dependency(entry: Any, line: int) -> Any:
    return {"kind": entry[0], "name": entry[1], "line": line} if isinstance(entry, list) else entry


def _fault(given: Facts | None, file: str) -> Facts | None:
    return None if given is None else {"file": file, **_FAULT, **given}


def _cmake(given: Facts | None) -> Facts | None:
    if given is None:
        return None
    file = given.get("file", "CMakeLists.txt")
    calls = [_call(entry, file, 1 + number) for number, entry in enumerate(given.get("calls", ()))]
    return {
        "source": "trace",
        **given,
        "file": file,
        "calls": calls,
        "fault": _fault(given.get("fault"), file),
    }


def _call(entry: Any, file: str, line: int) -> Any:
    if isinstance(entry, list):
        return {"name": entry[0], "args": [str(word) for word in entry[1:]], "file": file, "line": line}
    return {"args": (), "file": file, "line": line, **entry}


def _file(given: Facts) -> Facts:
    file = {**_FILE, **given}
    if isinstance(file.get("shebang"), str):
        file["shebang"] = _shebang(file["shebang"], crlf=bool(file.get("crlf", False)))
    elif isinstance(file.get("shebang"), dict):
        file["shebang"] = {**_shebang(file["shebang"].get("text", ""), crlf=False), **file["shebang"]}
    interpreter = (file.get("shebang") or {}).get("interpreter", "")
    file.setdefault("python", str(given.get("path", "")).endswith(".py") or interpreter.startswith("python"))
    file["python_fault"] = _fault(file.get("python_fault"), str(given.get("path")))
    return file


def _shebang(line: str, *, crlf: bool) -> Facts:
    text = line.removeprefix("#!").strip()
    words = text.split()
    by_env = len(words) > 1 and words[0].endswith("/env")
    interpreter = (words[1] if by_env else words[0]) if words else ""
    return {"text": text, "interpreter": interpreter.rsplit("/", 1)[-1], "crlf": crlf, "found": True}


def _launch(given: Facts) -> Facts:
    launch = {"root": "launch", "includes": (), "nodes": (), **given}
    nodes = enumerate(launch["nodes"])
    launch["nodes"] = [{**_NODE, "line": 2 + number, **(node or {})} for number, node in nodes]
    launch["fault"] = _fault(launch.get("fault"), str(given.get("path")))
    return launch
