"""Whatever ends a grading, the result says whose fault it is, and what was complete stays so. Nothing is run here."""

from __future__ import annotations

import errno
import json
import shutil
import subprocess
import zipfile
from functools import cache
from pathlib import Path

import pytest
from lxml import etree

from grader import faults, pipeline
from grader.cli.main import run
from grader.errors import (
    ArenaError,
    Busy,
    EvidenceError,
    GraderError,
    HostError,
    InternalError,
    OutputError,
    PackageNotFound,
    RosMissing,
    RubricError,
    SandboxMissing,
    SubmissionError,
    UsageError,
)
from grader.faults import fault_of
from grader.model.result import GradingResult, Silence
from grader.pipeline import GradeOptions, grade
from grader.results import Results
from grader.rubric.load import LoadedRubric, load_rubric

ROOT = Path(__file__).resolve().parent.parent
HOSTILE = ROOT / "tests" / "hostile"
LAB = str(HOSTILE / "after.yaml")
SOLUTION = HOSTILE / "victim"
REPORTS = {"result.json", "report.html", "report.md", "junit.xml"}


def graded(source: Path | str, out: Path, *, submission_id: str | None = "ada") -> GradingResult:
    options = GradeOptions(submission_id=submission_id, static_only=True)
    return grade(str(source), rubric(), out, options, Silence())


@cache
def rubric() -> LoadedRubric:
    return load_rubric(LAB)


