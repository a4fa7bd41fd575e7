"""What `from grader import …` gives, and what it costs."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import grader
from grader import api, errors

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "how-to" / "python-api.md"


def fresh(code: str) -> str:
    """What that prints in a Python of its own."""
    run = [sys.executable, "-W", "error", "-c", code]
    return subprocess.run(run, capture_output=True, text=True, check=True, cwd="/").stdout.strip()


def test_importing_it_loads_nothing() -> None:
    seen = fresh(
        "import sys; before = set(sys.modules); import grader; print(sorted(set(sys.modules) - before))"
    )
    loaded = set(eval(seen))  # noqa: S307 - a list of our own
    assert {name for name in loaded if name.startswith("grader.")} == set()
    assert not loaded & {"pydantic", "yaml", "mcap", "numpy", "asyncio", "subprocess"}


def test_help_loads_none_of_it() -> None:
    code = "import sys; from grader.cli.main import run; run(['--help']); print('grader.api' in sys.modules)"
    assert fresh(code).endswith("False")


@pytest.mark.full
def test_judging_loads_no_arena() -> None:
    code = (
        "import sys; from grader import judge, load_rubric; print([m for m in sys.modules if '.arena' in m])"
    )
    assert fresh(code) == "[]"


@pytest.mark.parametrize("name", grader.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(grader, name) is not None
    assert name in dir(grader)
    if name != "__version__":
        assert getattr(grader, name).__doc__, name


def test_other_names_are_not() -> None:
    with pytest.raises(AttributeError, match="module 'grader' has no attribute 'mark'"):
        grader.mark  # noqa: B018
    with pytest.raises(ImportError):
        from grader import mark  # noqa: F401, PLC0415


def test_nothing_else_in_the_package_has_such_a_name() -> None:
    """`from grader import judge` is the function, whatever was imported before."""
    assert {module.name for module in pkgutil.iter_modules(grader.__path__)} & set(grader.__all__) == set()


def test_judge_is_the_function_whatever_was_imported_before() -> None:
    before = "import grader.judging.judge, grader.cli.commands.grading, grader.pipeline"
    assert fresh(f"{before}\nfrom grader import judge, grade\nprint(judge.__module__, grade.__module__)") == (
        "grader.api grader.api"
    )


@pytest.mark.full
def test_the_star_gives_them_all() -> None:
    names = fresh("from grader import *; print(sorted(n for n in dir() if not n.startswith('__')))")
    assert eval(names) == sorted(n for n in grader.__all__ if not n.startswith("__"))  # noqa: S307


def test_errors_that_are_raised_are_there() -> None:
    kinds = {errors.GraderError, errors.UsageError, errors.RubricError, errors.SubmissionError}
    kinds |= {errors.EvidenceError, errors.HostError}
    assert {getattr(grader, kind.__name__) for kind in kinds} == kinds


def test_the_examples_in_the_docstrings_are_true() -> None:
    assert doctest.testmod(api, raise_on_error=True).attempted >= 3


def test_the_module_is_marked_as_typed() -> None:
    assert (Path(grader.__file__).parent / "py.typed").is_file()


def test_the_page_names_all_of_it_and_nothing_else() -> None:
    text = PAGE.read_text()
    assert [name for name in grader.__all__ if f"`{name}" not in text] == []
    imported = {
        name.strip()
        for line in text.splitlines()
        if line.startswith("from grader import ")
        for name in line.removeprefix("from grader import ").split(",")
    }
    assert imported <= set(grader.__all__)


def test_importing_again_gives_the_same() -> None:
    assert importlib.import_module("grader").grade is api.grade


def test_the_page_s_programs_are_sound_and_the_one_that_judges_works(
    tmp_path: Path, monkeypatch, capsys
) -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 3
    for block in blocks:
        compile(block, "page", "exec")
    shutil.copytree(ROOT / "fixtures" / "formats" / "class" / "bob", tmp_path / "results" / "bob")
    rubric = (ROOT / "rubrics" / "leeds-comp3631-lab1.yaml").read_text()
    head, tail = rubric.replace("points: 5", "points: 4", 1).split("  - id: numeric-rate\n")
    changed = "  - id: numeric-rate\n".join([head, tail.replace("points: 5", "points: 6", 1)])
    (tmp_path / "my-rubric.yaml").write_text(changed)
    monkeypatch.chdir(tmp_path)
    exec(blocks[1], {})  # noqa: S102 - the page's own
    assert capsys.readouterr().out == "bob 65.7 84.0\n"
