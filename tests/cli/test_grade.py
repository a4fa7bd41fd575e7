from __future__ import annotations

import json

import pytest

from grader.cli.main import run
from grader.errors import ArenaError, PackageNotFound, SandboxMissing
from grader.model.result import ErrorInfo
from tests.cli.conftest import passing
from tests.rubric.samples import spoiled


def grade(lab, tmp_path, *more: str) -> int:
    return run(["grade", "somewhere", "--rubric", lab, "--out", str(tmp_path / "out"), *more])


@pytest.mark.parametrize(
    "case",
    [
        ("pass", "graded", 0),
        ("fail", "graded", 1),
        ("partial", "graded", 1),
        ("blocked", "graded", 1),
        ("inconclusive", "inconclusive", 4),
        ("error", "error", 3),
        ("manual", "inconclusive", 4),
    ],
)
def test_exit_code_follows_the_result(case, pipeline, lab, tmp_path, capsys):
    status, graded, code = case
    pipeline.outcome = passing(status, graded=graded)
    assert grade(lab, tmp_path) == code
    out = capsys.readouterr().out
    assert ("Not decided yet" in out) == (status in {"inconclusive", "error", "manual"})
    assert (status == "fail") == ("✗" in out)
    assert f"Report: {tmp_path / 'out' / 'ada' / 'report.html'}\nBeside it: result.json" in out
    assert "\x1b" not in out


@pytest.mark.parametrize(
    ("mark", "status", "code"),
    [(40, "fail", 0), (41, "fail", 1), (40, "inconclusive", 0), (41, "inconclusive", 4)],
)
def test_a_pass_mark_in_points_decides(mark, status, code, pipeline, tmp_path):
    lab = str(spoiled(tmp_path, ("package: lab1\n", f"package: lab1\npass_mark: {mark}\n")))
    pipeline.outcome = passing(status)
    assert grade(lab, tmp_path) == code


def test_a_hidden_criterion_does_not_count_for_the_default_mark(pipeline, tmp_path):
    lab = str(spoiled(tmp_path, ("    requires:", "    visibility: hidden\n    requires:")))
    pipeline.outcome = passing("fail")
    assert grade(lab, tmp_path) == 0


def test_json_prints_what_the_file_holds(pipeline, lab, tmp_path, capsys):
    assert grade(lab, tmp_path, "--json") == 0
    printed = capsys.readouterr().out
    assert printed == (tmp_path / "out/ada/result.json").read_text()
    assert json.loads(printed)["schema"] == "grader.result/1"


def test_an_error_in_the_result_is_told_and_ends_with_3(pipeline, lab, tmp_path, capsys):
    error = ErrorInfo(kind="arena", message="the roscore died", hint="grade again")
    pipeline.outcome = passing().model_copy(update={"status": "error", "error": error})
    assert grade(lab, tmp_path) == 3
    assert capsys.readouterr().err.endswith("grader: error: the roscore died\n  hint: grade again\n")


@pytest.mark.parametrize(
    "case",
    [
        (
            PackageNotFound("no lab1\x1b[2J here", hint="push it"),
            3,
            "grader: error: no lab1\\x1b[2J here\n  hint: push it\n",
        ),
        (ArenaError("two\nlines"), 3, "grader: error: two\\nlines\n"),
        (SandboxMissing("none"), 3, "grader: error: none\n"),
        (KeyboardInterrupt(), 130, "grader: interrupted\n"),
        (BrokenPipeError(), 141, ""),
        (
            ZeroDivisionError("by\x07zero"),
            3,
            "grader: internal error: ZeroDivisionError: by\\x07zero (run with --debug for the traceback)\n",
        ),
    ],
)
def test_errors_are_lines_and_never_a_traceback(case, pipeline, lab, tmp_path, capsys):
    error, code, lines = case
    pipeline.outcome = error
    assert grade(lab, tmp_path) == code
    shown = capsys.readouterr().err
    assert "".join(line for line in shown.splitlines(keepends=True) if "intake" not in line) == lines
    assert "Traceback" not in shown
    assert not (tmp_path / "out").exists()


def test_debug_shows_the_traceback_wherever_it_is_given(pipeline, lab, tmp_path, capsys):
    pipeline.outcome = ZeroDivisionError("x")
    for argv in (["--debug", "grade", "s", "--rubric", lab], ["grade", "s", "--rubric", lab, "--debug"]):
        assert run(argv) == 3
        assert "Traceback" in capsys.readouterr().err


def test_nothing_is_run_where_the_output_cannot_be_written(pipeline, lab, tmp_path, capsys):
    (tmp_path / "out").write_text("")
    assert grade(lab, tmp_path) == 2
    assert pipeline.calls == []
    assert capsys.readouterr().err == (
        f"grader: error: cannot write {tmp_path}/out: Not a directory\n  hint: choose another folder with --out\n"
    )


def test_every_fault_of_the_rubric_has_its_line(pipeline, tmp_path, capsys):
    lab = str(spoiled(tmp_path, ("points: 40", "points: x"), ("points: 60", "points: y"), ('"1"', "1")))
    assert grade(lab, tmp_path) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"grader: error: {lab}:4: version: must be text, not 1: put it in quotes",
        f'grader: error: {lab}:15: criteria[0].points: must be a number, not "x"',
        f'grader: error: {lab}:21: criteria[1].points: must be a number, not "y"',
    ]
    assert pipeline.calls == []


