"""One override is written, and nothing else of the file changes: comments, order, quotes, line ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from datetime import date, datetime, timedelta, timezone
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.classes.overrides import FILE, read_overrides, write
from grader.classes.overrides.write import write_override, write_overrides
from grader.errors import Busy, OutputError, RubricError, UsageError
from grader.model.result import Override
from tests.classes.overrides.samples import IDS, rubric

MILLER = Override(points=3, comment='it\'s "good": ü #x', author="A. Miller", date=date(2026, 11, 3))
WRITTEN = '{points: 3, comment: "it\'s \\"good\\": ü #x", author: "A. Miller", date: 2026-11-03}'
KEPT = """\
# overrides of lab 1
alice:
  style: {points: 7, comment: "clear names"}   # see mail
  # the lab machine was broken that day
  chatter-rate:
      points: 10   # all of them
      comment: a comment that goes on and on, beyond what a line of eighty columns holds, so that somebody may wrap it

# --- group B ---
bob:
  style: {points: 7.50, date: 2026-11-02}
001234:
    style:
        points: 1
        comment: |
          two
          lines
no: {style: {points: 1}, chatter-rate: {points: 3}}  # the last one
"""


def file(folder: Path, text: str = KEPT) -> Path:
    path = folder / FILE
    path.write_bytes(text.encode())
    return path


def changed(path: Path, *what: tuple[str, str, Override | None]) -> str:
    for submission, criterion, override in what:
        write_override(path, submission, criterion, override)
    return path.read_bytes().decode()


@pytest.mark.parametrize(
    ("submission", "criterion", "override", "old", "new"),
    [
        ("alice", "style", MILLER, '{points: 7, comment: "clear names"}', WRITTEN),
        (
            "alice",
            "chatter-rate",
            Override(points=9, comment="a comment that goes on and on, beyond what a line of eighty columns holds, "
                     "so that somebody may wrap it", date=date(2026, 11, 3)),
            "      points: 10   # all of them\n",
            "      points: 9   # all of them\n",
        ),
        ("bob", "style", Override(points=8, date=date(2026, 11, 2)), "7.50", "8"),
        ("bob", "chatter-rate", MILLER, "2026-11-02}\n", f"2026-11-02}}\n  chatter-rate: {WRITTEN}\n"),
        ("no", "style", MILLER, "{points: 1}, chatter", f"{WRITTEN}, chatter"),
        ("no", "style", None, "style: {points: 1}, ", ""),
        ("no", "chatter-rate", None, ", chatter-rate: {points: 3}", ""),
        ("001234", "chatter-rate", MILLER, "lines\n", f"lines\n    chatter-rate: {WRITTEN}\n"),
        ("001234", "style", Override(points=1, comment="x"), "|\n          two\n          lines\n", '"x"\n'),
        ("bob", "style", None, "bob:\n  style: {points: 7.50, date: 2026-11-02}\n", ""),
        ("Zoë Müller", "style", MILLER, "# the last one\n", f'# the last one\n"Zoë Müller":\n  style: {WRITTEN}\n'),
        ("nobody", "style", None, "", ""),
        ("alice", "other", None, "", ""),
        ("BOB", "style", None, "bob:\n  style: {points: 7.50, date: 2026-11-02}\n", ""),
    ],
)  # fmt: skip
def test_one_place_changes(*, tmp_path, submission, criterion, override, old, new):
    text = changed(file(tmp_path), (submission, criterion, override))
    expected = KEPT.replace(old, new, 1)
    if criterion == "chatter-rate" and submission == "alice":
        expected = expected.replace("wrap it\n", "wrap it\n      date: 2026-11-03\n")
    assert text == expected


def test_comments_around_what_is_taken_out_stay(tmp_path):
    text = changed(file(tmp_path), ("alice", "chatter-rate", None), ("alice", "style", None))
    assert text.startswith(
        "# overrides of lab 1\n  # the lab machine was broken that day\n\n# --- group B ---\nbob:\n"
    )


def test_a_file_that_is_new(tmp_path):
    path = tmp_path / "class" / FILE
    written = changed(path, ("no", "style", MILLER))
    assert written == f'schema: grader.overrides/1\n"no":\n  style: {WRITTEN}\n'
    assert read_overrides(path, rubric(), IDS) == {"no": {"style": MILLER}}
    assert changed(path, ("no", "style", None)) == "schema: grader.overrides/1\n"
    assert read_overrides(path, rubric(), IDS) == {}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("", "schema: grader.overrides/1\nalice:\n  style: {points: 1}\n"),
        ("# mine", "# mine\nalice:\n  style: {points: 1}\n"),
        ("# mine\n", "# mine\nalice:\n  style: {points: 1}\n"),
        ("{}\n", "{alice: {style: {points: 1}}}\n"),
        ("{bob: {style: {points: 2}}}", "{bob: {style: {points: 2}}, alice: {style: {points: 1}}}"),
        ("bob: {style: {points: 2}}", "bob: {style: {points: 2}}\nalice:\n  style: {points: 1}\n"),
        ("alice:\n", "alice: {style: {points: 1}}\n"),
        ("alice:   # nothing yet\nbob:\n", "alice: {style: {points: 1}}   # nothing yet\nbob:\n"),
        ("alice: {}\n", "alice: {style: {points: 1}}\n"),
        ("alice:\n  style:\n", "alice:\n  style: {points: 1}\n"),
        ("alice:\n  style: {}\n", "alice:\n  style: {points: 1}\n"),
        ("alice:\n  style:\n    points:\n    comment:\n", "alice:\n  style:\n    points: 1\n    comment:\n"),
        ("alice:\r\n  style: {points: 2}\r\n", "alice:\r\n  style: {points: 1}\r\n"),
        ("bob: {}\r\n", "bob: {}\r\nalice:\r\n  style: {points: 1}\r\n"),
        ("---\nbob: {}\n...\n", "---\nbob: {}\nalice:\n  style: {points: 1}\n...\n"),
        ("'alice':\n  'style': {'points': 2}\n", "'alice':\n  'style': {'points': 1}\n"),
        ("alice:\n  style: {points: 2, comment: x}  # y\n", "alice:\n  style: {points: 1}  # y\n"),
    ],
)  # fmt: skip
def test_files_that_are_begun(tmp_path, before, after):
    assert changed(file(tmp_path, before), ("alice", "style", Override(points=1))) == after


def test_texts_that_yaml_takes_for_something_else_come_back(tmp_path):
    path = tmp_path / FILE
    texts = [
        "2026-11-02",
        "yes",
        "12",
        "a: b",
        "# x",
        "- x",
        "'",
        "é\u2028\x85",
        "\x1b[2J",
        "tab\t",
        "  ",
        "😀",
        "\n\n",
    ]
    for text in texts:
        given_one = Override(points=1.25, comment=text, author=text)
        write_override(path, "alice", "style", given_one)
        assert read_overrides(path, rubric(), IDS) == {"alice": {"style": given_one}}


def test_times_and_small_points_come_back(tmp_path):
    path = tmp_path / FILE
    times = [
        datetime.fromisoformat("2026-11-02T14:30:00"),
        datetime(2026, 11, 2, 14, 30, 1, 5, tzinfo=timezone(timedelta(hours=-3))),
    ]
    for when in times:
        for points in (0, 1e-7, 0.1, 10):
            given_one = Override(points=points, date=when)
            write_override(path, "alice", "style", given_one)
            assert read_overrides(path, rubric(), IDS) == {"alice": {"style": given_one}}


@pytest.mark.parametrize(
    ("text", "submission"),
    [
        ("alice: &x {style: {points: 1}}\nbob: *x\n", "alice"),
        ("alice: &x {style: {points: 1}}\nbob: *x\n", "bob"),
        ("alice: {style: &x {points: 1}}\nbob: {style: *x}\n", "alice"),
        ("alice: {style: &x {points: 1}}\nbob: {style: *x}\n", "bob"),
        ("base: &b {style: {points: 1}}\nalice: {<<: *b, chatter-rate: {points: 3}}\n", "base"),
    ],
)
def test_what_cannot_be_changed_without_touching_others_is_left_alone(tmp_path, text, submission):
    path = file(tmp_path, text)
    with pytest.raises(UsageError, match=f"style of {submission} is written in a way") as caught:
        write_override(path, submission, "style", MILLER)
    assert caught.value.hint == "change it by hand"
    assert path.read_text() == text


@pytest.mark.parametrize("text", ["alice: [\n", "- alice\n", "alice: 1\nalice: 2\n", "\x00", "alice: \xff"])
def test_a_broken_file_stays_as_it_is(tmp_path, text):
    path = tmp_path / FILE
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(RubricError):
        write_override(path, "alice", "style", MILLER)
    assert path.read_bytes() == text.encode("latin-1")


def test_nothing_is_written_where_nothing_changes(tmp_path):
    path = file(tmp_path)
    before = path.stat()
    write_override(path, "alice", "style", Override(points=7, comment="clear names"))
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_mode_and_link_stay(tmp_path):
    path = file(tmp_path)
    path.chmod(0o600)
    link = tmp_path / "link.yaml"
    link.symlink_to(path)
    write_override(link, "bob", "style", None)
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o600
    assert "bob" not in path.read_text()


def test_where_it_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        write_override(tmp_path / "file" / FILE, "bob", "style", MILLER)


def test_a_writer_that_does_not_end_is_told_of(tmp_path, monkeypatch):
    path = file(tmp_path)
    monkeypatch.setattr(write, "WAIT_S", 0.05)
    held = write.hold_lock(path.resolve().with_name(f".{path.name}.lock"), path)
    with held, pytest.raises(Busy, match="another program is writing"):
        write_override(path, "bob", "style", None)
    write_override(path, "bob", "style", None)
    assert "bob" not in path.read_text()


def _write_many(path: str, names: list[str]) -> None:
    for name in names:
        write_override(Path(path), name, "style", Override(points=1, comment=name))


@pytest.mark.full
def test_two_writers_at_once_lose_nothing(tmp_path):
    path = file(tmp_path)
    names = [[f"{side}{i}" for i in range(15)] for side in "xy"]
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=_write_many, args=(os.fspath(path), part)) for part in names]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0, 0]
    every = [name for part in names for name in part]
    found = read_overrides(path, rubric(), [*IDS, *every])
    assert {name: found[name]["style"].comment for name in every} == {name: name for name in every}
    assert path.read_text().startswith(KEPT)


CHANGES = st.lists(
    st.tuples(
        st.sampled_from([*IDS, "new one"]),
        st.sampled_from(["style", "chatter-rate"]),
        st.none()
        | st.builds(
            Override,
            points=st.floats(0, 10).map(lambda points: round(points, 6)),
            comment=st.text(st.characters(exclude_categories=["Cs"]), max_size=30),
            author=st.sampled_from(["", "A. Miller", "yes"]),
            date=st.none() | st.dates(),
        ),
    ),
    max_size=6,
)


@pytest.mark.full
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(CHANGES)
def test_any_changes_one_after_another(tmp_path, changes):
    path = file(tmp_path)
    ids = [*IDS, "new one"]
    expected = {name: dict(found) for name, found in read_overrides(path, rubric(), ids).items()}
    outside = ["# overrides of lab 1\n", "# --- group B ---\n"]
    hers = ["# the lab machine was broken that day\n"]  # stays as long as alice has any override
    for submission, criterion, override in changes:
        write_override(path, submission, criterion, override)
        if override is not None:
            expected.setdefault(submission, {})[criterion] = override
        else:
            expected.get(submission, {}).pop(criterion, None)
        hers = hers if expected["alice"] else []
    assert read_overrides(path, rubric(), ids) == {name: found for name, found in expected.items() if found}
    for comment in (*outside, *hers):
        assert comment in path.read_text()


@pytest.mark.full
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(CHANGES)
def test_changes_in_one_go_say_what_they_say_one_by_one(tmp_path, changes):
    (tmp_path / "one").mkdir(exist_ok=True)
    (tmp_path / "go").mkdir(exist_ok=True)
    one_by_one, in_one_go = file(tmp_path / "one"), file(tmp_path / "go")
    changed(one_by_one, *changes)
    write_overrides(in_one_go, changes)
    ids = [*IDS, "new one"]
    assert read_overrides(in_one_go, rubric(), ids) == read_overrides(one_by_one, rubric(), ids)


def test_a_class_in_one_go_is_one_write(tmp_path, monkeypatch):
    path = file(tmp_path)
    names = [f"s{i:03}" for i in range(300)]
    syncs = []
    monkeypatch.setattr(os, "fsync", syncs.append)
    write_overrides(path, [(name, "style", MILLER) for name in names])
    assert len(syncs) == 1
    assert path.read_text().startswith(KEPT)
    assert read_overrides(path, rubric(), [*IDS, *names])["s299"] == {"style": MILLER}
    write_overrides(path, [(name, "style", None) for name in names])
    assert path.read_text() == KEPT
    assert len(syncs) == 2


KILLED = """
import os, signal, sys
from pathlib import Path
from grader.classes.overrides.write import write_overrides
from grader.model.result import Override

