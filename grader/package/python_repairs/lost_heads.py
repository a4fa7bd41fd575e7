"""First lines of functions, methods and classes that a script has lost: what they were, by what uses them.

It runs in a child process as `examine.py` does, on text that need not parse: the standard library only.
"""

from __future__ import annotations

import ast
import builtins
import re
import textwrap

from grader.wording import is_one_edit

METHOD = re.compile(r"\s*def\s+\w+\s*\(\s*self\b")
DEFINED = re.compile(r"\b(?:def|class)\s+(\w+)")
ALL_NAMES = re.compile(r"\bimport\s*\*")
"""What a script has from elsewhere by `from … import *` is not known."""
OF_LISTS = frozenset(dir(list) + dir(dict) + dir(str))
DOCSTRING = re.compile(r"\s*(\"{3}[^\"]*\"{3}|'{3}[^']*'{3})\n")


def lost_head(text: str, body: str) -> str:
    """Return the first line of the one function that the file names as a callback, or calls, and does not have, or of
    the one class; "" where there is not just one. `body` are the lines that belong below it."""
    code = re.sub(r"#[^\n]*", "", text)
    if ALL_NAMES.search(code):
        return ""
    named = dict.fromkeys(re.findall(r"\b(?:Subscriber|Service|Timer)\s*\(.*,\s*(\w+)\s*[,)]", code), "msg")
    named |= dict.fromkeys(re.findall(r"^\s*(\w+)\(\)\s*$", code, re.MULTILINE), "")
    of_class = METHOD.match(DOCSTRING.sub("", body, count=1).lstrip("\n"))
    if of_class:
        named = dict.fromkeys(re.findall(r"(?<![\w.])(?<!raise )([A-Z]\w*)\(", code), "")
    lost = [name for name in named if name not in _given(code) | set(DEFINED.findall(text))]
    if len(lost) != 1 or lost[0] in dir(builtins):
        return ""
    if of_class:
        return f"class {lost[0]}:"
    value = re.search(r"\b(\w+)\.data\b", body) if named[lost[0]] else None
    return f"def {lost[0]}({value[1] if value else named[lost[0]]}):"


def lost_method(text: str, above: str, body: str, *, at_first: bool = False) -> str:
    """Return the first line of the one method that the script calls, or names as a callback, and that the class does
    not have; "" where there is none. `above` is the text down to the body, which may be that of `__init__` where it
    comes first in the class (`at_first`)."""
    code = re.sub(r"#[^\n]*", "", text)
    top = next((one for one in reversed(above.split("\n")) if one[:1].strip(" \t#")), "")
    owner = re.match(r"class\s+(\w+)\s*(?:\(\s*(?:object)?\s*\))?\s*:", top)
    if owner is None:
        return ""
    objects = "|".join(["self", *re.findall(rf"^\s*(\w+)\s*=\s*{owner[1]}\(", code, re.MULTILINE)])
    used = [one for one in re.findall(rf"(?<![\w.])(?:{objects})\.(\w+)\(", code) if one not in OF_LISTS]
    used += re.findall(r"\b(?:Subscriber|Service|Timer)\s*\(.*,\s*(?:\w+\s*=\s*)?self\.(\w+)\s*[,)]", code)
    has = {
        *re.findall(r"\bdef\s+(\w+)", text),
        *re.findall(r"\bself\.(\w+)(?=\s*(?:[,:].{0,200})?=(?!=))", code),
    }
    lost = [name for name in dict.fromkeys(used) if name not in has]
    if at_first and not lost and "__init__" not in has and re.search(r"\bself\b", body):
        lost = ["__init__"]
    taken = _unknown(code, body)
    if len(lost) != 1 or taken is None or any(is_one_edit(lost[0], name) for name in has):
        return ""
    called = re.search(rf"\bself\.{lost[0]}\s*[,)]", code)
    taken = taken or [
        "event" if called and "Timer" in code[: called.end()].split("\n")[-1] else "msg"
    ] * bool(called)
    return f"def {lost[0]}({', '.join(['self', *taken])}):"


def _given(code: str) -> set[str]:
    """Return the names that a script imports, defines, or gives a value."""
    imported = re.findall(r"^\s*(?:from\s.*)?import\s+(.*)", code, re.MULTILINE)
    return {
        *re.findall(r"\w+", " ".join(imported)),
        *DEFINED.findall(code),
        *re.findall(r"^\s*(\w+)\s*=", code, re.MULTILINE),
    }


def _unknown(code: str, body: str) -> list[str] | None:
    """Return the names that the body reads, and that nothing gives a value: its parameters. None if it does not
    parse."""
    try:
        nodes = [n for n in ast.walk(ast.parse(textwrap.dedent(body))) if isinstance(n, ast.Name)]
    except (SyntaxError, ValueError):
        return None
    given = {n.id for n in nodes if not isinstance(n.ctx, ast.Load)} | set(dir(builtins)) | {"self"}
    outer = _given("\n".join(line for line in code.split("\n") if not line.startswith((" ", "\t"))))
    nodes.sort(key=lambda n: (n.lineno, n.col_offset))
    return list(dict.fromkeys(n.id for n in nodes if n.id not in given | outer))
