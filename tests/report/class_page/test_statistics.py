"""Points, costs, times: what the page says in numbers."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from grader.classes.gradebook import GradebookRow
from grader.cli.class_display import list_attention
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.report.class_page.page import todos
from grader.report.class_page.statistics import costs, most_first, span, spread_of, timing
from grader.report.class_page.submissions import SubmissionRow, line_of, passed_by_none
from tests.report.class_page.made_up import made_up_rows, made_up_run


def lines(count: int, **more: int) -> list[SubmissionRow]:
    return [
        line_of(entry, result, made_up_run(count).criteria) for entry, result in made_up_rows(count, **more)
    ]


@pytest.mark.parametrize(
    ("points", "most", "expected"),
    [
        ([0, 4.9, 5, 100], 100, {0: 2, 5: 1, 95: 1}),
        ([10, 10], 10, {9.5: 2}),
        ([0.1 + 0.2], 1, {0.3: 1}),
        ([7], 7, {6.5: 1}),
        ([7.5, 3], 7, {3: 1, 7.0: 1}),
        ([3, 0], 0, {0: 1, 2.8: 1}),
        ([0], 0, {0: 1}),
        ([12000, 0], 12345, {0: 1, 12000: 1}),
    ],
)
def test_everybody_is_in_one_bin(points, most, expected) -> None:
    found = spread_of(points, most)
    counts = {round(one.low, 6): one.count for one in found.bins if one.count}
    assert len(found.bins) <= 20
    assert counts == expected


def test_nobody_has_no_spread() -> None:
    assert spread_of([], 100) is None


def test_a_mistake_costs_what_was_lost_by_it_and_by_what_followed() -> None:
    run, found = made_up_run(50), lines(50)
    judged = [result for _, result in made_up_rows(50) if result.error is None]
    assert sum(cost.points for cost in costs(found, run.criteria)) == pytest.approx(
        sum(c.missing for result in judged for c in result.criteria if not c.status.is_open)
    )
    for cost in costs(found, run.criteria):
        own = [
            [c for c in result.criteria if cost.criterion.id in {c.id, c.blocked_by} and not c.status.is_open]
            for result in judged
            if any(
                c.id == cost.criterion.id and c.status.value in {"partial", "fail"} and c.missing
                for c in result.criteria
            )
        ]
        assert cost.points == pytest.approx(sum(c.missing for mistakes in own for c in mistakes))
        assert len(cost.by) == len(own)
        assert cost.judged == len(judged)
    node = next(c for c in costs(found, run.criteria) if c.criterion.id == "talker-node")
    assert node.points > 5 * len(node.by), "what was blocked counts where the mistake is"


def test_what_cost_most_comes_first() -> None:
    found = most_first(costs(lines(50), made_up_run(50).criteria))
    assert [cost.points for cost in found] == sorted((cost.points for cost in found), reverse=True)
    assert all(cost.by for cost in found)


def test_the_slowest_ten_and_the_mean() -> None:
    found = timing(made_up_run(50), lines(50))
    times = sorted((r.timing.wall_s for _, r in made_up_rows(50) if r.timing.wall_s), reverse=True)
    assert [seconds for _, seconds in found.slowest] == times[:10]
    assert found.mean_s == pytest.approx(sum(times) / len(times))
    assert found.wall_s == pytest.approx(205)


def test_what_still_runs_has_no_time_yet() -> None:
    assert timing(made_up_run(5, "running", ended_at=None), lines(5)).wall_s is None
    assert timing(made_up_run(2), lines(2, missing=2)) is None


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.04, "0.0 s"),
        (9.96, "10 s"),
        (59.4, "59 s"),
        (59.6, "1 min"),
        (725, "12 min 5 s"),
        (7_500, "2 h 5 min"),
        (86_400, "1 day"),
        (187_200, "2 days 4 h"),
    ],
)
def test_a_time_in_words(seconds, words) -> None:
    assert span(seconds) == words


def test_commands_are_quoted_and_whole(tmp_path) -> None:
    out = tmp_path / "it's $HOME; rm -rf"
    run = made_up_run(
        60, roster="my roster.csv", rubric_source="/a b/lab.yaml", static_only=True, cluster="tcp://h:1"
    )
    found = {todo.anchor: todo.command.unescape() for todo in todos(run, lines(60, missing=2), out)}
    assert found["inconclusive"] == (
        f"grader batch 'my roster.csv' --rubric '/a b/lab.yaml' --out '{tmp_path}/it'\"'\"'s $HOME; rm -rf' "
        "--cluster tcp://h:1 --only inconclusive"
    )
    assert " --static " in found["error"]
    assert found["error"].endswith(" --only failed")
    assert "--only" not in found["missing"]


@pytest.mark.parametrize(
    ("letters", "none"),
    [
        ("fffff", 5),
        ("aaaaaffff", 9),
        ("fbbbbiem", 5),
        ("ffff", 0),
        ("fffffp", 0),
        ("bbbbbbb", 0),
        ("iiiiiiimmmeee", 0),
        ("nnnnnn", 0),
    ],
)
def test_what_a_whole_class_loses_may_be_the_rubrics_mistake(letters: str, none: int) -> None:
    criteria = made_up_run(1).criteria[:1]
    assert passed_by_none(criteria, letters) == ({0: none} if none else {})
    assert not passed_by_none([criteria[0].model_copy(update={"max_points": 0.0})], letters)


def test_the_page_and_the_terminal_ask_for_a_correct_package(tmp_path) -> None:
    run = made_up_run(9, rubric_source="my lab.yaml")
    rows = [
        GradebookRow(
            entry=entry,
            result=result.model_copy(
                update={"criteria": (lost(result.criteria[0]), *result.criteria[1:])}
                if result.criteria
                else {}
            ),
        )
        for entry, result in made_up_rows(9)
    ]
    found = [line_of(row.entry, row.result, run.criteria) for row in rows]
    todo = next(todo for todo in todos(run, found, tmp_path) if todo.anchor == "rubric")
    assert (todo.count, todo.items[0].id, todo.items[0].text) == (1, run.criteria[0].id, "none of 9")
    assert todo.command.unescape() == "grader grade FOLDER --rubric 'my lab.yaml'"
    assert not next(todo for todo in todos(run, found, None) if todo.anchor == "rubric").command

    told = list(list_attention(SimpleNamespace(run=run, rows=lambda: rows, path=tmp_path)))
    assert told[-2:] == [
        "none of 9 got full points for manifest (package.xml names lab1): is the rubric right there?",
        "  hint: grade a package that you know to be correct: grader grade FOLDER --rubric 'my lab.yaml'",
    ]


def lost(criterion: CriterionResult) -> CriterionResult:
    return criterion.model_copy(update={"status": Status.FAIL, "points": 0.0})
