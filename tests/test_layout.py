"""Imports go one way, as docs/design.md says, and what must stay pure imports no I/O."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

GRADER = Path(__file__).resolve().parent.parent / "grader"
ROS_SIDE = (GRADER / "arena" / "ros", GRADER / "package" / "lint")
"""What ROS's own Python runs."""
ROOT = GRADER.parent
NAMED = re.compile(r"(?<!`)`([\w./-]+)`(?!`)")
"""A path or a name in the text of a page or a docstring."""
EXAMPLES = {
    *(".py", "a.py", "scripts/numeric_talker.py", "scripts/talker.py", "src/a.py", "src/nodes/a.py"),
    *("../b/scripts/talker.py", "evidence/repaired-1/", "evidence/repaired-2/", "evidence/repeated-1/"),
}
"""What a submission, or a folder of results, may have in it."""
OF_NO_MODULE = {"browser", "docs", "fresh", "fuzz", "hostile", "packaging"}
"""Folders of tests that test no single folder or module of the grader."""
NO_MODULES = {"copydetect", "params", "run", "sarif"}
"""Names in the docstrings of rooms that are a library, a check's parameters and a form."""

# Who may import whom, beside itself. `rubric.model` and `rubric.scenario` hold records only: who may see records may
# see them.
BASE = {"model", "errors", "portable", "untrusted_text", "wording"}
ALLOWED = {
    "__init__": {"api", "errors", "model", "results", "rubric"},
    "model": {"wording"},
    "errors": set[str](),
    "untrusted_text": set[str](),
    "wording": set[str](),
    "installable": {"errors", "wording"},
    "line_slips": {"model", "wording"},
    "portable": {"errors"},
    "ros_env": {"errors", "host_programs", "installable", "model", "portable", "wording"},
    "host_programs": set[str](),
    "limited_child": {"host_programs"},
    "workers": {"errors", "host_programs", "limited_child"},
    "files": {"errors", "portable"},
    "results": BASE | {"files"},
    "verification": BASE | {
        "evidence", "files", "host_programs", "intake", "judging", "report", "results", "rubric"
    },
    "faults": BASE | {"files", "intake", "judging", "report", "results", "rubric"},
    "evidence": BASE | {"files", "installable"},
    "package": BASE | {
        "files", "host_programs", "installable", "limited_child", "rubric.model", "rubric.scenario", "line_slips"
    },
    "intake": BASE | {"files", "host_programs", "limited_child"},
    "checks": BASE | {"evidence", "installable", "line_slips"},
    "rubric": BASE | {"checks", "evidence", "files", "installable", "ros_env"},
    "judging": BASE | {"checks", "evidence", "installable", "rubric"},
    "report": BASE | {"checks", "evidence", "files", "judging", "rubric"},
    "arena": BASE | {
        "evidence", "files", "host_programs", "package", "ros_env", "rubric.course_packages",
        "rubric.model", "rubric.pytest_check", "rubric.scenario"
    },
    "submitted_recordings": BASE | {"evidence", "files", "intake", "rubric.model"},
    "repaired_copy": {"files", "judging", "model", "package", "rubric", "wording"},
    "recording": BASE | {
        "arena", "evidence", "files", "installable", "judging", "package", "repaired_copy", "ros_env",
        "rubric", "submitted_recordings"
    },
    "pipeline": BASE | {
        "arena", "evidence", "faults", "files", "intake", "judging", "package", "recording", "repaired_copy", "report",
        "results", "ros_env", "rubric", "submitted_recordings"
    },
    "api": {
        *BASE, "arena.interruption", "evidence", "files", "judging", "pipeline", "results", "rubric"
    },
    "authoring": {
        *BASE, "checks", "classes.batch", "evidence", "files", "intake", "package", "pipeline", "rubric"
    },
    "classes": {
        *BASE, "ros_env", "checks", "evidence", "faults", "files", "host_programs", "installable", "intake", "judging",
        "pipeline", "report", "results", "rubric", "workers"
    },
    "student": {
        *BASE, "arena.interruption", "arena.workspace", "faults", "files", "intake", "package", "pipeline", "report",
        "results", "rubric"
    },
    "integrations": BASE
    | {"faults", "files", "installable", "intake", "judging", "pipeline", "report", "results", "rubric"},
    "cli": {
        *BASE, "arena", "authoring", "checks", "classes", "evidence", "faults", "files", "integrations", "intake",
        "host_programs", "installable", "judging", "package", "pipeline", "report", "results", "ros_env",
        "rubric", "student", "verification"
    },
    "__main__": {"cli"},
}  # fmt: skip
IO_MODULES = {
    "asyncio", "fileinput", "glob", "http", "io", "logging", "multiprocessing", "os", "random", "select", "shutil",
    "socket", "sqlite3", "subprocess", "tempfile", "threading", "time", "urllib",
}  # fmt: skip
IO_CALLS = {"open", "print", "input", "exec", "eval"}
ROS_MODULES = {"rosgraph", "rosmaster", "genpy", "rospy"}


