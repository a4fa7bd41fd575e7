"""Every place in the code that starts a program, and what of a submission may reach that program: it is listed here.

A program that is started outside of the sandbox gets an environment that is written down (`env=`), is no bare name that
a variable could lead elsewhere, and takes no terminal. What is new has to be listed, with the reason why it may be.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

GRADER = Path(__file__).resolve().parent.parent / "grader"
INSIDE = {
    "arena/ros/calibration.py": "a copy of the arena, which starts nothing",
    "arena/ros/__main__.py": "a copy of the template, which becomes an arena",
    "arena/ros/functions.py": "runs behind the wall, and its copy calls a student's functions",
}
HANDED = {"arena/ros/launching.py:launch", "rubric/pytest_check.py:_run"}
"""What gets descriptors: the wall its own, the instructor's tests the socket over which calls and values go."""
"""What makes a process, but starts no program of the machine's outside of the sandbox."""


class Start(NamedTuple):
    """`env` and `cwd` are the arguments as they are written; `student`: what of a submission reaches the program."""

    env: str
    cwd: str | None
    student: str


STARTS = {
    "arena/ros/launching.py:launch": Start(
        "HOST_ENV",
        "stage.folder if gate is not None else NOWHERE",
        "nothing: tests/arena/test_process_environment.py",
    ),
    "ros_env.py:_from_setup": Start("base", "'/'", "nothing: ROS's own setup.bash"),
    "arena/arena_process.py:__init__": Start("dict(env)", "'/'", "nothing: ROS's own variables"),
    "host_programs.py:run_host_program": Start("HOST_ENV", "'/'", "nothing: names that the rubric gives"),
    "cli/host_support.py:_modules": Start("ros.env", "'/'", "nothing"),
    "arena/control_groups.py:_move_to_scope": Start(
        "{**HOST_ENV, 'XDG_RUNTIME_DIR': str(RUNTIME / str(os.geteuid()))}",
        "'/'",
        "nothing: systemd is asked for this process's number",
    ),
    "rubric/pytest_check.py:_run": Start(
        "_environment()", "folder", "a copy of the evidence, and values of its functions, as JSON"
    ),
    "intake/git.py:_start": Start(
        "environment", "cwd", "its repository's data; no setting, hook or filter of it"
    ),
    "intake/credentials.py:helper_password": Start(
        "{**with_absolute_paths(os.environ), **SILENT}",
        "'/'",
        "nothing: the address of the course's own server",
    ),
    "limited_child.py:_run": Start(
        "env",  # the variables that loading takes: tests/test_limited_child.py
        "'/'",
        "its archive, and its source files, which are parsed and not run",
    ),
    "limited_child.py:__init__": Start("env", "cwd", "nothing: a template does no job"),
    "workers.py:_start": Start(
        "_environment(self._env)",
        None,
        "what it submitted, as text in jobs that come through a pipe",
    ),
    "verification.py:_ssh_keygen": Start(
        "{**with_absolute_paths(os.environ), 'LC_ALL': 'C', 'SSH_ASKPASS_REQUIRE': 'never'}",
        "'/'",
        "the signature and the sums beside a result, which a student's CI job may have written",
    ),
    "host_programs.py:git_setting": Start(
        "environment", "cwd", "nothing: the settings of the user who grades"
    ),
}
REPLACED = {
    "arena/ros/namespaces.py:<module>": "becomes the program of the probe: arena/sandbox.py",
    "portable.py:own_session": "starts what its callers say: they are listed",
    "limited_child.py:stand_by": "a copy of the template does what a process of its own would",
}
MAKERS = {"Popen", "run", "call", "check_call", "check_output", "getoutput", "getstatusoutput"}
STARTER = re.compile(
    r"\b(os\s*\.\s*(system|popen|fork|exec|spawn|posix_spawn|startfile)|subprocess|Popen|own_session|create_subprocess_\w)"
)  # in each text that `is_start` finds one in
SESSION = "own_session"
"""`grader/portable.py` gives a program that it starts no input."""
SPAWNERS = {"system", "popen", "fork", "forkpty", "posix_spawn", "posix_spawnp", "startfile"}