def test_results_go_below_this_folder_by_default(pipeline, lab, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["grade", "s", "--rubric", lab, "--id", "eve", "--sandbox", "none"]) == 0
    assert "grader-results/ada/report.html" in capsys.readouterr().out
    options = pipeline.calls[0][3]
    assert (options.submission_id, options.sandbox, options.keep_hidden) == ("eve", "none", True)


def test_progress_is_plain_lines_on_stderr(pipeline, lab, tmp_path, capsys):
    grade(lab, tmp_path)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[1:3] for line in lines] == [["intake", "running"], ["intake", "done"]]
    assert "reading \\x1b[31m" in lines[0]


def package(folder, name: str = "lab1"):
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package format='2'><name>{name}</name></package>")
    return folder


def test_check_grades_the_package_around_it_and_keeps_nothing(pipeline, lab, tmp_path, capsys, monkeypatch):
    inside = package(tmp_path / "ws" / "lab1") / "src"
    inside.mkdir()
    monkeypatch.chdir(inside)
    assert run(["check", "--rubric", lab]) == 0
    source, _, folder, options = pipeline.calls[0]
    assert (tmp_path / "ws" / "lab1").samefile(source)
    assert options.keep_hidden is False
    assert not folder.exists()
    assert "Reports:" not in capsys.readouterr().out


def test_check_leaves_hidden_criteria_out_and_says_how_many(pipeline, tmp_path, capsys):
    lab = str(spoiled(tmp_path, ("    requires:", "    visibility: hidden\n    requires:")))
    package(tmp_path / "lab1")
    pipeline.outcome = passing("fail")
    assert run(["check", str(tmp_path / "lab1"), "--rubric", lab]) == 0
    out = capsys.readouterr().out
    assert "chatter-rate" not in out
    assert "1 visible check passed; 1 more runs at grading." in out
    assert "40 of 40 points" in out


@pytest.mark.parametrize("case", [("inconclusive", 0), ("fail", 1)])
def test_a_static_check_is_not_held_up_by_what_was_not_run(case, pipeline, lab, tmp_path, capsys):
    status, code = case
    package(tmp_path / "lab1")
    pipeline.outcome = passing(status)
    assert run(["check", str(tmp_path / "lab1"), "--rubric", lab, "--static"]) == code
    assert pipeline.calls[0][3].static_only is True
    assert "Nothing was run (--static)" in capsys.readouterr().out


def test_a_static_check_that_judged_nothing_is_no_pass(pipeline, lab, tmp_path):
    package(tmp_path / "lab1")
    pipeline.outcome = passing().model_copy(update={"criteria": (criterion_open(),)})
    assert run(["check", str(tmp_path / "lab1"), "--rubric", lab, "--static"]) == 3


def criterion_open():
    return passing("inconclusive").criteria[1]


def test_check_without_a_lab_for_the_package(pipeline, tmp_path, capsys):
    package(tmp_path / "mine", "my_robot")
    assert run(["check", str(tmp_path / "mine")]) == 2
    assert capsys.readouterr().err.startswith("grader: error: no lab is for the package my_robot\n  hint: ")
    assert run(["check", str(tmp_path / "nowhere")]) == 2
    assert f"{tmp_path}/nowhere does not exist" in capsys.readouterr().err


def test_record_makes_a_scenario_of_what_is_named(pipeline, tmp_path, capsys):
    package(tmp_path / "lab1")
    argv = ["record", str(tmp_path / "lab1"), "--script", "src/Numeric Talker.py", "--launch", "a.launch"]
    assert run([*argv, "--seconds", "3", "--out", str(tmp_path / "out")]) == 0
    rubric = pipeline.calls[0][1]
    starts = rubric.scenarios["record"].start
    assert [(s.name, s.script, s.launch) for s in starts] == [
        ("p1-numeric-talker", "src/Numeric Talker.py", None),
        ("p2-a", None, "a.launch"),
    ]
    assert rubric.scenarios["record"].until.limit_s == 3
    assert rubric.package == "lab1"
    assert capsys.readouterr().out == f"{tmp_path}/out/record.mcap\n"


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ([], "nothing to run"),
        (["--rubric", "x", "--script", "y"], "give --rubric, or --script and --launch, not both"),
        (
            ["--script", "y", "--seconds", "-1", "--package", "p"],
            "--seconds must be more than 0 and at most 3600, not -1",
        ),
        (
            ["--script", "y", "--seconds", "nan", "--package", "p"],
            "--seconds must be more than 0 and at most 3600, not nan",
        ),
        (["--script", "y"], "it is unclear which package to record"),
    ],
)
def test_record_says_what_it_lacks(more, message, pipeline, tmp_path, capsys):
    assert run(["record", "git@example.org:x.git", "--out", str(tmp_path), *more]) == 2
    assert capsys.readouterr().err.startswith(f"grader: error: {message}\n")
