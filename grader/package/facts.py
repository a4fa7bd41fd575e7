"""Package facts: everything that a package's files say, read once; nothing of the student's is executed.

Of every file: size, digest, mode, links, encoding, and what the system makes of its first line (`#!`).
"""

from __future__ import annotations

import hashlib
import io
import os
import posixpath
import re
import shlex
import shutil
import stat
import tokenize
from collections.abc import Collection, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from grader.installable import OF_EVERY_ROS
from grader.model.file_fault import Fault
from grader.model.git_ignores import IgnoreLine
from grader.model.launch_file import LaunchFile
from grader.model.message_definitions import PARTS, parse_interface
from grader.model.package import Interface, Manifest, PackageFacts, Shebang, ShebangFault, SourceFile
from grader.model.python_slip import PythonSlip
from grader.model.submission import SourcePackage, Submission
from grader.package.cpp import SUFFIXES, cpp_slips, included_headers
from grader.package.own_modules import drop_slips_of_modules, imported_files
from grader.package.python import check_syntax
from grader.package.reading import (
    LEFT_OUT,
    SOURCE_LIMIT_BYTES,
    Unreadable,
    printable,
    read_markup,
    regular_file,
)
from grader.package.repairs.editing import read_data
from grader.portable import system

_CHUNK_BYTES = 1 << 20
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_GIT_IGNORE = ".gitignore"
_IGNORE_LINES_MAX = _IGNORE_CHARS_MAX = 100
_SCRIPTS = frozenset({".py", ".sh", ".bash"})

SYSTEM_PATH = "/usr/local/bin:/usr/bin:/bin"
_LENGTH_LIMIT_BYTES = 255
_LOOKED_AT_BYTES = 1 << 14
_BOM = b"\xef\xbb\xbf"
_EVERYWHERE = frozenset({"awk", "bash", "dash", "env", "perl", "rbash", "sed", "sh"})
_ENV = frozenset({"/usr/bin/env", "/bin/env"})
_SPLIT_STRING = re.compile(r"^(-[iv0]*S|--split-string[= ])\s*")
_NO_SHEBANG = re.compile(r"#\s*!?\s*(/usr)?/bin/|#\s+!|!\s*#|/usr/bin/env ")

# The arena provides these names wherever the system keeps its programs.
_PYTHONS = frozenset(
    {"python", "python3"}
    | {f"{place}/{name}" for place in SYSTEM_PATH.split(":") for name in ("python", "python3")},
)


class Entry(NamedTuple):
    """A file of the package: the record, and its path on disk below the package (perhaps no Unicode)."""

    file: SourceFile
    path: str


def read_files(package: SourcePackage) -> tuple[Entry, ...]:
    """Return all regular files and links of the package, by path; no link is followed out of it.

    What catkin and git leave behind (`build/`, `devel/`, `install/`, `.git/`, …), pipes and devices are left
    out.
    """
    paths = sorted(_paths(package.folder))
    return tuple(Entry(_source_file(package, path), path) for path in paths)


def _paths(folder: Path) -> Iterator[str]:
    for place, folders, names in os.walk(folder):
        links = [name for name in folders if os.path.islink(os.path.join(place, name))]  # noqa: PTH114, PTH118 - names of any bytes, many of them
        folders[:] = [name for name in folders if name not in LEFT_OUT]
        for name in (*names, *(n for n in links if n not in LEFT_OUT)):
            path = Path(place, name)
            mode = path.lstat().st_mode
            if stat.S_ISREG(mode) or stat.S_ISLNK(mode):
                yield path.relative_to(folder).as_posix()


def _source_file(package: SourcePackage, path: str) -> SourceFile:
    common: dict[str, Any] = {"path": printable(path), "mode_source": package.mode_source}
    file = package.folder / path
    if file.is_symlink():
        target = str(file.readlink())
        common["link"] = printable(target)
        try:
            file = regular_file(package.folder, path)
        except Unreadable as error:
            digest = hashlib.sha256(os.fsencode(target)).hexdigest()
            problem = f"`{common['path']}` {error}"
            return SourceFile(**common, size_bytes=0, sha256=digest, executable=None, link_problem=problem)
        path = file.relative_to(os.path.realpath(package.folder)).as_posix()
    executable = _executable(package, path, file)
    if printable(path) in package.left_out:
        return SourceFile(**common, size_bytes=file.lstat().st_size, sha256="", executable=executable)
    try:
        size, digest, head = _contents(file)
    except OSError:
        return SourceFile(**common, size_bytes=0, sha256="", executable=executable)
    if path in package.right_in_git:
        head = head.replace(b"\r\n", b"\n")
    text = _text_facts(head, path, executable=executable)
    return SourceFile(**common, size_bytes=size, sha256=digest, executable=executable, **text)


