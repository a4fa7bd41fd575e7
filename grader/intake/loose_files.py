"""The lab's files where they lie in no package: where, and what keeps them from being run there."""

from __future__ import annotations

import re
import stat
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path, PurePosixPath

from grader.files import read_untrusted
from grader.intake.names import listing, printable
from grader.intake.tree import walk

FOLDERS_LOOKED_AT = 300
BYTES_READ = 64_000
SCRIPTS = (".py", ".sh")
PRINTS = re.compile(rb"""[ \t]*print[ \t]+(?:["']|[A-Za-z_][\w.]*[ \t]*(?:[,%]|$))""")
"""A line that begins with the `print` of Python 2."""


def loose_files(root: Path, paths: frozenset[str], *, modes_known: bool) -> str:
    """Return where most of the lab's files lie, with the folders of `paths` that they belong in, and what to do with
    them before they can be run: `publisher.py in week1/`; "" for nowhere. `modes_known`: the disk tells which of them
    are executable."""
    wanted = {
        PurePosixPath(path).name: str(PurePosixPath(path).parent) for path in sorted(paths, reverse=True)
    }
    wanted |= {name: "launch" for name, into in wanted.items() if name.endswith(".launch") and into == "."}
    names = wanted.keys()
    found = {
        folder.path: sorted(names & {entry.name for entry in folder.others})
        for folder in islice(walk(root, tolerant=True), FOLDERS_LOOKED_AT)
    }
    path = max(found, key=lambda path: len(found[path]), default="")
    if not path or not found[path]:
        return ""
    folder = root if path == "." else root / path
    where = "" if path == "." else f" in {printable(path)}/"
    belong = [_belong(found[path], wanted, into) for into in sorted({wanted[n] for n in found[path]} - {"."})]
    return "; ".join(
        [listing(found[path]) + where, *belong, *_repairs(folder, found[path], modes_known=modes_known)]
    )


def _belong(names: list[str], wanted: Mapping[str, str], folder: str) -> str:
    inside = [name for name in names if wanted[name] == folder]
    return f"{listing(inside)} {'belongs' if len(inside) == 1 else 'belong'} in the package's {printable(folder)}/"


def _repairs(folder: Path, names: list[str], *, modes_known: bool) -> Iterator[str]:
    texts = {name: read_untrusted(folder / name, BYTES_READ) or b"" for name in names}
    crlf = [name for name, text in texts.items() if re.match(rb"#![^\n]*\r\n", text)]
    if crlf:
        why = "cannot be started, because of Windows' line ends (CRLF)"
        yield f"{listing(crlf)} {why}: dos2unix {_them(crlf)} first"
    plain = [name for name in names if name.endswith(SCRIPTS) and _is_plain(folder / name)]
    if modes_known and plain:
        verb = "is" if len(plain) == 1 else "are"
        yield f"{listing(plain)} {verb} not executable: chmod +x {_them(plain)}"
    for name, line in ((name, _old_print(text)) for name, text in texts.items() if name.endswith(".py")):
        if line:
            yield f"line {line} of {printable(name)} prints as in Python 2: write print(…), with brackets"


def _them(names: list[str]) -> str:
    return "it" if len(names) == 1 else "them"


def _is_plain(path: Path) -> bool:
    """Return whether it is a file that may not be executed."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return False
    return stat.S_ISREG(mode) and not mode & stat.S_IXUSR


def _old_print(text: bytes) -> int:
    """Return the first line that prints as in Python 2, outside of texts between three quotes; 0 for none."""
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        if not inside and PRINTS.match(line):
            return number
        inside ^= (line.count(b'"""') + line.count(b"'''")) % 2 == 1
    return 0
