"""What a newer grader wrote is named as such on one line and never written over; its further keys are borne."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer

from grader import EvidenceError, RubricError, judge, load_result, load_rubric
from grader.authoring.mutation.faulty_packages import load_mutants
from grader.cli.main import run
from grader.evidence.events import TOPICS, ConsoleLine
from grader.evidence.reader import load_run
from grader.evidence.writer import EvidenceWriter
from grader.model import version
from grader.model.result import FileCitation
from grader.report.files import result_text
from tests.report.file_formats.kept import FOLDER, ROOT

COURSE = FOLDER
LAB = "leeds-comp3631-lab1"


@pytest.fixture
def course(tmp_path: Path, monkeypatch) -> Path:
    shutil.copytree(COURSE / "class", tmp_path / "class")
    shutil.copy(COURSE / "class.yaml", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "class"


def edit(path: Path, **keys: Any) -> bytes:
    path.write_text(json.dumps(json.loads(path.read_bytes()) | keys))
    return path.read_bytes()


def told(capsys, kind: str) -> str:
    """What stderr says: one line with the format, one with what to do."""
    said = capsys.readouterr().err.strip()
    assert f"written by a newer grader (grader.{kind}/2); this one reads up to 1" in said
    assert "update the grader" in said
    assert "Traceback" not in said
    assert len(said.splitlines()) == 2, said
    return said


COMMANDS = [
    ["regrade", "class", "--rubric", "class.yaml"],
    ["report", "class", "--rubric", "class.yaml"],
    ["gradebook", "class", "--form", "csv", "--out", "grades.csv"],
    ["batch", "roster.csv", "--rubric", "class.yaml", "--out", "class"],
]


@pytest.mark.parametrize("command", COMMANDS, ids=[command[0] for command in COMMANDS])
def test_a_class_with_one_newer_result(command: list[str], course: Path, capsys) -> None:
    """Nobody else's result is touched, either, where the command writes results."""
    names = ("ada", "bob", "cyd", "dan")
    (course.parent / "roster.csv").write_text(
        "id,source\n" + "".join(f"{name},class/bob\n" for name in names)
    )
    newer = edit(course / "bob" / "result.json", schema="grader.result/2", points="many")
    others = {path: path.read_bytes() for path in course.rglob("result.json")}
    run_json = (course / "run.json").read_bytes()
    assert run(command) == 3
    assert "bob" in told(capsys, "result")
    assert {path: path.read_bytes() for path in others} == others
    assert (course / "bob" / "result.json").read_bytes() == newer
    assert (course / "run.json").read_bytes() == run_json
    assert not (course.parent / "grades.csv").exists()


@pytest.mark.parametrize("command", COMMANDS[:3], ids=[command[0] for command in COMMANDS[:3]])
def test_a_class_that_a_newer_grader_graded(command: list[str], course: Path, capsys) -> None:
    before = edit(course / "run.json", schema="grader.run/2", entries={})
    assert run(command) == 2
    assert "run.json" in told(capsys, "run")
    assert (course / "run.json").read_bytes() == before


def test_newer_overrides(course: Path, capsys) -> None:
    (course / "overrides.yaml").write_text("schema: grader.overrides/2\nbob: [something, else]\n")
    before = (course / "bob" / "result.json").read_bytes()
    assert run(["regrade", "class", "--rubric", "class.yaml"]) == 2
    assert "overrides.yaml:1: schema: " in told(capsys, "overrides")
    assert (course / "bob" / "result.json").read_bytes() == before


def test_a_newer_rubric(tmp_path: Path, capsys) -> None:
    """What else is strange in it follows from that, and is not told."""
    rubric = tmp_path / "lab.yaml"
    rubric.write_text("id: lab\nschema: grader.rubric/2\nstages: [1, 2]\n")
    assert run(["rubric", "validate", str(rubric)]) == 2
    said = capsys.readouterr()
    assert f"{rubric}:2: schema: written by a newer grader (grader.rubric/2)" in said.out + said.err
    assert "stages" not in said.out + said.err
    assert run(["grade", str(tmp_path), "--rubric", str(rubric), "--out", str(tmp_path / "out")]) == 2
    assert "lab.yaml:2" in told(capsys, "rubric")