def _executable(package: SourcePackage, path: str, file: Path) -> bool | None:
    """As the source says; a file that it does not know has its mode on disk, if modes come from there."""
    if path in package.executable:
        return package.executable[path]
    if package.mode_source != "disk":
        return None
    return bool(file.stat().st_mode & stat.S_IXUSR)


def _contents(file: Path) -> tuple[int, str, bytes]:
    """Return size, sha256 and the first 2 MB."""
    digest, size, head = hashlib.sha256(), 0, b""
    with file.open("rb") as stream:
        while chunk := stream.read(_CHUNK_BYTES):
            digest.update(chunk)
            size += len(chunk)
            head += chunk[: max(0, SOURCE_LIMIT_BYTES - len(head))]
    return size, digest.hexdigest(), head


def _text_facts(data: bytes, path: str, *, executable: bool | None) -> dict[str, Any]:
    utf16 = data.startswith(_UTF16)
    binary = b"\0" in data and not utf16
    suffix = PurePosixPath(path).suffix.lower()
    python = suffix == ".py" or is_near_python(data)
    # of UTF-16, the first line that it has once it is saved as UTF-8
    text = data.decode("utf-16", "replace").encode() if utf16 else data
    shebang, fault, problem = read_shebang(text)
    if not (suffix in _SCRIPTS or ((executable or shebang is not None or python) and not binary)):
        fault, problem = "", ""
    return {
        "shebang": shebang,
        "shebang_problem": problem,
        "shebang_fault": fault,
        "crlf": b"\r\n" in data and not binary,
        "bom": data.startswith(_BOM) or utf16,
        "encoding": _encoding(data, python=python),
        "binary": binary,
        "python": python,
    }


def _encoding(data: bytes, *, python: bool) -> str:
    """Return the encoding that a reader would use: of Python by PEP 263, `unknown-8bit` for what is not UTF-8."""
    if data.startswith(_UTF16):
        return "utf-16"
    name = "utf-8-sig" if data.startswith(_BOM) else "utf-8"
    try:
        if python:
            name, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        data.decode(name)
    except (SyntaxError, LookupError, ValueError):
        # the first 2 MB of a larger file may end within a character
        cut = len(data) >= SOURCE_LIMIT_BYTES and data[:-4].decode("utf-8", "replace").count("\ufffd") == 0
        return "utf-8" if cut else "unknown-8bit"
    return name


def on_system(program: str) -> bool:
    """Whether a program, by absolute path or by name on the system's own PATH, is on this machine. Of a machine that is
    not Linux: whether it is among those that every Linux has."""
    if system():
        place, _, name = program.rpartition("/")
        return name in _EVERYWHERE and place in ("", "/bin", "/usr/bin")
    return shutil.which(program, path=SYSTEM_PATH) is not None


def read_shebang(data: bytes) -> tuple[Shebang | None, ShebangFault, str]:
    """Return the shebang of a file that begins with `data`, and why the system cannot use it ("" where it can): as a
    kind, and in words."""
    if not data.startswith(b"#!"):
        return None, *_near(data)
    line = data[: data.find(b"\n")] if b"\n" in data else data
    crlf = line.endswith(b"\r")
    text = line[2 : _LENGTH_LIMIT_BYTES + 1].decode("utf-8", "replace").rstrip("\r").strip(" \t")
    interpreter, program, problem = resolve(text)
    found = not problem and (program in _PYTHONS or on_system(program))
    if crlf:
        problem = f"there is no `{interpreter}\\r`: save it with LF"
        problem = f"line 1 has a Windows line ending (CRLF), and {problem}"
    elif not problem and not found:
        problem = f"there is no `{program}` on a ROS machine"
    fault: ShebangFault = "line-end" if crlf else "other" if problem else ""
    return Shebang(text=text, interpreter=interpreter, crlf=crlf, found=found), fault, problem


