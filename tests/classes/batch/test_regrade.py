"""`grader regrade`: a class judged again by another rubric, from what was recorded."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from grader.classes.batch.folder import open_batch
from grader.classes.batch.regrade import Regraded
from grader.cli.main import run
from grader.rubric.load import load_rubric
from grader.workers import run_each
from tests.classes.batch.a_class import (
    CORRECT,
    LAB,
    RUBRIC,
    WRONG_NAME,
    batch,
    handed_in,
    kinds,
    lines_of,
    recorded,
    roster_of,
    run_of,
)
from tests.classes.batch.repositories import commit, repository


def changed(path: Path, *changes: tuple[str, str]) -> Path:
    """A copy of the lab's rubric with these texts replaced."""
    text = LAB.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.full
def test_the_same_rubric_changes_nothing(tmp_path, capsys) -> None:
    out = recorded(tmp_path / "out", kinds())
    before = {name: (out / name / "result.json").read_bytes() for name in kinds()}
    assert run(["regrade", str(out)]) == 0
    assert {name: (out / name / "result.json").read_bytes() for name in kinds()} == before
    assert rows_of(out / "changes.csv") == []
    assert "2 of 2 judged again, 0 changed" in capsys.readouterr().out


@pytest.mark.full
def test_one_that_was_stopped_goes_on_and_says_what_all_of_it_changed(tmp_path, capsys, monkeypatch) -> None:
    out = recorded(tmp_path / "out", kinds())
    rubric = changed(tmp_path / "new.yaml", ("rate_hz: 10", "rate_hz: 20"))
    with monkeypatch.context() as patch:
        patch.setattr("grader.classes.batch.regrade.run_each", _interrupted)
        assert run(["regrade", str(out), "--rubric", str(rubric)]) == 130
    assert "1 of 2 judged again; the same command continues" in capsys.readouterr().err
    assert run(["regrade", str(out), "--rubric", str(rubric)]) == 1
    assert "fewer points for 2: ada 100 -> 85, bob 100 -> 85\n" in capsys.readouterr().out
    assert {row["id"] for row in rows_of(out / "changes.csv")} == {"ada", "bob"}
    assert run(["regrade", str(out), "--rubric", str(rubric)]) == 1
    assert rows_of(out / "changes.csv") == []


def _interrupted(*given: Any, **more: Any) -> Iterator[Regraded]:
    """As Ctrl-C does it when one submission is judged again."""
    yield next(run_each(*given, **more))
    raise KeyboardInterrupt


@pytest.mark.full
def test_a_result_that_was_just_being_replaced_is_put_in_place_first(tmp_path, capsys) -> None:
    out = recorded(tmp_path / "out", kinds())
    ready = out / "ada" / ".grader-ready"
    ready.mkdir()
    (out / "ada" / "result.json").rename(ready / "result.json")
    names = [path.name for path in (out / "ada").iterdir() if path != ready]
    (ready / "names.json").write_text(json.dumps(["result.json", *names]))
    assert run(["regrade", str(out)]) == 0
    assert "2 of 2 judged again, 0 changed" in capsys.readouterr().out
    assert not ready.exists()


@pytest.mark.full
def test_points_that_a_new_rubric_gives(tmp_path, capsys) -> None:
    out = recorded(tmp_path / "out", kinds())
    rubric = changed(tmp_path / "new.yaml", ("rate_hz: 10", "rate_hz: 20"))
    assert run(["regrade", str(out), "--rubric", str(rubric)]) == 1
    shown = capsys.readouterr().out
    assert "chatter-rate: pass 10 -> fail 0, 2 submissions: ada, bob\n" in shown
    assert "\nfewer points for 2: ada 100 -> 85, bob 100 -> 85\n" in shown
    assert "2 of 2 judged again, 2 changed" in shown
    rows = rows_of(out / "changes.csv")
    assert {row["id"] for row in rows} == {"ada", "bob"}
    assert all(row["why"] for row in rows)
    for name in kinds():
        result = json.loads((out / name / "result.json").read_bytes())
        assert result["rubric"]["digest"] == load_rubric(str(rubric)).digest
        assert result["points"] < 100
        assert (out / name / "console.log").read_text() == "kept"
        assert list((out / name / "evidence").iterdir())
        assert "rate" in (out / name / "report.md").read_text()
    assert [line["points"] for line in lines_of(out)] == [
        float(row["points"]) for row in rows_of(out / "gradebook.csv")
    ]
    assert run_of(out)["rubric"]["digest"] == load_rubric(str(rubric)).digest
    assert open_batch(out).run.rubric_source == str(rubric)