def test_newer_mutants(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("schema: grader.mutants/2\n")
    with pytest.raises(
        RubricError, match=r"lab.yaml:1: schema: written by a newer grader \(grader.mutants/2\)"
    ):
        load_mutants(tmp_path / "lab.yaml", load_rubric(LAB).rubric)


def test_newer_evidence(tmp_path: Path, capsys) -> None:
    path = of_format(tmp_path, "2")
    assert run(["judge", str(path), "--rubric", LAB]) == 3
    assert path.name in told(capsys, "evidence")
    with pytest.raises(EvidenceError, match=r"newer grader \(grader.evidence/2\)"):
        judge(path, LAB)


@pytest.mark.parametrize("said", ["0", "1.1", "", "2\n3"])
def test_evidence_of_no_version(said: str, tmp_path: Path) -> None:
    with pytest.raises(EvidenceError, match="which no grader wrote"):
        load_run(of_format(tmp_path, said))


def of_format(folder: Path, said: str) -> Path:
    """An evidence file whose metadata give that version."""
    path = folder / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1")
        about = {"format": said, "scenario": "run", "clock": "real", "warp": "1"}
        writer.add_metadata("grader.evidence", about)
        writer.finish()
    return path


@pytest.mark.parametrize("said", ["grader.result/2", "grader.result/999999999"], ids=["2", "many"])
def test_a_newer_result(said: str, tmp_path: Path) -> None:
    shutil.copy(COURSE / "correct" / "result.json", tmp_path)
    edit(tmp_path / "result.json", schema=said, criteria=None)
    with pytest.raises(EvidenceError, match="written by a newer grader") as caught:
        load_result(tmp_path)
    assert said in caught.value.message


@pytest.mark.parametrize(
    "said",
    [None, 2, "grader.result/", "grader.result/0", "grader.run/2", "grader.result/2.0"],
    ids=["none", "number", "empty", "zero", "other", "fraction"],
)  # fmt: skip
def test_a_file_that_is_no_result(said: object, tmp_path: Path) -> None:
    shutil.copy(COURSE / "correct" / "result.json", tmp_path)
    edit(tmp_path / "result.json", schema=said)
    with pytest.raises(EvidenceError, match="not what a grader writes"):
        load_result(tmp_path)


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b'{"schema": NaN}'])
def test_damage_is_no_newer_version(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_bytes(data)
    with pytest.raises(EvidenceError, match="not what a grader writes"):
        load_result(tmp_path)


def test_further_keys_of_a_result_are_passed_over(tmp_path: Path) -> None:
    shutil.copy(COURSE / "correct" / "result.json", tmp_path)
    data = json.loads((tmp_path / "result.json").read_bytes())
    known = load_result(tmp_path)
    data["later"] = {"deep": [1]}
    for criterion in data["criteria"]:
        criterion["colour"] = "green"
        criterion["citations"] = [{"file": "a.py", "line": 3, "page": 7}]
    data["timing"]["queue_s"] = 1.5
    (tmp_path / "result.json").write_text(json.dumps(data))
    read = load_result(tmp_path)
    assert {c.citations for c in read.criteria} == {(FileCitation(file="a.py", line=3),)}
    assert [(c.status, c.points) for c in read.criteria] == [(c.status, c.points) for c in known.criteria]
    assert (read.points, read.timing, read.status) == (known.points, known.timing, known.status)
    assert "later" not in result_text(read)


def test_further_keys_and_channels_of_evidence_are_passed_over(tmp_path: Path, monkeypatch) -> None:
    class LaterLine(ConsoleLine):
        colour: str = "green"

    monkeypatch.setitem(TOPICS, "/grader/console", LaterLine)
    monkeypatch.setitem(TOPICS, "/grader/weather", LaterLine)
    path = tmp_path / "run.mcap"
    line = LaterLine(process="talker", stream="stdout", line="hello")
    with EvidenceWriter(path, scenario="run", clock="real", warp=1.0, metadata={"sky": "blue"}) as evidence:
        evidence.event("/grader/console", 5, line)
        evidence.event("/grader/weather", 6, line)
    monkeypatch.undo()
    found = load_run(path)
    assert found.console == ((5, ConsoleLine(process="talker", stream="stdout", line="hello")),)
    assert found.metadata["sky"] == "blue"


@pytest.mark.full
def test_further_keys_of_a_class_are_passed_over(course: Path) -> None:
    edit(course / "run.json", weather="fine")
    assert run(["regrade", "class", "--rubric", "class.yaml"]) == 3  # one submission could not be graded
    assert "weather" not in (course / "run.json").read_text()


@pytest.mark.parametrize("name", ["overrides", "rubric"])
def test_further_keys_of_peoples_files_are_named(name: str, course: Path, capsys) -> None:
    if name == "overrides":
        (course / "overrides.yaml").write_text("bob:\n  build: {points: 1, weight: 2}\n")
    else:
        with (course.parent / "class.yaml").open("a") as file:
            file.write("\nweight: 2\n")
    assert run(["regrade", "class", "--rubric", "class.yaml"]) == 2
    said = capsys.readouterr().err
    assert "weight: is not known here" in said
    assert ".yaml:" in said


@pytest.mark.full
def test_files_without_a_schema_are_version_1(course: Path, capsys) -> None:
    rubric, overrides = course.parent / "class.yaml", course / "overrides.yaml"
    for path in (rubric, overrides):
        lines = path.read_text().splitlines(keepends=True)
        assert lines[0].startswith("schema: ")
        path.write_text("".join(lines[1:]))
    assert load_rubric(rubric).rubric.schema_ == str(version.RUBRIC)
    assert run(["regrade", "class", "--rubric", "class.yaml"]) == 3
    assert json.loads((course / "bob" / "result.json").read_bytes())["points"] == 65.7


@pytest.mark.parametrize("said", ["2", "grader.rubric/one", "grader.overrides/1", "", "[1]", "null"])
def test_a_schema_of_nothing_is_a_fault(said: str, tmp_path: Path, capsys) -> None:
    text = (ROOT / "rubrics" / f"{LAB}.yaml").read_text()
    (tmp_path / "lab.yaml").write_text(text.replace("schema: grader.rubric/1", f"schema: {said}", 1))
    assert run(["rubric", "validate", str(tmp_path / "lab.yaml")]) == 2
    out = capsys.readouterr()
    assert 'lab.yaml:1: schema: must be "grader.rubric/1"' in out.out + out.err
