"""What the grader makes up for a listener to print."""

from __future__ import annotations

from itertools import pairwise

import pytest

from grader.arena.scenario_inputs import made_up, make_shots
from grader.rubric.scenario import Probe

CHATTER = Probe(topic="/chatter", type="std_msgs/String", text=8)


def test_one_text_comes_twice_running_neither_first_nor_last() -> None:
    for _ in range(50):
        values = [shot.value for shot in make_shots((CHATTER,))]
        same = [i for i, (a, b) in enumerate(pairwise(values)) if a == b]
        assert len(values) == 8
        assert len(set(values)) == 7
        assert len(same) == 1
        assert 0 < same[0] < 6


def test_the_first_of_the_two_has_time_to_be_printed() -> None:
    shots = make_shots((CHATTER,))
    for shot, following in pairwise(shots):
        assert shot.pause_s == pytest.approx(0.3 if shot.value == following.value else 0.1)


def test_few_texts_and_numbers_come_once() -> None:
    texts = [shot.value for shot in make_shots((CHATTER.model_copy(update={"text": 3}),))]
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=3, among=(-128, 0, 127))
    values = [shot.value for shot in make_shots((numbers,))]
    assert len(set(texts)) == len(texts) == 3
    assert len(set(values)) == len(values) == 6


def test_one_of_many_numbers_comes_twice_in_a_row() -> None:
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=20, among=(-128, 0, 127))
    values = [shot.value for shot in make_shots((numbers,))]
    assert len(values) == 23
    assert len(set(values)) == 22
    assert sum(a == b for a, b in pairwise(values)) == 1
    assert {-128, 0, 127} <= set(values)


def test_topics_take_turns() -> None:
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=3)
    shots = make_shots((CHATTER, numbers))
    assert [shot.topic for shot in shots[:4]] == ["/chatter", "/n", "/chatter", "/n"]
    assert sorted({shot.topic for shot in shots[6:]}) == ["/chatter"]


def test_a_text_that_is_cut_is_noticed() -> None:
    texts = [str(shot.value) for shot in make_shots((CHATTER,))]
    for cut in (
        lambda t: t[:18],
        lambda t: t.split(",")[0],
        lambda t: t.split(":")[0],
        lambda t: t.rstrip("0123456789"),
    ):
        assert any(cut(text) != text for text in texts)


@pytest.mark.parametrize("like", ["12 Station Road, Mumbai", "Asha", "+91 98-76", "a\nb: c\n", "Al", "", "7"])
def test_what_is_made_up_has_the_shape_of_the_original(like: str) -> None:
    found = {made_up(like) for _ in range(20)}
    assert len(found) >= 18, "two of 20 may be alike by chance"
    for text in found:
        rest = "".join("x" if c.isalnum() else c for c in text)
        assert rest.startswith("".join("x" if c.isalnum() else c for c in like).rstrip())
        assert [c.isdigit() for c in text][: len(like.rstrip())] == [c.isdigit() for c in like.rstrip()]
        assert sum(c.isalnum() for c in text) >= 5
