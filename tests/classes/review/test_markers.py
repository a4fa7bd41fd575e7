"""Several markers: shares of a class, who decided how much, and their folders put together again."""

from __future__ import annotations

import multiprocessing
import shutil
from pathlib import Path

import pytest

from grader.classes.batch.folder import open_batch
from grader.classes.overrides.write import write_override
from grader.classes.review.markers import Merged, merge, share_of
from grader.classes.review.session import open_session
from grader.cli.main import run as main
from grader.errors import UsageError
from grader.model.batch import Entry
from grader.model.result import BankComment, Override, WrittenOverride
from grader.rubric.load import load_rubric
from tests.classes.review.a_class import overrides_of
from tests.classes.review.conftest import QUICK
from tests.classes.review.running import rows

ENTRIES = [Entry(id=f"s{i}", source="", group="AB"[i % 2]) for i in range(200)]


def test_shares_are_the_whole_class_once(tmp_path) -> None:
    names = ["ann", "bob", "cyd"]
    shares = [share_of(tmp_path, name, "3", None) for name in names]
    assert [sum(share(entry) for share in shares) for entry in ENTRIES] == [1] * len(ENTRIES)
    assert all(sum(map(share, ENTRIES)) > 40 for share in shares)
    assert share_of(tmp_path, "ann", "3", None) == shares[0]
    by_name = [share_of(tmp_path, name, "ann,bob, cyd", None) for name in names]
    assert by_name == shares
    with pytest.raises(UsageError, match="ann, bob and cyd"):
        share_of(tmp_path, "dan", "3", None)
    with pytest.raises(UsageError, match="the shares are those of ²"):
        share_of(tmp_path, "ann", "²", None)


def test_a_group_and_a_share_of_it(tmp_path) -> None:
    assert [e.group for e in ENTRIES if share_of(tmp_path, None, None, "A")(e)] == ["A"] * 100
    mine = share_of(tmp_path, "ann", "2", "A")
    assert {e.group for e in ENTRIES if mine(e)} == {"A"}
    with pytest.raises(UsageError, match="needs --marker"):
        share_of(tmp_path, None, "2", None)


def _claim(folder: str, name: str) -> None:
    share_of(Path(folder), name, "3", None)


@pytest.mark.full
def test_markers_who_begin_at_once_have_different_shares(tmp_path) -> None:
    names = ["ann", "bob"]
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_claim, args=(str(tmp_path), name)) for name in names]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert {share_of(tmp_path, name, "3", None).number for name in names} == {0, 1}


def test_the_pages_list_only_the_share_and_say_who_decided(page, review) -> None:
    page.save("dana", "style", points="3")
    review.share = lambda entry: entry.group == "A"
    assert rows(page.text("/")) == ["ada"]
    assert "A. Miller: 1" in page.text("/criteria")


@pytest.fixture
def other(made_class, tmp_path) -> Path:
    return Path(shutil.copytree(made_class, tmp_path / "other"))


def put(folder: Path, name: str, points: float, author: str) -> None:
    write_override(folder / "overrides.yaml", name, "style", Override(points=points, author=author))


def merged(out: Path, other: Path) -> Merged:
    batch = open_batch(out)
    return merge(batch, load_rubric(batch.run.rubric_source).rubric, other)


def test_two_folders_come_together_and_conflicts_are_named(out, other, capsys) -> None:
    for folder, name, points in [(out, "ada", 3), (out, "eve", 4), (other, "dana", 5), (other, "eve", 6)]:
        put(folder, name, points, "Ann" if folder == out else "Bob")
    found = merged(out, other)
    assert found == Merged(
        added=1, same=0, conflicts=("eve.style: here 4 points by Ann, there 6 points by Bob",)
    )
    assert {name: one["style"]["points"] for name, one in overrides_of(out).items()} == {
        "ada": 3,
        "eve": 4,
        "dana": 5,
    }
    assert main(["overrides", "merge", str(out), str(other)]) == 1
    assert "conflict: eve.style" in capsys.readouterr().out
    put(other, "eve", 4, "Ann")
    assert main(["overrides", "merge", str(out), str(other)]) == 0


def test_comments_come_along_unless_they_say_something_else(out, other) -> None:
    for folder, name, text in [(out, "a", "x"), (other, "a", "y"), (other, "b", "z")]:
        write_override(folder / "comments.yaml", "style", name, BankComment(text=text))
    for name, comment in [("ada", "a"), ("dana", "b")]:
        write_override(other / "overrides.yaml", name, "style", WrittenOverride(comments=(comment,)))
    found = merged(out, other)
    assert found.added == 1
    assert found.conflicts == (
        "comments.yaml: style.a says something else there",
        "ada.style: one of its comments says something else there",
    )
    assert overrides_of(out) == {"dana": {"style": {"comments": ["b"]}}}
    review = open_session(out, QUICK)
    assert review.overrides()["dana"]["style"].comment == "z"


def test_a_folder_without_decisions_is_refused(out, other) -> None:
    with pytest.raises(UsageError, match="there is no such file"):
        merged(out, other)