def resolve(text: str) -> tuple[str, str, str]:
    """Return what `#!text` comes down to: the interpreter's name, the program to look for, and what is wrong."""
    if not text:
        return "", "", "nothing follows `#!`"
    program, *rest = text.split(None, 1)
    if not program.startswith("/"):
        return posixpath.basename(program), "", f"`{program}` is not an absolute path"
    place = f"/{posixpath.normpath(program).lstrip('/')}"  # `//usr//bin/env` is no other file
    behind = _behind_env(rest[0] if rest else "") if place in _ENV else (posixpath.basename(place), place, "")
    if program.endswith("/"):
        return behind[0], "", f"`{program}` ends with a slash, as only a folder does"
    return behind


def _behind_env(argument: str) -> tuple[str, str, str]:
    """The kernel hands `env` all that follows as one argument; only `-S` takes it apart."""
    split = _SPLIT_STRING.match(argument)
    words = _words(argument[split.end() :]) if split else argument.split()
    while split and words and (words[0].startswith("-") or "=" in words[0]):
        words = words[1:]
    if not words:
        return "", "", "`env` is given no program"
    name = posixpath.basename(words[0])
    if not split and len(words) > 1:
        return name, "", f"`env` looks for one program called `{argument}`: keep only `{words[0]}`"
    return name, words[0], ""


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:
        return text.split()


def _near(data: bytes) -> tuple[ShebangFault, str]:
    """Return why a file that does not begin with `#!` has no usable shebang, as a kind and in words."""
    lines = data[:_LOOKED_AT_BYTES].splitlines()[:50]
    first = lines[0][:_LENGTH_LIMIT_BYTES].decode("utf-8", "replace").strip() if lines else ""
    later = next((n for n, line in enumerate(lines, 1) if line.strip().startswith(b"#!")), None)
    if not data.strip():
        return "empty-file", "the file is empty"
    if data.startswith(_BOM + b"#!"):
        problem = "an invisible byte order mark (BOM) comes before `#!`: save as UTF-8 without BOM"
        return "byte-order-mark", problem
    if later == 1:
        return "other", "a space comes before `#!`: it must be the very first thing in the file"
    if _NO_SHEBANG.match(first):
        return "other", f"line 1 is `{first[:60]}`, which is not a shebang"
    if later is None:
        return "other", "there is no `#!` line at the top"
    before = f"line 1 is `{first[:40]}`" if first else "line 1 is blank"
    return "other", f"{before} and `#!` comes on line {later}: it must be line 1"


def is_near_python(data: bytes) -> bool:
    """Return whether a file begins with a shebang of Python, usable or spoilt by a BOM, a blank or a blank line."""
    return re.match(rb"(\xef\xbb\xbf)?\s*#\s*![^\n]*\bpython", data[:512]) is not None


INTERFACES_MAX = 200
OTHERS_MAX = 1_000
IMPORTS_MAX = 50
"""So many packages that were handed in beside one are named in its facts."""
INTERFACE_LIMIT_BYTES = 64_000