@pytest.mark.full
def test_a_scenario_that_was_not_recorded(tmp_path, capsys) -> None:
    out = recorded(tmp_path / "out", kinds())
    (out / "ada" / "evidence" / "listener.mcap").unlink()
    assert run(["regrade", str(out)]) == 4
    shown = capsys.readouterr().out
    assert "1 must run again, since there is no recording of listener: ada" in shown
    assert "--run-missing" in shown
    statuses = {line["submission"]["id"]: line["status"] for line in lines_of(out)}
    assert statuses == {"ada": "inconclusive", "bob": "graded"}


@pytest.mark.full
def test_a_scenario_that_runs_something_else_now(tmp_path, capsys) -> None:
    """Evidence that does not say by which definition it was recorded counts; evidence of another one does not."""
    out = recorded(tmp_path / "out", {"ada": "correct"})
    rubric = changed(tmp_path / "new.yaml", ("window_s: 6", "window_s: 7"))
    assert run(["regrade", str(out), "--rubric", str(rubric)]) == 0
    spoil(out / "ada" / "evidence" / "talker.mcap")
    assert run(["regrade", str(out), "--rubric", str(rubric)]) == 4
    assert "no recording of talker: ada" in capsys.readouterr().out


def spoil(path: Path) -> None:
    """Write the file anew, as recorded by another definition."""
    copy = path.with_suffix(".copy")
    with path.open("rb") as source, copy.open("wb") as target:
        reader = make_reader(source)
        summary = reader.get_summary()
        assert summary is not None
        writer = Writer(target, compression=CompressionType.NONE)
        header = reader.get_header()
        writer.start(header.profile, header.library)
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, {**metadata.metadata, "scenario.digest": "of another one"})
        schemas = {s.id: writer.register_schema(s.name, s.encoding, s.data) for s in summary.schemas.values()}
        channels = {
            c.id: writer.register_channel(
                c.topic, c.message_encoding, schemas.get(c.schema_id, 0), dict(c.metadata)
            )
            for c in summary.channels.values()
        }
        for _, channel, message in reader.iter_messages(log_time_order=False):
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()
    copy.replace(path)


@pytest.mark.full
def test_what_people_decided_stays_and_is_marked(tmp_path, capsys) -> None:
    out = recorded(tmp_path / "out", kinds())
    (out / "overrides.yaml").write_text(
        "ada:\n  chatter-rate: {points: 4, comment: seen in the lab, author: A. Miller, date: 2026-11-02}\n"
    )
    run(["regrade", str(out)])
    points = {line["submission"]["id"]: line["points"] for line in lines_of(out)}
    assert points == {"ada": 94, "bob": 100}
    rubric = changed(tmp_path / "new.yaml", ("rate_hz: 10", "rate_hz: 20"))
    capsys.readouterr()
    run(["regrade", str(out), "--rubric", str(rubric)])
    result = json.loads((out / "ada" / "result.json").read_bytes())
    (override,) = result["overrides"]
    assert (override["points"], override["changed"]) == (4, True)
    assert override["was"]["status"] == "pass"
    assert override["automatic"]["status"] == "fail"
    assert {c["id"]: c["points"] for c in result["criteria"]}["chatter-rate"] == 4


