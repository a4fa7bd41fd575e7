"""TAB in bash, zsh and fish; and what is offered, without a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest

from grader.cli.commands.integrations import Shell
from grader.cli.completion import (
    BY_VALUE,
    SPECIAL,
    completer_of,
    completing_parser,
    explained,
    lab_ids,
    mutants,
    paths,
    submissions,
)
from grader.cli.main import commands, options, run, value_of
from grader.report.forms import FORMS
from grader.rubric.find import rubric_ids
from grader.rubric.load import all_rubrics
from tests.cli.shells import Asked, Typed

LAB = "leeds-comp3631-lab1"
SHELLS = get_args(Shell)
LINES = [
    ("grader exp", ("explain", "export")),
    ("grader rubric va", ("validate ",)),
    ("grader check --st", ("--static ",)),
    ("grader check --rubric ", rubric_ids()),
    ("grader explain counter-w", ("counter-wrap ",)),
    (f"grader explain {LAB}/counter-", tuple(f"{LAB}/counter-{end}" for end in ("start", "step", "wrap"))),
    ("grader report results --form s", ("sarif ",)),
    ("grader gradebook results --form ", ("canvas", "moodle", "blackboard", "csv", "jsonl", "xlsx")),
    ("grader grade sub", ("submission.zip ",)),
    ("grader batch ", ("roster.csv", "results/")),
    ("grader batch roster.csv --only f", ("failed ",)),
    ("grader publish results --only a", ("ada ",)),
    ("grader course grade course.yaml la", ("lab1 ", "lab2 ")),
    ("grader completion ", SHELLS),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("completion")
    (folder / "results").mkdir()
    (folder / "course.yaml").write_text(
        "title: A course\nlabs: {lab1: {rubric: one.yaml}, lab2: {rubric: two.yaml}}\n"
    )
    (folder / "results" / "run.json").write_text('{"entries": [{"id": "ada"}, {"id": "bob"}]}')
    for name in ("submission.zip", "roster.csv", "mine.yaml", "notes.txt"):
        (folder / name).touch()
    return folder


@pytest.fixture(scope="module", params=SHELLS)
def shell(request: pytest.FixtureRequest, folder: Path) -> Iterator[Typed | Asked]:
    shell = Asked(folder) if request.param == "fish" else Typed(request.param, folder)
    yield shell
    shell.close()


@pytest.mark.full
@pytest.mark.parametrize(("line", "words"), LINES, ids=[line.replace(" ", "_") for line, _ in LINES])
def test_a_real_shell_completes(shell: Typed | Asked, line, words):
    assert shell.missing(line, *words) == []


@pytest.mark.parametrize("shell_name", SHELLS)
def test_the_command_prints_a_script(capsys, shell_name):
    assert run(["completion", shell_name]) == 0
    out = capsys.readouterr()
    assert "_ARGCOMPLETE" in out.out
    assert out.err == ""


def test_another_shell_is_refused(capsys):
    assert run(["completion", "tcsh"]) == 2
    assert "tcsh" in capsys.readouterr().err


def taken() -> list[tuple[str, argparse.Action]]:
    return [
        (command.prog, action)
        for command in commands(completing_parser())
        for action in options(command)
        if action.nargs != 0 and action.choices is None
    ]


def test_somebody_thought_of_every_value():
    unknown = {
        f"{prog}: {value_of(action)}"
        for prog, action in taken()
        if value_of(action) not in BY_VALUE and (prog, action.dest) not in SPECIAL
    }
    assert unknown == set()


def test_no_rule_is_left_over():
    asked = {(prog, action.dest) for prog, action in taken()}
    assert SPECIAL.keys() - asked == set()
    assert BY_VALUE.keys() - {value_of(action) for _, action in taken()} == set()


def test_the_criteria_are_those_that_explain_knows():
    hidden = {c.id for r in all_rubrics() for c in r.rubric.criteria if c.visibility != "visible"}
    visible = {c.id for r in all_rubrics() for c in r.rubric.criteria if c.visibility == "visible"}
    offered = explained(prefix="", parsed_args=argparse.Namespace())
    assert visible <= offered.keys()
    assert not (hidden - visible) & offered.keys()
    assert offered["counter-wrap"]
    assert f"{LAB}/" in offered


def test_with_a_rubric_its_own_criteria_are_offered(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text(
        "criteria: [{id: mine, title: Mine}, {id: secret, visibility: hidden}, 3]", encoding="utf-8"
    )
    offered = explained(prefix="", parsed_args=argparse.Namespace(rubric=str(own)))
    assert offered["mine"] == "Mine"
    assert not {"secret", "chatter-rate"} & offered.keys()


@pytest.mark.parametrize("text", [b"", b"\xff\xfe", b"- a", b"criteria: 3", b"a: [", b"[" * 5000])
def test_a_rubric_that_is_no_rubric_offers_checks_only(tmp_path, text):
    path = tmp_path / "broken.yaml"
    path.write_bytes(text)
    offered = explained(prefix="", parsed_args=argparse.Namespace(rubric=str(path)))
    assert "manifest" in offered
    assert offered == explained(prefix="", parsed_args=argparse.Namespace(rubric=str(tmp_path / "missing")))


def test_mutants_are_those_of_the_lab():
    offered = mutants(parsed_args=argparse.Namespace(rubric=LAB), named="rubric")
    assert "talker-crlf" in offered
    assert mutants(parsed_args=argparse.Namespace(rubric="own.yaml"), named="rubric") == {}


@pytest.mark.full
def test_every_mistake_that_is_offered_is_one(tmp_path, capsys):
    offered = mutants(parsed_args=argparse.Namespace(lab=LAB), named="lab")
    assert offered
    for number, name in enumerate(offered):
        assert run(["example", LAB, str(tmp_path / str(number)), "--mistake", name]) == 0, (
            capsys.readouterr().err
        )


def test_labs_come_with_their_titles():
    assert lab_ids() == {r.rubric.id: r.rubric.title for r in all_rubrics()}


def test_paths(folder: Path, monkeypatch):
    monkeypatch.chdir(folder)
    (folder / "results" / ".hidden").touch()
    (folder / "results" / "a b.zip").touch()
    assert set(paths(prefix="", endings=())) == {"results/"}
    assert set(paths(prefix="s", endings=(".zip",))) == {"submission.zip"}
    assert set(paths(prefix="", endings=None)) == {
        "course.yaml", "mine.yaml", "notes.txt", "results/", "roster.csv", "submission.zip"
    }  # fmt: skip
    assert set(paths(prefix="results/", endings=None)) == {"results/a b.zip", "results/run.json"}
    assert set(paths(prefix="results/.", endings=None)) == {"results/.hidden"}
    assert set(paths(prefix=f"{folder}/res", endings=())) == {f"{folder}/results/"}


@pytest.mark.parametrize("prefix", ["missing/", "~nobody-of-that-name/", "a\0b/", "roster.csv/"])
def test_no_path_is_no_fault(folder: Path, monkeypatch, prefix):
    monkeypatch.chdir(folder)
    assert paths(prefix=prefix, endings=None) == {}


def test_nobody_guesses_numbers_and_names():
    by_place = {(prog, action.dest): action for prog, action in taken()}
    for place in (("grader batch", "jobs"), ("grader grade", "submission_id"), ("grader batch", "before")):
        assert completer_of(place[0], by_place[place])(prefix="", parsed_args=argparse.Namespace()) == {}


@pytest.mark.parametrize("text", ["", "[]", '{"entries": 1}', '{"entries": [{}]}'])
def test_of_what_is_no_class_no_ids_are_offered(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    assert submissions(parsed_args=argparse.Namespace(folder=tmp_path)) == {}
    assert submissions(parsed_args=argparse.Namespace()) == {}


def test_forms_are_offered_by_the_parser_itself():
    report = next(command for command in commands(completing_parser()) if command.prog == "grader report")
    assert next(action.choices for action in options(report) if action.dest == "form") == tuple(FORMS)
