"""Which files a file leads to: those that it names or imports, or any, where nobody can foresee which. Pure.

Who only reads this much of a file errs on one side: what may be read counts as read.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import PurePosixPath

from grader.model.package import SourceFile
from grader.student.watching.snapshot import Picture

CODE = frozenset({".c", ".cc", ".cpp", ".cxx", ".c++", ".h", ".hh", ".hpp", ".hxx", ".inl", ".tpp"})
MARKUP = frozenset({".launch", ".test", ".xml", ".xacro", ".urdf", ".sdf", ".world", ".machine"})
DATA = frozenset({".yaml", ".yml", ".json", ".txt", ".csv", ".md", ".rst", ".cfg", ".ini", ".toml", ".rviz"})
SHELL, SHELLS = frozenset({".sh", ".bash"}), frozenset({"sh", "bash", "dash"})
LIBRARY = re.compile(
    r"(ros\w*|gen(py|msg)|\w+_(msgs|srvs)|catkin\w*|message_filters|actionlib|dynamic_reconfigure|tf2?(_\w+)?"
    r"|yaml|numpy|rospkg|netifaces|defusedxml|distro|six|gnupg|Cryptodome|em|cv2|cv_bridge)"
)
FINDS = re.compile(
    r"\b(open|exec|eval|execfile|walk|loadtxt|genfromtxt|imread|read_csv|Bag)\s*\(|\bos\s*\.\s*(path|open|popen|system|exec|spawn)"
    r"|\bfrom\s+os\b|\b(__import__|importlib|runpy|pkgutil|imp|glob|listdir|scandir|pathlib|chdir|subprocess|Popen|rospkg"
    r"|roslib|roslaunch|rosparam|__file__|shutil|ctypes|load_source|np\.load|numpy\.load)\b"
)
FINDS_IN_SHELL = re.compile(
    r"`|\$\(|[\w/.]\*|\*[\w/.]|\bin\s+\*|[\w/.]\$|\$\w+[/.]|\$\{\w+\}[\w/.]|\b(find|ls|eval|source|xargs|read|mapfile|rospack|roscd|cd)\b"
)
FINDS_IN_CODE = re.compile(
    r"\b(fopen|open|ifstream|fstream|filesystem|system|popen|exec[lv]\w*|dlopen|getPath)\b"
)
UNRESOLVED = re.compile(r"\$\((?!find\s|dirname\))|\$\{|&\#|<!ENTITY|\b(launch-prefix|command)\s*=")
YAML, YAML_COMMENT = frozenset({".yaml", ".yml"}), re.compile(r"^\s*#[^\n]*", re.MULTILINE)
WORD = re.compile(r"\w+")


def leads_anywhere(picture: Picture, path: str) -> bool:
    """Whether a file that is used may use any other one: by a name that it works out, or in a way that is unknown."""
    file, text = picture.files[path], picture.texts.get(path)
    suffix = PurePosixPath(path).suffix.lower()
    if text is None:
        return file.python or bool(file.executable) or suffix in MARKUP or suffix in CODE
    if file.python:
        return FINDS.search(text) is not None
    if suffix in CODE:
        return FINDS_IN_CODE.search(text) is not None
    if suffix in MARKUP:
        return UNRESOLVED.search(text) is not None
    if suffix in SHELL or (file.shebang and file.shebang.interpreter.rpartition("/")[2] in SHELLS):
        return FINDS_IN_SHELL.search(text) is not None
    return file.shebang is not None or (bool(file.executable) and suffix not in DATA)


def leads_to(picture: Picture, path: str) -> Iterator[str]:
    """The files that a file names, imports or is a link to."""
    file, text = picture.files[path], picture.texts.get(path)
    if file.link is not None:
        yield from named(picture, file.link)
    if text is None:
        return
    if PurePosixPath(path).suffix.lower() in YAML:
        text = YAML_COMMENT.sub("", text)
    modules = _imported(text) if file.python else frozenset[str]()
    for other, about in picture.files.items():
        if other != path and (_names(text, PurePosixPath(other).name) or _modules(other, about) & modules):
            yield other


def named(picture: Picture, name: str) -> Iterator[str]:
    """All files of this name, in whatever folder."""
    wanted = PurePosixPath(name).name
    return (path for path in picture.files if PurePosixPath(path).name == wanted)


def is_library(path: str) -> bool:
    """Whether a Python file takes the place of a module that everybody's imports may lead to (`random.py`)."""
    place = PurePosixPath(path)
    stem = place.parent.name if place.name == "__init__.py" else place.stem
    return place.suffix == ".py" and (stem in sys.stdlib_module_names or LIBRARY.fullmatch(stem) is not None)


def _names(text: str, name: str) -> bool:
    """Whether the name is there as a whole: `talker.py` is not named by `numeric_talker.py`."""
    return name in text and re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", text) is not None


def _modules(path: str, file: SourceFile) -> set[str]:
    """By which names in an `import` a file may be meant."""
    place = PurePosixPath(path)
    if place.name == "__init__.py":
        return {place.parent.name}
    return {place.name.partition(".")[0]} if file.python or place.suffix in {".so", ".py"} else set()


def _imported(text: str) -> frozenset[str]:
    """Every part of every module's name; of what is no Python (yet), every word."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return frozenset(WORD.findall(text))
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found.update(part for name in names for part in name.split("."))
    return frozenset(found)
