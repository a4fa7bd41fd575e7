"""Copies are found however they are disguised, and nobody else."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.model.batch import Similarity
from tests.classes.similarity.classes import (
    DISGUISES,
    class_of,
    commented,
    fixture_variants,
    renamed,
    reordered,
    respaced,
    solution,
)

HONEST = ("table", "generator", "laser", "service")
ALL = ("average", "generator", "laser", "machine", "monitor", "odometry", "service", "table", "timed")


def compared(folders: dict[str, Path], **also: object) -> Similarity:
    fields = {"starter": (), "groups": {}, "threshold": 0.8, "jobs": 2} | also
    from grader.classes.similarity.comparison import compare_class  # noqa: PLC0415 - loads matplotlib

    return compare_class(folders, **fields)


def named(similarity: Similarity) -> set[tuple[str, str]]:
    return {(pair.a, pair.b) for pair in similarity.pairs}


def programs(*names: str) -> dict[str, bytes]:
    return {f"scripts/{name}.py": solution(name).encode() for name in names}


@pytest.fixture(scope="module")
def big_class(tmp_path_factory) -> dict[str, Path]:
    """34 submissions: 24 with one tutorial-like solution, four written alone, and three pairs of copies."""
    swapped = {
        "scripts/timed.py": solution("monitor").encode(),
        "scripts/monitor.py": solution("timed").encode(),
    }
    other_names = {
        f"src/node{n}.py": renamed(solution(name)).encode() for n, name in enumerate(("odometry", "average"))
    }
    moved = {"machine": commented(respaced(reordered(solution("machine")))).encode()}
    submissions = fixture_variants("leeds-comp3631-lab1", 24)
    submissions |= {name: programs(name) for name in HONEST}
    submissions |= {"ann": programs("timed", "monitor"), "zoe": swapped}
    submissions |= {"ben": programs("odometry", "average"), "yan": other_names}
    submissions |= {"cem": {"machine": solution("machine").encode()}, "xia": moved}
    assert len(submissions) == 34
    return class_of(tmp_path_factory.mktemp("class"), submissions)


@pytest.mark.full
def test_in_a_class_the_three_copied_pairs_are_named_and_nobody_else(big_class) -> None:
    similarity = compared(big_class)
    assert named(similarity) == {("ann", "zoe"), ("ben", "yan"), ("cem", "xia")}
    assert set(similarity.clusters) == {("ann", "zoe"), ("ben", "yan"), ("cem", "xia")}
    assert similarity.compared == 34
    assert similarity.not_compared == ()


@pytest.mark.full
def test_what_most_of_the_class_has_is_taken_out(big_class) -> None:
    """The fixtures are one solution with small changes: of their own they have too little to say anything."""
    similarity = compared(big_class)
    assert similarity.taken_out.common
    assert set(fixture_variants("leeds-comp3631-lab1", 24)) - set(similarity.too_little) == set()


@pytest.mark.full
def test_a_pair_says_where(big_class) -> None:
    pair = next(pair for pair in compared(big_class).pairs if pair.a == "ann")
    lines = {(match.file_a, match.file_b) for match in pair.files}
    assert lines == {
        ("scripts/timed.py", "scripts/monitor.py"),
        ("scripts/monitor.py", "scripts/timed.py"),
    }
    assert (pair.similarity_a, pair.similarity_b) == (1.0, 1.0)
    assert pair.lines_a == pair.lines_b > 50


@pytest.mark.full
@pytest.mark.parametrize("disguise", DISGUISES)
def test_disguised_copies_are_found(tmp_path, disguise) -> None:
    """Nine programs and a copy of each."""
    copies = {name: DISGUISES[disguise](solution(name)) for name in ALL}
    assert all(copy != solution(name) for name, copy in copies.items())
    submissions = {name: programs(name) for name in ALL}
    submissions |= {f"{name}-copy": {"node.py": copy.encode()} for name, copy in copies.items()}
    assert named(compared(class_of(tmp_path, submissions))) == {(name, f"{name}-copy") for name in ALL}


@pytest.mark.full
def test_programs_written_alone_are_far_apart(tmp_path) -> None:
    """The same exercise, nine times."""
    similarity = compared(class_of(tmp_path, {name: programs(name) for name in ALL}), threshold=0.3)
    assert named(similarity) == set()
    assert similarity.too_little == ()


@pytest.mark.full
def test_half_a_copy_is_below_the_threshold_and_can_be_asked_for(tmp_path) -> None:
    half = {"node.py": (solution("timed") + solution("laser")).encode()}
    other = {"node.py": (solution("timed") + solution("odometry")).encode()}
    folders = class_of(tmp_path, {"one": half, "two": other})
    assert named(compared(folders)) == set()
    assert named(compared(folders, threshold=0.3)) == {("one", "two")}


@pytest.mark.full
def test_who_hides_a_copy_in_much_other_code_is_found(tmp_path) -> None:
    padded = programs("timed", "laser", "service", "table")
    folders = class_of(tmp_path, {"one": programs("timed"), "two": padded})
    (pair,) = compared(folders).pairs
    assert pair.similarity_a == 1.0
    assert pair.similarity_b < 0.4


@pytest.mark.full
def test_one_group_may_share(tmp_path) -> None:
    folders = class_of(tmp_path, {name: programs("timed") for name in ("one", "two", "three")})
    similarity = compared(folders, groups={"one": "a", "two": "a", "three": ""})
    assert named(similarity) == {("one", "three"), ("three", "two")}
    assert similarity.same_group == 1


@pytest.mark.full
def test_copies_of_copies_are_one_cluster(tmp_path) -> None:
    chain = {"one": ("timed",), "two": ("timed", "laser"), "three": ("laser",), "four": ("table",)}
    similarity = compared(class_of(tmp_path, {name: programs(*files) for name, files in chain.items()}))
    assert similarity.clusters == (("one", "three", "two"),)


@pytest.mark.full
def test_the_same_class_gives_the_same_answer_in_any_order(tmp_path) -> None:
    folders = class_of(tmp_path, {name: programs("timed", name) for name in ("laser", "table", "service")})
    forward = compared(folders, threshold=0.3)
    backward = compared(dict(reversed(folders.items())), threshold=0.3)
    assert forward.pairs
    assert forward == backward
