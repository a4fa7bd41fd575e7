"""`grader rubric test` with gradings that are made up."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest

from fixtures.make import declared
from grader.authoring.mutation import rubric_test
from grader.classes.batch.job import GradedSubmission
from grader.cli.main import run
from grader.rubric.load import load_rubric
from tests.authoring.mutation.samples import ROOT
from tests.report.hostile import result
from tests.support.a_class import criterion

LAB = "leeds-comp3631-lab1"
COUNT = sum(1 for mutant in declared(LAB).values() if mutant.expect)


class Judge:
    """Gives each mutant the statuses that its mutants file declares, but for what a test says."""

    def __init__(self, folder: Path) -> None:
        self.instead: dict[str, dict[str, str]] = {}
        self.folder = folder
        self.declared: dict[str, dict[str, str]] = {}
        self.rubric = load_rubric(LAB).rubric

    def grade_all(self, jobs, side_by_side, begun):
        assert side_by_side in {1, 4}
        for job in jobs:
            begun(job.name)
            lost = self.instead.get(job.name, self.declared.get(job.name, {}))
            mutant = declared(LAB).get(job.name)
            criteria = self.criteria(lost, mutant.says if mutant else {})
            points = (mutant.points if mutant else None) or 100
            yield GradedSubmission(name=job.name, result=result(criteria=criteria, points=points))

    def criteria(self, lost: dict[str, str], says: dict[str, tuple[str, ...]]):
        return tuple(
            criterion(
                c.id,
                lost.get(c.id, "pass"),
                0,
                c.points,
                message=" ".join((f"about {c.id} \x1b[2J", *says.get(c.id, ()))),
            )
            for c in self.rubric.criteria
        )


@pytest.fixture
def judge(tmp_path, monkeypatch):
    made = Judge(tmp_path)
    monkeypatch.setattr(rubric_test, "grade_all", made.grade_all)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    original = rubric_test.run_test

    def noting(plan, progress):
        made.declared = {m.name: dict(m.costs or {}) for m in plan.mutants}
        return original(plan, progress)

    monkeypatch.setattr("grader.cli.labs.run_test", noting)
    return made


def left(judge: Judge) -> list[Path]:
    return list((judge.folder / "tmp").iterdir())


def test_all_killed(judge, capsys):
    assert run(["rubric", "test", LAB]) == 0
    out, err = capsys.readouterr()
    assert f"{LAB}: {COUNT} of {COUNT} mutants killed" in out
    assert "✓ killed" in out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "talker-not-executable  done" in err
    assert left(judge) == []


def test_a_survivor_is_shown_with_its_diff_and_its_evidence(judge, capsys):
    judge.instead = {"talker-not-executable": {}}
    assert run(["rubric", "test", LAB, "--only", "talker-not-executable", "talker-crlf"]) == 1
    out, _ = capsys.readouterr()
    text = " ".join(out.split())
    assert "survived: talker-not-executable" in text
    assert "numeric_talker.py was never made executable." in text
    assert "should cost, and does not: talker-executable" in text
    assert "old mode 100755" in text
    assert "1 of 2 mutants killed" in text
    (folder,) = left(judge)
    assert [path.name for path in folder.iterdir()] == ["talker-not-executable"]


def test_what_costs_too_much_is_shown_with_the_reports_words(judge, capsys):
    judge.instead = {"counter-dies-at-128": {"counter-wrap": "blocked", "launch": "fail"}}
    assert run(["rubric", "test", LAB, "--only", "counter-dies-at-128"]) == 1
    out, _ = capsys.readouterr()
    text = " ".join(out.split())
    assert "should not cost, and does: launch" in text
    assert "has another status: counter-wrap is blocked, not fail" in text
    assert "launch fail: about launch \\x1b[2J" in text
    assert "- if counter > 127:" in text


def test_json(judge, capsys):
    judge.instead = {"cmake-no-catkin-package": {"cmake": "fail", "build": "fail"}}
    assert run(["rubric", "test", LAB, "--json", "--out", str(judge.folder / "kept")]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "grader.rubric-test/1"
    assert (data["passed"], data["uncosted"], len(data["mutants"])) == (False, [], COUNT)
    (differs,) = [m for m in data["mutants"] if m["state"] != "killed"]
    assert (differs["state"], differs["surplus"], differs["expected"]) == (
        "differs",
        ["build"],
        {"cmake": "fail"},
    )
    assert differs["evidence"] == str(judge.folder / "kept" / "cmake-no-catkin-package")
    assert (judge.folder / "kept" / "talker-crlf" / "mutant.diff").is_file()


def test_some_mutants_only(judge, capsys):
    assert run(["rubric", "test", LAB, "--only", "talker-crlf", "reset-*", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {m["name"] for m in data["mutants"]} == {"talker-crlf", "counter-resets-to-1"}
    assert data["uncosted"] is None


def test_a_criterion_that_nothing_costs_is_named(judge, capsys):
    judge.instead = {
        name: {}
        for name, mutant in declared(LAB).items()
        if mutant.expect.get("numeric-rate") in {"fail", "partial"}
    }
    assert run(["rubric", "test", LAB]) == 1
    assert "No mutant costs numeric-rate" in " ".join(capsys.readouterr().out.split())


def test_a_criterion_taken_out_fails_the_test(judge, capsys, tmp_path):
    text = (ROOT / "rubrics" / f"{LAB}.yaml").read_text(encoding="utf-8")
    start, end = text.index("  - id: counter-wrap"), text.index("  - id: listener-chatter")
    path = tmp_path / "mine.yaml"
    path.write_text(text[:start] + text[end:].replace("points: 5", "points: 20", 1), encoding="utf-8")
    judge.rubric = load_rubric(str(path)).rubric
    judge.instead = {}
    assert run(["rubric", "test", str(path), "--only", "reset-*"]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "should cost, and does not: counter-wrap (the rubric has no such criterion)" in text
    assert "0 of 1 mutants killed" in text


def test_the_reference_solution_has_to_get_everything(judge, capsys):
    judge.instead = {"reference": {"launch": "fail", "talker-name": "fail"}}
    assert run(["rubric", "test", LAB, "--only", "talker-crlf"]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "The reference solution does not get everything" in text
    assert "launch fail: about launch" in text
    assert "talker-name" not in text
    assert [p.name for p in left(judge)[0].iterdir()] == ["reference"]


def test_without_a_mutants_file_every_operator_is_tried_and_written(judge, capsys, tmp_path):
    written = tmp_path / "mutants.yaml"
    assert run(["rubric", "test", LAB, "--write", str(written), "--only", "crlf", "burst", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert {m["state"] for m in data["mutants"]} == {"survived"}
    assert {m["expected"] for m in data["mutants"]} == {None}
    assert written.read_text().count("# costs nothing") == len(data["mutants"]) == 6
    assert "at: {}" not in written.read_text()


def test_a_solution_of_ones_own_may_lack_places(judge, capsys, tmp_path):
    package = tmp_path / "mine" / "lab1"
    package.mkdir(parents=True)
    for name in ("package.xml", "CMakeLists.txt"):
        (package / name).write_bytes((ROOT / "reference_solutions" / LAB / "lab1" / name).read_bytes())
    assert run(["rubric", "test", LAB, "--solution", str(tmp_path / "mine"), "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert len(data["mutants"]) == 17
    assert len(data["unfit"]) == COUNT - 17
    assert "fits nowhere in this package" in " ".join(data["unfit"])
    assert "listener-numeric" in data["uncosted"]


def test_the_folder_of_the_package_alone_is_a_solution_too(judge, capsys):
    package = ROOT / "reference_solutions" / LAB / "lab1"
    assert run(["rubric", "test", LAB, "--solution", str(package)]) == 0
    assert f"{COUNT} of {COUNT} mutants killed" in capsys.readouterr().out


def test_where_no_mutant_fits_nothing_is_graded(judge, capsys, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "package.xml").write_text("<package><name>lab1</name></package>")
    (tmp_path / "mutants").mkdir()
    rubric = tmp_path / f"{LAB}.yaml"
    rubric.write_bytes((ROOT / "rubrics" / f"{LAB}.yaml").read_bytes())
    mutant = "  a:\n    expect: {build: fail}\n    edits: [{delete: {file: lab1/no.py}}]\n"
    head = f"schema: grader.mutants/1\nrubric: {LAB}\nmutants:\n"
    (tmp_path / "mutants" / f"{LAB}.yaml").write_text(head + mutant)
    assert run(["rubric", "test", str(rubric), "--solution", str(tmp_path / "mine")]) == 2
    assert "mutants.a: delete: there is no file 'lab1/no.py'" in capsys.readouterr().err
    assert left(judge) == []


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["no-such-lab"], 'there is no rubric "no-such-lab"'),
        ([LAB, "--only", "talker-clrf"], 'there is no mutant "talker-clrf" (did you mean "talker-crlf"?)'),
        ([LAB, "--jobs", "0"], "argument --jobs: '0' is not a number from 1 to 64"),
        ([LAB, "--jobs", "many"], "argument --jobs: 'many' is not a number from 1 to 64"),
        ([LAB, "--solution", "/nowhere"], "/nowhere is not a folder"),
        ([LAB, "--solution", str(ROOT / "rubrics")], "there is no package lab1 in"),
        ([LAB, "--out", "/proc/x"], "cannot write /proc/x"),
        ([LAB, "--write", "/proc/x/m.yaml"], "cannot write /proc/x"),
        ([], "the following arguments are required: LAB|FILE"),
    ],
)
def test_a_wrong_command_line(argv, message, judge, capsys):
    assert run(["rubric", "test", *argv]) == 2
    assert capsys.readouterr().err.startswith(f"grader: error: {message}")
    assert left(judge) == []


def test_a_mutants_file_that_does_not_fit_its_solution_is_an_error(judge, capsys, tmp_path):
    rubrics = tmp_path / "course" / "rubrics"
    (rubrics / "mutants").mkdir(parents=True)
    for name, folder in ((f"{LAB}.yaml", "rubrics"), (f"mutants/{LAB}.yaml", "fixtures")):
        (rubrics / name).write_bytes((ROOT / folder / f"{LAB}.yaml").read_bytes())
    lab1 = tmp_path / "course" / "reference_solutions" / LAB / "lab1"
    lab1.mkdir(parents=True)
    (lab1 / "package.xml").write_text("<package><name>lab1</name></package>")
    assert run(["rubric", "test", str(rubrics / f"{LAB}.yaml")]) == 2
    err = capsys.readouterr().err
    assert ": mutants.manifest-malformed: manifest-malformed fits nowhere in this package" in err
    assert err.count(": mutants.") == COUNT - 4  # a CATKIN_IGNORE and other new files go into any package