def read_package(
    package: SourcePackage,
    *,
    hints: tuple[str, ...] = (),
    commands: Collection[tuple[str, tuple[str, ...]]] = (),
    beside: Iterable[SourcePackage] = (),
) -> PackageFacts:
    """Return the facts of one package, as they are before a build (`with_build_facts`).

    A parser reads `CMakeLists.txt`, and this Python looks at the sources, in a process of its own. `commands` are
    launch files with the arguments that scenarios give them, `beside` the other packages of the submission.
    """
    entries = read_files(package)
    with ThreadPoolExecutor(1) as executor:
        sources = [entry.path for entry in entries if _to_check(entry.file)]
        asked = executor.submit(check_syntax, package.folder, sources)
        # the parsers are slow to load, and are loaded while the child reads the scripts
        from grader.package.cmake import read_cmake  # noqa: PLC0415
        from grader.package.manifest import read_manifest  # noqa: PLC0415

        manifest, manifest_fault = read_manifest(package.folder)
        cmake = read_cmake(package.folder, package.name)
        readable = [(entry.file.path, entry.path) for entry in _readable(entries)]
        launch_files, others = _read_launch(package, manifest, readable, commands, beside)
        report = asked.result()
    files = tuple(entry.file for entry in entries)
    texts = _texts(package.folder, files)
    return PackageFacts(
        name=package.name,
        path=package.path,
        manifest=manifest,
        manifest_fault=manifest_fault,
        cmake=cmake,
        files=_with_imports(package.folder, _with_faults(files, report.faults), texts),
        launch_files=tuple(one for one in launch_files if not one.given),
        launched=tuple(one for one in launch_files if one.given),
        hints=hints,
        slips=(
            *drop_slips_of_modules(report.slips, texts),
            *cpp_slips(package.folder, (p for _, p in readable)),
        ),
        interfaces=_interfaces(package.folder, _readable(entries)),
        asked=package.asked,
        beside=others,
        git_ignores=_read_git_ignores(package, (file.path for file in files)),
    )


def _read_launch(
    package: SourcePackage,
    manifest: Manifest | None,
    readable: Collection[tuple[str, str]],
    commands: Collection[tuple[str, tuple[str, ...]]],
    beside: Iterable[SourcePackage],
) -> tuple[tuple[LaunchFile, ...], tuple[str, ...]]:
    """Return the launch files, and the names of the packages `beside` it."""
    from grader.package.launch import packages_beside, read_launch_files  # noqa: PLC0415 - slow to load

    names = (manifest.name if manifest else package.name, package.name)
    packages = packages_beside(package, names, beside)
    others = tuple(sorted(packages)[:OTHERS_MAX])
    known = {*others, *((one.name for one in manifest.dependencies) if manifest else ())}
    return read_launch_files(package.folder, readable, names, commands, known, beside=packages), others


def read_packages(submission: Submission, commands: Collection[tuple[str, tuple[str, ...]]]) -> PackageFacts:
    """Return the facts of a submission's main package, with those of the others; `commands` as in `read_package`."""
    packages = (*submission.packages, *submission.also, submission.package)

    def read(one: SourcePackage, hints: tuple[str, ...] = ()) -> PackageFacts:
        return read_package(one, hints=hints, commands=commands, beside=packages)

    facts = read(submission.package, submission.hints)
    also = tuple(map(read, submission.also))
    return facts.model_copy(update={"also": also})


def with_build_facts(
    facts: PackageFacts,
    *,
    cmake_trace: Path | None = None,
    cmake_root: str | None = None,
    python_faults: Mapping[str, Fault] | None = None,
    python_slips: tuple[PythonSlip, ...] | None = None,
    folder: Path | None = None,
) -> PackageFacts:
    """Return `facts` refined by what the build showed: CMake's own trace, and ROS's own Python on the sources.

    `cmake_trace` is a file that CMake wrote by `--trace-expand --trace-format=json-v1`, `cmake_root` the package's
    folder as CMake saw it. `python_faults` replace the faults of all `python_paths`, and `python_slips` the slips of
    all but C++, with the package's `folder`. What is None stays as it was.
    """
    changes: dict[str, object] = {}
    if cmake_trace is not None and facts.cmake is not None:
        from grader.package.cmake import refine_cmake  # noqa: PLC0415 - slow to load

        names = (facts.name, PurePosixPath(facts.path).name)
        changes["cmake"] = refine_cmake(facts.cmake, names, trace=cmake_trace, root=cmake_root)
    if python_faults is not None:
        asked = set(python_paths(facts))
        kept = {f.path: f.python_fault for f in facts.files if f.python_fault and f.path not in asked}
        changes["files"] = _with_faults(facts.files, {**kept, **python_faults})
    if python_slips is not None and folder is not None:
        slips = drop_slips_of_modules(python_slips, _texts(folder, facts.files))
        of_cpp = (slip for slip in facts.slips if PurePosixPath(slip.file).suffix in SUFFIXES)
        changes["slips"] = (*slips, *of_cpp)
    return facts.model_copy(update=changes)