def test_the_rule_itself_goes_one_way() -> None:
    graph = {
        station: {name.split(".")[0] for name in names} - {station} for station, names in ALLOWED.items()
    }
    order = list(TopologicalSorter(graph).static_order())
    assert order.index("model") < order.index("judging") < order.index("pipeline") < order.index("cli")


def test_every_station_is_in_the_rule() -> None:
    assert {_station(path) for path in _sources(GRADER)} <= ALLOWED.keys()


def test_imports_go_one_way() -> None:
    wrong = [
        f"{path.relative_to(GRADER)}: {module}"
        for path in _sources(GRADER)
        for module in _read(path).imports
        if module.startswith("grader.") and not _may(_station(path), module.removeprefix("grader."))
    ]
    assert wrong == []


def test_checks_and_records_do_no_io() -> None:
    wrong = [
        f"{path.relative_to(GRADER)}: {name}"
        for folder in ("checks", "report/figures", "model")
        for path in _sources(GRADER / folder)
        for name in [*_read(path).imports, *_read(path).calls]
        if name.split(".")[0] in IO_MODULES or name in IO_CALLS
    ]
    assert wrong == []


def test_checks_parse_python_where_threads_can() -> None:
    wrong = [str(path) for path in _sources(GRADER / "checks") if "ast.parse(" in path.read_text("utf-8")]
    assert wrong == [], "grader.line_slips.python.parsed is for threads that parse at the same time"


def test_checks_see_evidence_as_records_only() -> None:
    seen = {
        m
        for path in _sources(GRADER / "checks")
        for m in _read(path).imports
        if m.startswith("grader.evidence")
    }
    assert {module.split(".")[2] for module in seen} <= {"run", "events"}


def test_the_support_of_checks_imports_no_family_of_checks() -> None:
    shared = {"support", "registry"}
    found = {m for path in _sources(GRADER / "checks" / "support") for m in _read(path).imports}
    assert {m.split(".")[2] for m in found if m.startswith("grader.checks.")} <= shared


def test_the_ros_side_needs_ros_and_the_standard_library_only() -> None:
    own = {path.stem for side in ROS_SIDE for path in side.glob("*.py")}
    known = own | ROS_MODULES | sys.stdlib_module_names | {"distutils"}  # which ROS's own Python has
    found = {
        module.split(".")[0] for side in ROS_SIDE for path in _sources(side) for module in _read(path).imports
    }
    assert found - known == set()


@pytest.mark.parametrize(
    "path", sorted(path for side in ROS_SIDE for path in side.glob("*.py")), ids=lambda path: path.name
)
def test_the_ros_side_is_python_3_8(path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))
    assert tree.body


def test_files_that_the_design_and_docstrings_name_are_there() -> None:
    paths = "\n".join(f"/{path.relative_to(ROOT)}" for path in _repository())
    rooms = {path.name for path in GRADER.iterdir() if path.is_dir()} | {"grader"}
    wrong = [
        f"{place}: {name}"
        for place, text in _texts()
        for name in NAMED.findall(text)
        if (name.endswith(".py") or (name.endswith("/") and name.split("/")[0] in rooms))
        and name not in EXAMPLES
        and f"/{name}" not in paths
    ]
    assert wrong == []