def named(call: ast.Call) -> tuple[str, str]:
    """`subprocess`, `Popen` of `subprocess.Popen(…)`; the first is empty for a plain name."""
    function = call.func
    if isinstance(function, ast.Attribute):
        return ast.unparse(function.value), function.attr
    return "", function.id if isinstance(function, ast.Name) else ""


def starts(path: Path) -> list[tuple[str, ast.Call]]:
    """Each call that starts a program or makes a process, with the function that it stands in."""
    found: list[tuple[str, ast.Call]] = []

    def look(node: ast.AST, function: str) -> None:
        for child in ast.iter_child_nodes(node):
            inner = child.name if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef) else function
            if isinstance(child, ast.Call) and is_start(*named(child)):
                found.append((f"{path.relative_to(GRADER)}:{inner}", child))
            look(child, inner)

    text = path.read_text(encoding="utf-8")
    if STARTER.search(text):
        look(ast.parse(text), "<module>")
    return found


def is_start(module: str, name: str) -> bool:
    if module == "subprocess":
        return name in MAKERS
    if module == "os":
        return name in SPAWNERS or name.startswith(("exec", "spawn"))
    return name in {"create_subprocess_exec", "create_subprocess_shell", "Popen", SESSION}


@cache
def all_starts() -> list[tuple[str, ast.Call]]:
    """Return every start of the grader, beside nodes and libraries that run behind the wall."""
    return [
        start
        for path in sorted(GRADER.rglob("*.py"))
        if "standins" not in path.parts
        for start in starts(path)
    ]


def calls() -> dict[str, ast.Call]:
    return {where: call for where, call in all_starts() if where.partition(":")[0] not in INSIDE}


def test_every_start_is_listed_and_every_listed_one_is_there() -> None:
    assert calls().keys() == STARTS.keys() | REPLACED.keys()
    assert {where.partition(":")[0] for where, _ in all_starts()} >= INSIDE.keys()
    assert len(all_starts()) == len({where for where, _ in all_starts()})


@pytest.mark.parametrize("where", STARTS)
def test_what_a_program_outside_is_given(where: str) -> None:
    call, listed = calls()[where], STARTS[where]
    words = {word.arg: word.value for word in call.keywords}
    assert ast.unparse(words["env"]) == listed.env
    assert (ast.unparse(words["cwd"]) if "cwd" in words else None) == listed.cwd
    assert words.keys() & {"stdin", "input"} or named(call)[1] == SESSION
    assert not words.keys() & {"shell", "preexec_fn", "executable"}
    assert "close_fds" not in words
    if "pass_fds" in words:
        assert where in HANDED


@pytest.mark.parametrize("where", STARTS)
def test_no_program_is_looked_for_by_a_bare_name(where: str) -> None:
    first = calls()[where].args[0]
    while isinstance(first, ast.List):
        first = first.elts[0]
    if isinstance(first, ast.Constant):
        assert first.value.startswith("/")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import subprocess\ndef f(): subprocess.run(['x'])", True),
        ("import os\nos.execvp('x', [])", True),
        ("import os\nos.system('x')", True),
        ("async def f(): await asyncio.create_subprocess_exec('x')", True),
        ("import os\nos.environ.get('x')", False),
        ("thread.run()", False),
    ],
)
def test_what_counts_as_a_start(
    text: str, found: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.test_programs.GRADER", tmp_path)
    (tmp_path / "new.py").write_text(text)
    assert bool(starts(tmp_path / "new.py")) is found


@pytest.mark.full
def test_modules_that_start_programs_are_imported_as_modules() -> None:
    """`from subprocess import Popen as p` would pass unseen."""
    for path in GRADER.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module in {"subprocess", "os", "pty"}:
                assert not {alias.name for alias in node.names} & (MAKERS | SPAWNERS), path
            if isinstance(node, ast.Import):
                renamed = {alias.name for alias in node.names if alias.asname}
                assert not renamed & {"subprocess", "os"}, path