def python_paths(facts: PackageFacts) -> tuple[str, ...]:
    """Return the files that ROS's Python is to look at, in a copy of the package as well as here.

    Python by name or shebang, not too large, no link by absolute path, and a name that is valid Unicode.
    """
    return tuple(f.path for f in facts.files if _to_check(f) and not _only_here(f))


def imports_of_machine(facts: PackageFacts) -> bool:
    """Return whether a script imports what this Python lacks, and only some installations of ROS have."""
    return not OF_EVERY_ROS.issuperset(s.message for s in facts.slips if s.kind == "lacking-import")


def _interfaces(folder: Path, entries: Iterable[Entry]) -> tuple[Interface, ...]:
    own = (entry for entry in entries if PurePosixPath(entry.file.path).suffix in PARTS)
    return tuple(_interface(folder, entry) for entry in islice(own, INTERFACES_MAX))


def _interface(folder: Path, entry: Entry) -> Interface:
    data = read_markup(folder, entry.path, INTERFACE_LIMIT_BYTES)
    if isinstance(data, Fault):
        return Interface(path=entry.file.path, fields=(), fault=data)
    return parse_interface(data, entry.file.path)


def _only_here(file: SourceFile) -> bool:
    return "\\udc" in file.path or (file.link or "").startswith("/")


def _to_check(file: SourceFile) -> bool:
    return file.python and not file.link_problem and file.size_bytes <= SOURCE_LIMIT_BYTES


def _readable(entries: Iterable[Entry]) -> Iterable[Entry]:
    return (entry for entry in entries if not entry.file.link_problem)


def _with_faults(files: tuple[SourceFile, ...], faults: Mapping[str, Fault]) -> tuple[SourceFile, ...]:
    return tuple(file.model_copy(update={"python_fault": faults.get(file.path)}) for file in files)


def _texts(folder: Path, files: Iterable[SourceFile]) -> dict[str, str]:
    """Return the texts of the package's scripts by path."""
    scripts = [one.path for one in files if one.python and one.link is None]
    return {path: (read_data(folder, path) or b"").decode("utf-8", "replace") for path in scripts}


def _with_imports(
    folder: Path, files: Collection[SourceFile], texts: Mapping[str, str]
) -> tuple[SourceFile, ...]:
    imported = imported_files(texts)
    included = included_headers(folder, (one.path for one in files if not one.link_problem))
    return tuple(
        one.model_copy(
            update={
                "imports": imported.get(one.path, ())[:IMPORTS_MAX],
                "headers": included.get(one.path, ())[:IMPORTS_MAX],
            }
        )
        for one in files
    )


def _read_git_ignores(package: SourcePackage, paths: Iterable[str]) -> tuple[IgnoreLine, ...]:
    """Return the lines that count for the package, those of outer folders first; `paths` are the package's files."""
    if package.mode_source != "git":
        return ()
    above = PurePosixPath(package.path_in_git or package.path).parts
    found: list[IgnoreLine] = []
    for depth in range(len(above), 0, -1):
        folder = package.folder.parents[depth - 1] if depth <= len(package.folder.parents) else None
        below = "/".join(above[len(above) - depth :])
        found += (
            _ignore_lines(folder, _GIT_IGNORE, "../" * depth + _GIT_IGNORE, below)
            if folder is not None
            else []
        )
    for path in sorted(
        (p for p in paths if posixpath.basename(p) == _GIT_IGNORE), key=lambda p: p.count("/")
    ):
        found += _ignore_lines(package.folder, path, path, posixpath.dirname(path))
    return tuple(found[:_IGNORE_LINES_MAX])


def _ignore_lines(folder: Path, path: str, shown: str, below: str) -> Iterator[IgnoreLine]:
    text = (read_data(folder, path) or b"").decode("utf-8", "replace")
    for number, line in enumerate(text.removeprefix("\ufeff").split("\n")[:_IGNORE_LINES_MAX], start=1):
        # a space at the end counts behind a backslash alone
        pattern = re.sub(r"(?<!\\) +$", "", line.removesuffix("\r"))
        if pattern and not pattern.startswith("#") and len(pattern) <= _IGNORE_CHARS_MAX:
            yield IgnoreLine(file=shown, line=number, pattern=pattern, below=below)
