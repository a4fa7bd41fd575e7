"""The first line of a script as the kernel and `env` take it, and in plain words why they do not."""

from __future__ import annotations

import posixpath
import re
import shlex
import shutil
from collections.abc import Callable

from grader.model.package import Shebang
from grader.portable import system

SYSTEM_PATH = "/usr/local/bin:/usr/bin:/bin"
_LENGTH_LIMIT_BYTES = 255
_LOOKED_AT_BYTES = 1 << 14
_BOM = b"\xef\xbb\xbf"
_EVERYWHERE = frozenset({"awk", "bash", "dash", "env", "perl", "rbash", "sed", "sh"})
_ENV = frozenset({"/usr/bin/env", "/bin/env"})
_SPLIT_STRING = re.compile(r"^(-[iv0]*S|--split-string[= ])\s*")
_ADVICE = "write `#!/usr/bin/env python3`"
_NO_SHEBANG = re.compile(r"#\s*!?\s*(/usr)?/bin/|#\s+!|!\s*#|/usr/bin/env ")

# The arena provides these names wherever the system keeps its programs.
_PYTHONS = frozenset(
    {"python", "python3"}
    | {f"{place}/{name}" for place in SYSTEM_PATH.split(":") for name in ("python", "python3")},
)


def on_system(program: str) -> bool:
    """Whether a program, by absolute path or by name on the system's own PATH, is on this machine. Of a machine that is
    not Linux: whether it is among those that every Linux has."""
    if system():
        place, _, name = program.rpartition("/")
        return name in _EVERYWHERE and place in ("", "/bin", "/usr/bin")
    return shutil.which(program, path=SYSTEM_PATH) is not None


def read_shebang(
    data: bytes, interpreters: Callable[[str], bool] | None = None
) -> tuple[Shebang | None, str]:
    """The shebang of a file that begins with `data`, and why the system cannot use it ("" where it can).

    `interpreters` is asked for absolute paths and names behind `env`; `python` and `python3` are always
    there.
    """
    if not data.startswith(b"#!"):
        return None, _near(data)
    line = data[: data.find(b"\n")] if b"\n" in data else data
    crlf = line.endswith(b"\r")
    text = line[2 : _LENGTH_LIMIT_BYTES + 1].decode("utf-8", "replace").rstrip("\r").strip(" \t")
    interpreter, program, problem = resolve(text)
    found = not problem and (program in _PYTHONS or (interpreters or on_system)(program))
    if crlf:
        problem = (
            f"line 1 ends with Windows' CRLF, and there is no `{interpreter}\\r`: save with LF line endings"
        )
    elif not problem and not found:
        problem = f"there is no `{program}` on a ROS machine: {_ADVICE}"
    return Shebang(text=text, interpreter=interpreter, crlf=crlf, found=found), problem


def resolve(text: str) -> tuple[str, str, str]:
    """What `#!text` comes down to: the interpreter's name, the program to look for, and what is wrong."""
    if not text:
        return "", "", f"nothing follows `#!`: {_ADVICE}"
    program, *rest = text.split(None, 1)
    if not program.startswith("/"):
        return posixpath.basename(program), "", f"`{program}` is not an absolute path: {_ADVICE}"
    if program not in _ENV:
        return posixpath.basename(program), posixpath.normpath(program), ""
    return _behind_env(rest[0] if rest else "")


def _behind_env(argument: str) -> tuple[str, str, str]:
    """The kernel hands `env` all that follows as one argument; only `-S` takes it apart."""
    split = _SPLIT_STRING.match(argument)
    words = _words(argument[split.end() :]) if split else argument.split()
    while split and words and (words[0].startswith("-") or "=" in words[0]):
        words = words[1:]
    if not words:
        return "", "", f"`env` is given no program: {_ADVICE}"
    name = posixpath.basename(words[0])
    if not split and len(words) > 1:
        return name, "", f"`env` looks for one program called `{argument}`: keep only `{words[0]}`"
    return name, words[0], ""


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:
        return text.split()


def _near(data: bytes) -> str:
    """Why a file that does not begin with `#!` has no usable shebang."""
    lines = data[:_LOOKED_AT_BYTES].splitlines()[:50]
    first = lines[0][:_LENGTH_LIMIT_BYTES].decode("utf-8", "replace").strip() if lines else ""
    later = next((n for n, line in enumerate(lines, 1) if line.strip().startswith(b"#!")), None)
    if not data.strip():
        return "the file is empty"
    if data.startswith(_BOM + b"#!"):
        return "an invisible byte order mark (BOM) stands before `#!`: save as UTF-8 without BOM"
    if later == 1:
        return "a space stands before `#!`: it must be the very first thing in the file"
    if _NO_SHEBANG.match(first):
        return f"line 1 is `{first[:60]}`, which is no shebang: {_ADVICE}"
    if later is None:
        return f"there is no `#!` line at the top: {_ADVICE}"
    before = f"line 1 is `{first[:40]}`" if first else "line 1 is blank"
    return f"{before} and `#!` comes in line {later}: it must be line 1"


def is_near_python(data: bytes) -> bool:
    """Whether a file begins with a shebang of Python, usable or spoilt by a BOM, a blank or a blank line."""
    return re.match(rb"(\xef\xbb\xbf)?\s*#\s*![^\n]*\bpython", data[:512]) is not None
