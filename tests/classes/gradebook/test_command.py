"""`grader gradebook` on a batch's folder, and the page that explains it."""

from __future__ import annotations

import re
import shlex
from datetime import datetime, timezone
from pathlib import Path

import pytest

from grader.classes.batch.folder import RUN, open_batch, write_run
from grader.classes.gradebook import FORMS, GradebookRow
from grader.classes.gradebook.table import header
from grader.cli.main import build_parser, run
from grader.model.batch import BatchRun, RosterFault
from grader.report.files import result_bytes
from grader.untrusted_text import json_text
from tests.classes.gradebook.made import BOOK, row

DOCS = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "gradebooks.md"
ROWS = [row("ada", 87.5, name="Ada \x1b[31m", Email="ada@x.edu"), row("bob", error="no\npackage")]


@pytest.fixture
def batch(tmp_path: Path) -> Path:
    folder = tmp_path / "results"
    for one in ROWS:
        (folder / one.entry.id).mkdir(parents=True)
        (folder / one.entry.id / "result.json").write_bytes(result_bytes(one.result))
    write_run(folder, batch_run(ROWS))
    return folder


def batch_run(rows: list[GradebookRow]) -> BatchRun:
    return BatchRun(
        state="complete",
        grader="1",
        rubric=rows[0].result.rubric,
        rubric_source="lab1",
        title=BOOK.title,
        max_points=BOOK.max_points,
        criteria=tuple({"id": c.id, "title": c.title, "max_points": c.max_points} for c in BOOK.criteria),
        roster="roster.csv",
        started_at=datetime(2026, 1, 1, tzinfo=timezone.utc),
        columns=BOOK.columns,
        entries=tuple(one.entry for one in rows),
        faults=(RosterFault(where="roster.csv:4", id="cem", text="no source"),),
    )


@pytest.mark.parametrize("count", [0, 1, 3])
def test_entries_are_written_one_by_one_as_all_at_once(tmp_path: Path, count: int) -> None:
    odd = ROWS[0].entry.model_copy(update={"extra": {"a\n[]": "\u2028\udce9 ##[error]", "entries": "[]"}})
    run_ = batch_run(ROWS).model_copy(update={"entries": (odd,) * count})
    write_run(tmp_path, run_)
    whole = json_text(run_.model_dump(mode="json", by_alias=True))
    assert (tmp_path / RUN).read_bytes() == whole.encode()
    assert len(open_batch(tmp_path).run.entries) == count


@pytest.mark.parametrize("form", FORMS)
def test_into_the_folder(batch: Path, form: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = set(batch.iterdir())
    assert run(["gradebook", str(batch), "--form", form]) == 0
    (new,) = set(batch.iterdir()) - before
    out, said = capsys.readouterr()
    assert out == f"{new}\n"
    assert ("bob: no grade (error: no\\npackage)" in said) == (form in ("canvas", "moodle", "blackboard"))


def test_to_stdout(batch: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    before = set(batch.iterdir())
    assert run(["gradebook", str(batch), "--form", "csv", "--out", "-"]) == 0
    out, said = capsysbinary.readouterr()
    assert [line.split(b",")[0] for line in out.splitlines()] == [b"id", b"ada", b"bob", b"cem"]
    assert b"\x1b" not in out
    assert said.startswith(b"grader: csv: these are drafts: nothing of this class is published yet")
    assert said.count(b"\n") == 1
    assert set(batch.iterdir()) == before


def test_a_template_is_filled_in_beside_it(batch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    template = batch.parent / "gc.xls"
    template.write_text("Username\tLab 1 [Total Pts: 100 Score] |1\nada\t\n")
    command = ["gradebook", str(batch), "--form", "blackboard", "--template", str(template)]
    assert run(command) == 0
    assert (batch / "gradebook-blackboard.xls").read_text().splitlines()[1] == "ada\t87.5"
    assert run([*command, "--out", str(template)]) == 2
    assert "is the template itself" in capsys.readouterr().err
    assert template.read_text().endswith("ada\t\n")


def test_where_no_batch_has_been(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["gradebook", str(tmp_path), "--form", "csv"]) == 2
    assert run(["gradebook", str(tmp_path), "--form", "ods"]) == 2
    assert capsys.readouterr().err.count("hint:") == 2


def test_every_command_of_the_page_can_be_said() -> None:
    commands = re.findall(r"grader (gradebook [^`\n]+)", DOCS.read_text(encoding="utf-8"))
    forms = {vars(build_parser().parse_args(shlex.split(command)))["form"] for command in commands}
    assert forms == {"xlsx", "canvas", "moodle", "blackboard"}


def test_every_form_and_column_is_on_the_page() -> None:
    text = DOCS.read_text(encoding="utf-8")
    own = {*header(BOOK)} - {c.id for c in BOOK.criteria} - {*BOOK.columns} - {"criterion name"}
    assert all(f"`{name}`" in text for name in (*FORMS, *own))
