"""What the child that reads hostile data may take, and what it is given."""

from __future__ import annotations

import ast
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from grader import limited_child
from grader.limited_child import Answer, ChildLimits, run_limited

GRADER = Path(limited_child.__file__).parent
FUNCTION = re.compile(r'"(grader\.[\w.]+:\w+)"')
LINT = {path.stem for path in GRADER.glob("package/lint/[a-z]*.py")}
OF_REPAIRS = {
    "errors",
    "installable",
    "line_slips",
    "line_slips.python",
    "line_slips.python_habits",
    "package",
    "package.lint",
    "package.lint.script_blocks",
    "package.lint.script_names",
    "package.lint.script_results",
    "package.lint.script_spellings",
    "package.lint.script_tree",
    "package.python_repairs",
    "package.python_repairs.blocks",
    "package.python_repairs.calls",
    "package.python_repairs.examine",
    "package.python_repairs.imports",
    "package.python_repairs.lines_outside",
    "package.python_repairs.lost_heads",
    "package.python_repairs.members",
    "package.python_repairs.names",
    "package.python_repairs.published",
    "package.python_repairs.python2",
    "package.python_repairs.rospy_names",
    "package.python_repairs.shared_variables",
    "package.python_repairs.syntax",
    "wording",
}
MAY_IMPORT = {
    "grader.intake.archive:unpack_here": {
        *("errors", "intake", "intake.archive", "intake.limits", "intake.names", "intake.tree"),
        *("limited_child", "portable", "wording"),
    },
    "grader.package.lint.syntax:check_all": {"package", "package.lint", "package.lint.syntax"},
    "grader.package.python_repairs.examine:examine": OF_REPAIRS,
    "grader.package.python_repairs.examine:with_sign_turned": OF_REPAIRS,
}
"""The grader's functions that run in such a child, and the modules that they are made of: a module that comes to import
a library, which is not there, takes with it all that its function finds, without an error."""
LIBRARIES = {("python2.py", "fissix"), ("installable.py", "packaging")}
"""The folder of the one is handed to the function that needs it; the other is for a function that no child calls."""
LOADED = """
import importlib, json, sys
sys.path.append(sys.argv[1])
importlib.import_module(sys.argv[2])
names = [n.partition(".")[2] for n in sys.modules if n.startswith("grader.")]
print(json.dumps(names))
"""
LIMITS = ChildLimits(memory_bytes=256 << 20, cpu_s=1, wall_s=30.0, file_bytes=1 << 20)


def ask(name: str, *arguments: object, limits: ChildLimits = LIMITS) -> Answer:
    return run_limited(f"tests.limited_child:{name}", *arguments, limits=limits)


def test_values_come_back_as_they_are() -> None:
    values = ["a\udce9", None, {"b": [1.5, True]}]
    answer = ask("repeat", *values)
    assert [json.loads(line) for line in answer.lines.splitlines()] == values
    assert (answer.done, answer.timed_out) == (True, False)


@pytest.mark.full
@pytest.mark.parametrize("what", ["take_memory", "take_processor_time", "write_much", "crash"])
def test_what_goes_beyond_a_limit_ends_and_what_came_before_counts(what, tmp_path) -> None:
    arguments = (str(tmp_path / "file"),) if what == "write_much" else ()
    timed_out = what == "take_processor_time"
    assert ask(what, *arguments) == Answer(lines=b"1\n", done=False, timed_out=timed_out)


@pytest.mark.full
def test_what_takes_too_long_is_ended() -> None:
    found = ask("take_time", limits=LIMITS._replace(wall_s=3.0))
    assert found == Answer(lines=b"1\n", done=False, timed_out=True)


def test_an_answer_without_end_is_cut() -> None:
    assert len(ask("say_much", limits=LIMITS._replace(answer_bytes=1000)).lines) == 1000


def test_nothing_is_inherited_but_what_loading_takes(monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/tmp")
    monkeypatch.setenv("GRADER_GIT_TOKEN", "secret")
    names, folder, packages = (json.loads(line) for line in ask("look_around").lines.splitlines())
    assert not {"PYTHONPATH", "GRADER_GIT_TOKEN", "HOME"} & set(names)
    assert (folder, packages) == (os.sep, [])


@pytest.mark.skipif(not limited_child.CAN_COPY, reason="Linux only")
def test_children_after_the_first_are_copies_of_one_template_and_leave_nothing_to_each_other() -> None:
    _, first, second = (json.loads(ask("remember").lines) for _ in range(3))
    assert first["parent"] == second["parent"] != os.getpid()
    assert first["own"] != second["own"]
    assert first["remembered"] == second["remembered"] == 1


@pytest.mark.skipif(not limited_child.CAN_COPY, reason="Linux only")
def test_a_template_that_was_killed_costs_no_answer() -> None:
    _, before = (json.loads(ask("remember").lines) for _ in range(2))
    os.kill(before["parent"], signal.SIGKILL)
    assert [ask("repeat", 1).lines, ask("repeat", 2).lines] == [b"1\n", b"2\n"]
    assert json.loads(ask("remember").lines)["parent"] not in {before["parent"], os.getpid()}


def test_without_templates_each_child_is_a_process_of_its_own(monkeypatch) -> None:
    monkeypatch.setattr(limited_child, "CAN_COPY", False)
    assert json.loads(ask("remember").lines)["parent"] == os.getpid()


def test_every_function_that_runs_in_a_child_is_known() -> None:
    texts = [path.read_text() for path in GRADER.rglob("*.py") if path.name != "limited_child.py"]
    found = {name for text in texts if "run_limited" in text for name in FUNCTION.findall(text)}
    assert found == MAY_IMPORT.keys()


@pytest.mark.parametrize("function", MAY_IMPORT)
def test_what_a_function_in_a_child_imports_is_there(function: str) -> None:
    module = function.partition(":")[0]
    command = [sys.executable, "-I", "-S", "-B", "-c", LOADED, limited_child.ROOT, module]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert set(json.loads(done.stdout)) == MAY_IMPORT[function]
    paths = [GRADER.joinpath(*name.split(".")) for name in MAY_IMPORT[function]]
    files = [path / "__init__.py" if path.is_dir() else path.with_suffix(".py") for path in paths]
    files += GRADER.glob("package/lint/*.py")
    # a folder without __init__.py is a package, too
    found = {(file.name, root) for file in files if file.exists() for root in _imports_of(file)}
    known = {*sys.stdlib_module_names, "grader", *LINT}
    assert {one for one in found - LIBRARIES if one[1] not in known} == set()


@cache
def _imports_of(file: Path) -> frozenset[str]:
    return frozenset(_imported(ast.parse(file.read_text())))


def _imported(tree: ast.AST) -> Iterator[str]:
    """Yield the first names of what a file imports, within functions too; not what only its types need."""
    if isinstance(tree, ast.If) and ast.unparse(tree.test) == "TYPE_CHECKING":
        return
    if isinstance(tree, ast.Import):
        yield from (alias.name.split(".")[0] for alias in tree.names)
    elif isinstance(tree, ast.ImportFrom) and not tree.level:
        yield (tree.module or "").split(".")[0]
    for node in ast.iter_child_nodes(tree):
        yield from _imported(node)
