"""Slips of a script that another file of the package makes none: what it imports, or what imports it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath

from grader.model.python_slip import PythonSlip

_IMPORT = re.compile(r"^[ \t]*(?:from|import)[ \t]([^#\n]{1,200})", re.MULTILINE)
_OWNER = re.compile(r"(\w+)\.publish\(")


def drop_slips_of_modules(slips: Iterable[PythonSlip], texts: Mapping[str, str]) -> tuple[PythonSlip, ...]:
    """Return the slips without those of a file alone, such as a function that nothing in it calls, where another one of
    the `texts` does it."""
    named, given = _words_of_imports(texts), tuple(slips)
    # of a script and its module, the script is told that it is no node
    without_init = {one.file for one in given if one.kind == "no-init"}
    kept = (one for one in given if not _is_done_elsewhere(one, texts, named, without_init))
    return tuple(filter(None, (_with_attributes(one, texts, named) for one in kept)))


def imported_files(texts: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the package's own files that each of the `texts` names in its imports, by path."""
    by_name: dict[str, list[str]] = {}
    for path in texts:
        by_name.setdefault(PurePosixPath(path).stem, []).append(path)
    named = _words_of_imports(texts)
    found = {
        path: sorted(one for word in words for one in by_name.get(word, ())) for path, words in named.items()
    }
    return {path: tuple(one for one in others if one != path) for path, others in found.items()}


def _words_of_imports(texts: Mapping[str, str]) -> dict[str, set[str]]:
    return {path: {*re.findall(r"\w+", " ".join(_IMPORT.findall(text)))} for path, text in texts.items()}


_CLASS = r"^class {}\b(?:(?!^\S).)*?^[ \t]+def __init__\(self(.*?)\)[^\n]*:(.*?)(?=^[ \t]+(?:def|@)|^\S|\Z)"
_GIVEN = re.compile(r"\bself\.(\w+)(?:[ \t]*:[^=\n]+)?[ \t]*=(?!=)")


def _with_attributes(
    slip: PythonSlip, texts: Mapping[str, str], named: Mapping[str, set[str]]
) -> PythonSlip | None:
    """Return a slip of a base class in another file with the attributes that the `__init__` of that one gives a value;
    None where it gives none."""
    if slip.kind != "base-unmade" or " " in slip.name:
        return slip
    pattern = re.compile(_CLASS.format(re.escape(slip.message.rpartition(" ")[2])), re.MULTILINE | re.DOTALL)
    for text in _imported(slip.file, texts, named):
        if base := pattern.search(text):
            fix = slip.fix.replace("(…)", "(…)" if base[1].strip() else "()")
            own = {*_GIVEN.findall(base[2])} - {*_GIVEN.findall(texts[slip.file])}
            return (
                slip.model_copy(update={"name": " ".join([slip.name, *sorted(own)]), "fix": fix})
                if own
                else None
            )
    return None


def _is_done_elsewhere(
    slip: PythonSlip, texts: Mapping[str, str], named: Mapping[str, set[str]], without_init: set[str]
) -> bool:
    name = PurePosixPath(slip.file).stem
    paths = [path for path, words in named.items() if name in words and path != slip.file]
    importing = [texts[path] for path in paths]
    if slip.kind == "no-init":
        others = (*importing, *_imported(slip.file, texts, named))
        return not without_init.isdisjoint(paths) or any("init_node" in one for one in others)
    if slip.kind == "never-called":
        word = rf"\b{re.escape(slip.name.rpartition('.')[2])}\b"
    elif slip.kind == "never-published":
        owner = _OWNER.search(slip.message.replace("(…)", "("))
        word = rf"\b{re.escape(owner[1])}\b" if owner else "(?!)"
    elif slip.kind == "object":
        word = rf"\bdef {re.escape(slip.name)}\b"
    else:
        return False
    return any(re.search(word, text) for text in importing)


def _imported(file: str, texts: Mapping[str, str], named: Mapping[str, set[str]]) -> Iterator[str]:
    """Yield the texts of the files that a file imports, and that these import."""
    left, seen = [file], {file}
    while left:
        words = named.get(left.pop(), set())
        for path in (one for one in texts if PurePosixPath(one).stem in words and one not in seen):
            seen.add(path)
            left.append(path)
            yield texts[path]