@pytest.mark.full
def test_a_deadline_that_comes_later(tmp_path) -> None:
    """When it was handed in is in the result, so a late policy of a new rubric can be applied to it."""
    handed_in(tmp_path / "in", ["ada"])
    roster = tmp_path / "in" / "roster.csv"
    roster.write_text("id,source,submitted_at\nada,ada,2026-10-31T12:00:00+00:00\n")
    out = tmp_path / "out"
    assert batch(roster, out) == 0
    rubric = tmp_path / "late.yaml"
    rubric.write_text(
        RUBRIC.read_text().replace(
            "scenarios:", "deadline: 2026-10-30T12:00:00+00:00\nlate: {lost: 10, per: day}\nscenarios:"
        )
    )
    assert run(["regrade", str(out), "--rubric", str(rubric)]) in (0, 1)
    (line,) = lines_of(out)
    assert line["points"] == 90
    assert line["late"]["points_before"] == 100


@pytest.mark.full
def test_what_could_not_be_graded_stays_as_it_was(tmp_path, capsys) -> None:
    handed_in(tmp_path / "in", ["ada"])
    (tmp_path / "in" / "bob").mkdir()
    (tmp_path / "in" / "bob" / "notes.txt").write_text("nothing yet")
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    capsys.readouterr()
    assert run(["regrade", str(out)]) == 3
    shown = capsys.readouterr().out
    assert "bob: unchanged: there is no package lab1" in shown
    assert "1 of 2 judged again, 0 changed" in shown
    assert [line["status"] for line in lines_of(out)] == ["graded", "error"]


def test_where_no_batch_has_been(tmp_path, capsys) -> None:
    assert run(["regrade", str(tmp_path)]) == 2
    assert "no run.json" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"schema": "grader.run/9"}', "\x00"])
def test_a_run_that_cannot_be_read(tmp_path, capsys, text: str) -> None:
    (tmp_path / "run.json").write_text(text)
    assert run(["regrade", str(tmp_path)]) == 2
    assert "run.json" in capsys.readouterr().err


TALKER = """\
schema: grader.rubric/1
id: runs
title: Runs
version: "1"
package: lab1
scenarios:
  first:
    title: The talker
    start:
      - {name: talker, script: src/numeric_talker.py}
    until: {nodes: 1, alive_s: 2}
"""
LISTENER = """\
  second:
    title: The listener
    start:
      - {name: listener, script: src/numeric_listener.py}
    until: {nodes: 1, alive_s: 2}
"""
CRITERION = """\
  - id: {name}-node
    title: It runs
    points: {points}
    check: node-lives
    with: {{process: {name}, min_s: 1}}
    scenario: {scenario}
"""


@pytest.mark.full
@pytest.mark.ros
def test_what_was_not_recorded_is_run_of_the_same_commit(tmp_path, capsys) -> None:
    talker = CRITERION.format(name="talker", scenario="first", points=100)
    (tmp_path / "one.yaml").write_text(f"{TALKER}criteria:\n{talker}")
    half = talker.replace("100", "50")
    second = CRITERION.format(name="listener", scenario="second", points=50)
    (tmp_path / "two.yaml").write_text(f"{TALKER}{LISTENER}criteria:\n{half}{second}")
    work = repository(tmp_path / "ada", (CORRECT, "2026-10-01T12:00:00+00:00"))
    roster, out = roster_of(tmp_path, [f"ada,{work.as_uri()}"]), tmp_path / "out"
    assert batch(roster, out, rubric=tmp_path / "one.yaml") == 0
    (before,) = lines_of(out)
    commit(work, WRONG_NAME, "2026-10-02T12:00:00+00:00")
    arguments = ["regrade", str(out), "--rubric", str(tmp_path / "two.yaml")]
    capsys.readouterr()
    assert run(arguments) == 4
    assert "no recording of second: ada" in capsys.readouterr().out
    assert run([*arguments, "--run-missing"]) == 0
    (after,) = lines_of(out)
    assert after["submission"]["commit"] == before["submission"]["commit"]
    assert {c["id"]: c["status"] for c in after["criteria"]} == {
        "talker-node": "pass",
        "listener-node": "pass",
    }
    assert run(["regrade", str(out)]) == 0