def breaking(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Let the grading end with this error once the submission is open."""

    def raises(*_args: object, **_kwargs: object) -> None:
        raise error

    monkeypatch.setattr(pipeline, "record_and_judge", raises)


def result_in(folder: Path) -> GradingResult:
    """The result, read from each of its files."""
    suite = etree.parse(folder / "junit.xml").getroot()
    assert int(suite.get("failures", "-1")) == 0
    assert (folder / "report.md").read_text().strip()
    return GradingResult.model_validate_json((folder / "result.json").read_bytes())


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def chained(error: GraderError, cause: Exception) -> GraderError:
    error.__cause__ = cause
    return error


FULL = OSError(errno.ENOSPC, "No space left on device")
ERRORS = [
    (SubmissionError("it is empty", hint="h"), "submission", "submission"),
    (PackageNotFound("no lab1"), "package-not-found", "submission"),
    (ArenaError("the roscore did not start"), "arena", "machine"),
    (RosMissing("no ROS"), "ros-missing", "machine"),
    (SandboxMissing("none"), "sandbox-missing", "machine"),
    (HostError("late"), "host", "machine"),
    (OutputError("cannot write out: Permission denied"), "output", "machine"),
    (chained(OutputError("x.zip: the disk is full"), FULL), "host", "machine"),
    (chained(SubmissionError("x.zip cannot be read"), OSError(errno.EIO, "I/O")), "host", "machine"),
    (OSError(errno.ENOSPC, "No space left on device", "/tmp/grader-run-x/a"), "host", "machine"),
    (OSError(errno.EMFILE, "Too many open files"), "host", "machine"),
    (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "host", "machine"),
    (shutil.Error([("a", "b", "[Errno 28] No space left on device: 'b'")]), "host", "machine"),
    (MemoryError(), "host", "machine"),
    (subprocess.TimeoutExpired(["bwrap", "x"], 20), "host", "machine"),
    (ZeroDivisionError("division by zero"), "internal", "grader"),
    (FileNotFoundError(errno.ENOENT, "No such file", "x"), "internal", "grader"),
    (RecursionError("too deep"), "internal", "grader"),
    (EvidenceError("talker.mcap: damaged"), "internal", "grader"),
    (GraderError("what is this"), "internal", "grader"),
    (SystemExit(0), "internal", "grader"),
]
NAMES = [f"{type(error).__name__}-{kind}" for error, kind, _ in ERRORS]


@pytest.mark.full
@pytest.mark.parametrize(("error", "kind", "blame"), ERRORS, ids=NAMES)
def test_each_error_has_its_kind_and_leaves_a_result(tmp_path, monkeypatch, error, kind, blame) -> None:
    breaking(monkeypatch, error)
    with pytest.raises(GraderError) as caught:
        graded(SOLUTION, tmp_path)
    fault = caught.value
    assert (fault.kind, fault.blame, fault.exit_code) == (kind, blame, 3)
    assert {path.name for path in (tmp_path / "ada").iterdir()} == REPORTS
    result = result_in(tmp_path / "ada")
    assert (result.status, result.points, result.max_points) == ("error", 0, 100)
    assert result.error is not None
    assert (result.error.kind, result.error.message, result.error.hint) == (kind, fault.message, fault.hint)
    assert fault.message
    assert "Traceback" not in fault.message
    assert {(c.status, c.points) for c in result.criteria} == {("error", 0)}
    assert [c.id for c in result.criteria] == [c.id for c in rubric().rubric.criteria]
    blameless = all("not the submission's fault" in c.message for c in result.criteria)
    assert blameless == (blame != "submission")
    assert (result.submission.id, result.submission.package) == ("ada", "lab")


@pytest.mark.parametrize(
    "error",
    [
        UsageError("no such source"),
        RubricError(["r.yaml:1: wrong"]),
        Busy("another grader"),
        KeyboardInterrupt(),
    ],
)
def test_what_is_no_grading_leaves_no_result(tmp_path, monkeypatch, error) -> None:
    breaking(monkeypatch, error)
    with pytest.raises(type(error)):
        graded(SOLUTION, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.full
@pytest.mark.parametrize(("error", "kind", "blame"), ERRORS, ids=NAMES)
def test_only_the_submission_itself_replaces_a_complete_result(
    tmp_path, monkeypatch, error, kind, blame
) -> None:
    graded(SOLUTION, tmp_path)
    before = contents(tmp_path)
    assert {path.name for path in before} == {*REPORTS, "console.log", "package.mcap"}
    breaking(monkeypatch, error)
    with pytest.raises(GraderError) as caught:
        graded(SOLUTION, tmp_path)
    if blame == "submission":
        assert {path.name for path in (tmp_path / "ada").iterdir()} == REPORTS
        assert result_in(tmp_path / "ada").error.kind == kind
        assert caught.value.note == ""
    else:
        assert contents(tmp_path) == before
        assert caught.value.note == f"the result of an earlier run stays as it is: {tmp_path}/ada/result.json"


def test_an_error_takes_the_place_of_an_error_and_a_grading_that_of_both(tmp_path, monkeypatch) -> None:
    for error in (ArenaError("one"), ZeroDivisionError("two")):
        with monkeypatch.context() as patch:
            breaking(patch, error)
            with pytest.raises(GraderError):
                graded(SOLUTION, tmp_path)
    assert result_in(tmp_path / "ada").error.message == "internal error: ZeroDivisionError: two"
    assert graded(SOLUTION, tmp_path).status == "graded"
    assert result_in(tmp_path / "ada").error is None
    assert (tmp_path / "ada" / "evidence" / "package.mcap").is_file()


def sources(folder: Path) -> dict[str, tuple[Path, str]]:
    """Submissions that cannot be opened, with the kind of error."""
    (folder / "empty").mkdir()
    (folder / "other").mkdir()
    (folder / "other" / "package.xml").write_text("<package format='2'><name>other</name></package>")
    (folder / "broken.zip").write_bytes(b"PK\x03\x04 broken")
    (folder / "loop").symlink_to("loop")
    with zipfile.ZipFile(folder / "out.zip", "w") as archive:
        archive.writestr("../../x", "x")
    (folder / "evil \x1b[2Jname").mkdir()
    return {
        "empty": (folder / "empty", "submission"),
        "other": (folder / "other", "package-not-found"),
        "broken": (folder / "broken.zip", "submission"),
        "out": (folder / "out.zip", "submission"),
        "loop": (folder / "loop", "submission"),
        "evil-2Jname": (folder / "evil \x1b[2Jname", "submission"),
    }


@pytest.mark.parametrize("name", ["empty", "other", "broken", "out", "loop", "evil-2Jname"])
def test_a_submission_that_cannot_be_opened_has_a_result_under_its_name(tmp_path, name, capsys) -> None:
    (tmp_path / "in").mkdir()
    source, kind = sources(tmp_path / "in")[name]
    assert run(["grade", str(source), "--rubric", LAB, "--out", str(tmp_path / "out")]) == 3
    result = result_in(tmp_path / "out" / name)
    assert result.error.kind == kind
    assert result.submission.id == name
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("grader: error: ")]
    assert len(said) == 1
    assert "\x1b" not in said[0]
    (folder,) = (tmp_path / "out").iterdir()
    assert {path.name for path in folder.iterdir()} == REPORTS


def test_a_source_that_is_not_there_is_a_fault_of_the_command_line(tmp_path, capsys) -> None:
    assert (
        run(["grade", str(tmp_path / "no"), "--rubric", LAB, "--out", str(tmp_path / "out"), "--id", "x"])
        == 2
    )
    assert not (tmp_path / "out").exists()


def test_a_recording_that_cannot_be_read_is_the_students(tmp_path) -> None:
    (tmp_path / "mine.bag").write_bytes(b"#ROSBAG V2.0\n broken")
    with pytest.raises(SubmissionError):
        graded(tmp_path / "mine.bag", tmp_path / "out", submission_id=None)
    assert result_in(tmp_path / "out" / "mine").error.kind == "submission"


def test_a_full_disk_leaves_the_error_on_the_command_line(tmp_path, monkeypatch) -> None:
    def full(*_args: object, **_more: object) -> None:
        raise HostError("cannot write x: the disk is full")

    breaking(monkeypatch, HostError("cannot write y: the disk is full"))
    monkeypatch.setattr(faults, "write_reports", full)
    with pytest.raises(HostError, match="cannot write y") as caught:
        graded(SOLUTION, tmp_path / "out")
    assert caught.value.note == "no result could be written: cannot write x: the disk is full"
    assert not (tmp_path / "out").exists()


def test_a_submission_that_is_being_graded_is_left_alone(tmp_path, capsys) -> None:
    with Results(tmp_path / "ada"):
        argv = ["grade", str(SOLUTION), "--rubric", LAB, "--out", str(tmp_path), "--id", "ada"]
        assert run(argv) == 3
        assert {path.name for path in (tmp_path / "ada").iterdir()} == {".grader-new"}
    lines = capsys.readouterr().err.splitlines()
    assert f"grader: error: another grader works on {tmp_path}/ada just now" in lines


def test_the_command_line_says_what_became_of_the_older_result(tmp_path, monkeypatch, capsys) -> None:
    graded(SOLUTION, tmp_path)
    breaking(monkeypatch, ArenaError("the roscore died", hint="grade again"))
    argv = ["grade", str(SOLUTION), "--rubric", LAB, "--out", str(tmp_path), "--id", "ada"]
    assert run(argv) == 3
    assert capsys.readouterr().err.splitlines()[-3:] == [
        "grader: error: the roscore died",
        "  hint: grade again",
        f"  note: the result of an earlier run stays as it is: {tmp_path}/ada/result.json",
    ]


def test_no_password_of_an_address_is_in_the_result(tmp_path) -> None:
    source = "https://ada:secret@localhost:1/lab1.git"
    with pytest.raises(GraderError):
        graded(source, tmp_path, submission_id=None)
    assert b"secret" not in b"".join(contents(tmp_path).values())
    assert result_in(tmp_path / "lab1").submission.source == "https://localhost:1/lab1.git"


def test_regrading_recorded_evidence_still_works_beside_an_error(tmp_path, monkeypatch) -> None:
    graded(SOLUTION, tmp_path)
    criteria = json.loads((tmp_path / "ada" / "result.json").read_text())["criteria"]
    breaking(monkeypatch, ArenaError("the roscore died"))
    with pytest.raises(ArenaError):
        graded(SOLUTION, tmp_path)
    again = tmp_path / "again.json"
    assert run(["judge", str(tmp_path / "ada"), "--rubric", LAB, "--out", str(again)]) == 0
    assert json.loads(again.read_text()) == criteria


def test_check_keeps_to_itself(tmp_path, monkeypatch, capsys) -> None:
    shutil.copytree(SOLUTION, tmp_path / "lab1")
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", None)
    breaking(monkeypatch, ZeroDivisionError("x"))
    assert run(["check", str(tmp_path / "lab1"), "--rubric", LAB]) == 3
    assert "grader: error: internal error: ZeroDivisionError: x" in capsys.readouterr().err
    assert list((tmp_path / "tmp").iterdir()) == []


def test_fault_of_names_a_file_once() -> None:
    fault = fault_of(OSError(errno.ENOSPC, "No space left on device", "/x/y"))
    assert fault.message == "the disk is full: /x/y"
    assert isinstance(fault_of(InternalError("x")), InternalError)