def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)

def kill_after(function):
    return lambda *given: (function(*given), kill())

path, where = Path(sys.argv[1]), sys.argv[2]
if where == "before the flush":
    os.fsync = kill
if where == "after the flush":
    os.fsync = kill_after(os.fsync)
if where == "before the rename":
    Path.replace = kill
if where == "after the rename":
    Path.replace = kill_after(Path.replace)
write_overrides(path, [(name, "style", Override(points=2)) for name in ("alice", "bob", "Zoë Müller")])
"""


@pytest.mark.parametrize(
    ("where", "written"),
    [
        ("before the flush", False),
        ("after the flush", False),
        ("before the rename", False),
        ("after the rename", True),
    ],
)
def test_a_writer_that_is_killed_has_written_all_or_nothing(tmp_path, where, written):
    path = file(tmp_path)
    before = read_overrides(path, rubric(), IDS)
    done = subprocess.run([sys.executable, "-c", KILLED, path, where], check=False)
    assert done.returncode == -signal.SIGKILL
    found = read_overrides(path, rubric(), IDS)
    names = ("alice", "bob", "Zoë Müller")
    if written:
        assert [found[name]["style"].points for name in names] == [2, 2, 2]
    else:
        assert found == before
    write_override(path, "bob", "style", MILLER)  # no lock is left behind
    assert read_overrides(path, rubric(), IDS)["bob"]["style"] == MILLER