def test_modules_that_the_docstring_of_a_room_names_are_there() -> None:
    modules = {part for path in _sources(GRADER) for part in path.relative_to(ROOT).with_suffix("").parts}
    wrong = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in GRADER.rglob("__init__.py")
        for name in NAMED.findall(_read(path).about)
        if re.fullmatch("[a-z_.]+", name)
        and not name.endswith((".jsonl", ".yaml", ".html", ".py"))
        and not set(name.split(".")) & (modules | NO_MODULES)
        and not _defines(path.parent, name)
    ]
    assert wrong == []


def test_folders_of_tests_are_those_of_what_they_test() -> None:
    folders = {path.parent.relative_to(ROOT / "tests") for path in (ROOT / "tests").rglob("test_*.py")}
    named = {folder for folder in folders if not set(folder.parts) & OF_NO_MODULE}
    assert {
        str(folder)
        for folder in named
        if not ((GRADER / folder).is_dir() or (GRADER / folder).with_suffix(".py").is_file())
    } == set()


def _defines(folder: Path, name: str) -> bool:
    return any(f"def {name}(" in path.read_text(encoding="utf-8") for path in folder.glob("*.py"))


def _repository() -> Iterator[Path]:
    return (path for top in ("grader", "scripts", "tests") for path in (ROOT / top).rglob("*.py"))


def _texts() -> Iterator[tuple[str, str]]:
    """Yield the pages about the code and every docstring of the grader, each with its place."""
    for page in ("docs/design.md", "CONTRIBUTING.md"):
        yield page, (ROOT / page).read_text(encoding="utf-8")
    for path in _sources(GRADER):
        for line, text in _read(path).docstrings:
            yield f"{path.relative_to(ROOT)}:{line}", text


def _sources(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*.py")) if "_data" not in path.parts)


def _station(path: Path) -> str:
    return path.relative_to(GRADER).parts[0].removesuffix(".py")


def _may(station: str, module: str) -> bool:
    parts = module.split(".")
    return parts[0] == station or bool({parts[0], ".".join(parts[:2])} & ALLOWED[station])


class _Module(NamedTuple):
    """What stands in a module: what it imports, in functions too, with `from grader import pipeline` as
    `grader.pipeline`; the names that it calls; its docstrings, each with its line."""

    about: str
    imports: list[str]
    calls: list[str]
    docstrings: list[tuple[int, str]]


@cache
def _read(path: Path) -> _Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = _Module(ast.get_docstring(tree) or "", [], [], [])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.imports.extend(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module == "grader":
            named = (alias.name for alias in node.names if alias.name != "__version__")
            found.imports.extend(f"grader.{name}" for name in named)
        elif isinstance(node, ast.ImportFrom):
            found.imports.append(f"{'.' * node.level}{node.module or ''}")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.calls.append(node.func.id)
        elif isinstance(node, ast.Expr) and isinstance(getattr(node.value, "value", None), str):
            found.docstrings.append((node.lineno, node.value.value))
    return found


WITHOUT_EXTRAS = """
import importlib, pkgutil, sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[1:]:
            raise ModuleNotFoundError(name=name)
sys.meta_path.insert(0, Hidden())
import grader
for module in pkgutil.walk_packages(grader.__path__, "grader."):
    if not any(part in module.name for part in (".arena.ros", ".package.lint", ".standins", "__main__")):
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError:
            print(module.name)
"""
OF_EXTRAS = ("cryptography", "copydetect", "dask", "distributed", "flask", "fsspec", "waitress")


def test_what_an_extra_brings_is_imported_by_its_own_modules_alone() -> None:
    """So `grader batch` runs where only the grader itself is installed."""
    command = [sys.executable, "-c", WITHOUT_EXTRAS, *OF_EXTRAS]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    found = done.stdout.split()
    assert found
    assert {name.rpartition(".")[0] for name in found} <= {
        "grader.classes.cluster", "grader.classes.review", "grader.classes.similarity",
    }  # fmt: skip
