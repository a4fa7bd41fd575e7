"""Values that are made up for each submission: what a rubric may declare, where they stand, and what runs keep."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from grader.classes.batch.renew_results import fitting_runs
from grader.errors import EvidenceError
from grader.judging import judge
from grader.model.verdict import Status
from grader.report.files import result_bytes
from grader.report.html.page import render_html
from grader.report.markdown import render_markdown
from grader.report.sentences import made_up_words
from grader.report.terminal import render_terminal
from grader.report.view import for_student
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.made_up import MadeUp, tell_made_up, with_recorded_values, with_values
from grader.rubric.schema import rubric_schema
from tests.report.hostile import rubric
from tests.rubric.samples import faults, spoiled
from tests.support.a_class import criterion, made_result
from tests.support.timeline import build_runs

RATE = "{from: 5, to: 20}"
ARGS = 'args: ["_rate:={made_up: rate}"]'


def making_up(folder: Path, declared: str, *changes: tuple[str, str], start: str = ARGS) -> Path:
    """The sound rubric with made-up values, of which the talker gets one as an argument."""
    return spoiled(
        folder,
        ("scenarios:", f"made_up: {declared}\nscenarios:"),
        ("src/talker.py}", f"src/talker.py, {start}}}"),
        *changes,
    )


def with_rate(folder: Path) -> LoadedRubric:
    """One criterion asks for the rate that is made up."""
    return load_rubric(
        str(making_up(folder, f"{{rate: {RATE}}}", ("rate_hz: 10}", "rate_hz: {made_up: rate}}")))
    )


@pytest.mark.parametrize(
    ("declared", "fits"),
    [
        ({"from": 5, "to": 20}, lambda v: type(v) is int and 5 <= v <= 20),
        ({"from": 10, "to": 30, "step": 10}, lambda v: v in {10, 20, 30}),
        ({"from": 0.1, "to": 0.7, "step": 0.2}, lambda v: v in {0.1, 0.3, 0.5, 0.7}),
        ({"from": 1.0, "to": 3.0}, lambda v: type(v) is float and v in {1.0, 2.0, 3.0}),
        ({"from": -3, "to": -1, "step": 0.5}, lambda v: type(v) is float and -3 <= v <= -1),
        ({"one_of": ["red", 7, True]}, lambda v: v in ("red", 7, True)),
        ({"letters": 8}, lambda v: len(v) == 8 and v.isalpha() and not set(v) & set("aeiou")),
        ({"sum": ["a", "b", 0.5]}, lambda v: v == 10.5),
        ({"product": ["a", "b", -2]}, lambda v: v == -42 and type(v) is int),
        ({"quotient": ["b", 2]}, lambda v: v == 3.5),
        ({"quotient": [1, "a"]}, lambda v: v == pytest.approx(1 / 3)),
        ({"quotient": ["a", 3]}, lambda v: v == 1 and type(v) is int),
        ({"mean": ["a", "b"]}, lambda v: v == 5),
        ({"mean": ["a", "b", 0.5]}, lambda v: v == 3.5),
    ],
)
def test_values_of_each_kind(declared: dict[str, Any], fits: Any) -> None:
    one = MadeUp.model_validate(declared)
    values = [one.value({"a": 3, "b": 7}, lambda count, n=n: n % count) for n in range(60)]
    assert all(map(fits, values)), values


def test_a_package_of_another_name_has_types_of_that_name(tmp_path: Path) -> None:
    examples = Path(__file__).parents[2] / "rubrics" / "examples"
    lab = load_rubric(str(examples / "service-own-type.yaml"))
    renamed = lab.of_submission("1", "my_service").rubric
    assert {one.type for one in renamed.scenarios["server"].calls} == {"my_service/Clamp"}
    assert [c.parameters["type"] for c in renamed.criteria if c.check == "service"] == ["my_service/Clamp"]
    assert renamed.package == "own_service"
    assert lab.of_submission("1", "own_service").rubric is lab.rubric
    plain = load_rubric("leeds-comp3631-lab1")
    assert plain.of_submission("1", "lab_1").rubric is plain.rubric


def test_a_submission_has_values_of_its_own_that_stay(tmp_path: Path) -> None:
    lab = with_rate(tmp_path)
    assert lab.rubric.values == {}
    drawn = [lab.of_submission(digest).rubric for digest in map(str, range(60))]
    assert {rubric.values["rate"] for rubric in drawn} == set(range(5, 21))
    again = with_rate(tmp_path).of_submission("7").rubric
    assert again.values == drawn[7].values
    assert again == drawn[7]
    assert pickle.loads(pickle.dumps(again)).values == again.values  # noqa: S301 - for workers
    (start,) = again.scenarios["real"].start
    assert start.args == (f"_rate:={again.values['rate']}",)
    assert [c.parameters["rate_hz"] for c in again.criteria] == [again.values["rate"], 10]


def test_what_is_changed_in_a_rubric_stays_changed(tmp_path: Path) -> None:
    lab = with_rate(tmp_path)
    marked = lab.model_copy(update={"rubric": lab.rubric.model_copy(update={"pass_mark": 50.0})})
    assert marked.of_submission("a").rubric.pass_mark == 50.0
    few = lab.rubric.model_copy(update={"criteria": lab.rubric.criteria[:1]})
    assert len(with_recorded_values(few, {}).criteria) == 1


def test_values_stand_in_texts_keys_and_words(tmp_path: Path) -> None:
    path = making_up(
        tmp_path,
        "{word: {letters: 5}, half: {one_of: [0.5, true]}}",
        ("title: 10 Hz\n", 'title: 10 Hz\n    hint: "read {made_up: word}, {made_up: half}"\n'),
        ("window_s: 5, topics: [/chatter]", 'messages: {"/{made_up: word}": 3, /chatter: 3}'),
        ("topic: /chatter, rate_hz", '"topic": "/{made_up: word}", rate_hz'),
        start='args: ["chatter:={made_up: word}", "{made_up: half}"]',
    )
    lab = load_rubric(str(path))
    assert lab.rubric.criteria[1].hint == "read {made_up: word}, {made_up: half}"
    rubric = lab.of_submission("b").rubric
    word, half = rubric.values["word"], {0.5: "0.5", True: "true"}[rubric.values["half"]]
    assert rubric.scenarios["real"].until.messages == {f"/{word}": 3, "/chatter": 3}
    assert rubric.scenarios["real"].start[0].args == (f"chatter:={word}", half)
    assert rubric.criteria[0].parameters["topic"] == f"/{word}"
    assert rubric.criteria[1].hint == f"read {word}, {half}"


@pytest.mark.parametrize(
    ("declared", "fault"),
    [
        (
            "{}",
            "made_up.rate: give one of from, one_of, letters, sum, product, quotient and mean: none is there",
        ),
        (
            "{from: 1, to: 3, letters: 4}",
            "made_up.rate: give one of from, one_of, letters, sum, product, quotient and mean: from",
        ),
        ("{from: 1}", "made_up.rate.to: is missing"),
        ("{from: 9, to: 3}", "made_up.rate.to: there are no two values from 9 to 3 in steps of 1"),
        ("{from: 1, to: 9, step: 10}", "made_up.rate.to: there are no two values from 1 to 9 in steps of 10"),
        ("{from: 1, to: 9, step: 0}", "made_up.rate.step: must be more than 0, not 0"),
        ("{from: 0, to: 2, step: 1.0e-10}", "made_up.rate.step: makes 20000000001 values"),
        ("{from: 1, to: many}", 'made_up.rate.to: must be a whole number, not "many", or must be a number'),
        ("{letters: 4, step: 2}", "made_up.rate.step: is for a range, which has from"),
        ("{letters: 2}", "made_up.rate.letters: must be at least 3, not 2"),
        ("{one_of: [7, 7]}", "made_up.rate.one_of: needs two different values"),
        ("{sum: [rat, 1]}", 'made_up.rate.sum: no value "rat" is declared above it'),
        (
            "{quotient: [1]}",
            "made_up.rate.quotient: needs two numbers, the one and what it is divided by: 1 are",
        ),
        ("{quotient: [1, 0]}", "made_up.rate.quotient: divides by 0"),
        ("{frm: 3}", 'made_up.rate.frm: is not known here (did you mean "from"?)'),
    ],
)
def test_faulty_declarations(declared: str, fault: str, tmp_path: Path) -> None:
    found = faults(making_up(tmp_path, f"{{rate: {declared}}}"))
    assert f"lab.yaml:6: {fault}" in "\n".join(found)
    assert all("made_up" in one for one in found), "what has no value yet has no other fault"


@pytest.mark.parametrize(
    ("divisor", "sound"),
    [
        ("{from: 1, to: 5}", True),
        ("{from: -1, to: 1}", False),
        ("{from: -1, to: 2, step: 3}", True),
        ("{one_of: [2, 4]}", True),
        ("{one_of: [0, 4]}", False),
        ("{sum: [1, 2]}", False),
    ],
)
def test_nothing_is_divided_by_what_may_be_zero(divisor: str, sound: bool, tmp_path: Path) -> None:
    path = making_up(tmp_path, f"{{by: {divisor}, rate: {{quotient: [1, by]}}}}")
    if sound:
        assert load_rubric(str(path)).rubric.made_up["rate"].quotient == (1, "by")
    else:
        (fault,) = faults(path)
        assert fault.startswith(
            'lab.yaml:6: made_up.rate.quotient: "by" may be 0: divide by a number, or a value'
        )


def test_only_numbers_above_are_counted_with(tmp_path: Path) -> None:
    path = making_up(tmp_path, f"{{word: {{letters: 4}}, twice: {{product: [word, 2]}}, rate: {RATE}}}")
    assert 'lab.yaml:6: made_up.twice.product: "word" is not a number' in faults(path)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            "_rate",
            "{made_up: rat}",
            'start[0].args[0]: made_up declares no value "rat" (did you mean "rate"?)',
        ),
        (
            "title: The talker runs",
            'title: "At {made_up: rate} Hz"',
            "criteria[0].title: made-up values belong in",
        ),
        (
            "title: The talker in real time",
            'title: "{made_up: rate}"',
            "scenarios.real.title: made-up values belong in",
        ),
        ("{made_up: rate}", "5", "made_up.rate: is used nowhere: remove it, or use it"),
        ("rate_hz: 10}", "rate_hz: {made_up: rat}}", 'made_up declares no value "rat"'),
        (
            "topic: /chatter,",
            "topic: {made_up: rate},",
            "topic: must be text, not 5: put it in quotes (made up: rate)",
        ),
    ],
)
def test_faulty_places(old: str, new: str, fault: str, tmp_path: Path) -> None:
    path = making_up(tmp_path, f"{{rate: {RATE}}}")
    text = path.read_text(encoding="utf-8").replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    assert fault in "\n".join(faults(path))


@pytest.mark.parametrize(
    ("declared", "fault"),
    [
        ("{from: 0, to: 9}", "with.rate_hz: must be more than 0, not 0"),
        ("{one_of: [5, five, 7]}", 'with.rate_hz: must be a number, not "five"'),
        ("{from: 6, to: 40}", "until.window_s: 40 s can never pass within limit_s, 30 s"),
    ],
)
def test_both_ends_and_every_choice_have_to_fit(declared: str, fault: str, tmp_path: Path) -> None:
    rate = "rate_hz: {made_up: rate}"
    window = "window_s: {made_up: rate}, limit_s: 30" if "40" in declared else "window_s: 5"
    path = making_up(
        tmp_path, f"{{rate: {declared}}}", ("rate_hz: 10}", f"{rate}}}"), ("window_s: 5", window)
    )
    (found,) = [one for one in faults(path) if "made up" in one]
    assert found.endswith(f"{fault} (made up: rate)")


def test_programs_have_to_get_what_a_criterion_asks_for(tmp_path: Path) -> None:
    path = making_up(
        tmp_path,
        f"{{rate: {RATE}, other: {RATE}, twice: {{product: [rate, 2]}}, more: {{sum: [other, 1]}}}}",
        ("rate_hz: 10}", "rate_hz: {made_up: twice}}"),
        ("rate_hz: 10\n", "rate_hz: {made_up: more}\n"),
    )
    assert faults(path) == [
        'lab.yaml:26: criteria[1].with.rate_hz: real gives programs no "more": they could not know it'
    ]


def test_editors_accept_made_up_values(tmp_path: Path) -> None:
    validator = Draft202012Validator(rubric_schema())
    examples = Path("rubrics/examples")
    for path in (examples / "params-and-namespaces.yaml", examples / "service-client.yaml"):
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert data["made_up"]
        assert [error.message for error in validator.iter_errors(data)] == []
    making_up(tmp_path, f"{{rate: {RATE}}}", ("rate_hz: 10}", "rate_hz: {made_up: rate}}"))
    data = yaml.safe_load((tmp_path / "lab.yaml").read_text(encoding="utf-8"))
    assert validator.is_valid(data)
    data["criteria"][0]["points"] = {"made_up": "rate"}
    assert not validator.is_valid(data)


# --- Judged -----------------------------------------------------------------------------------------------------------


def runs_of(rate_hz: float, metadata: dict[str, str]) -> Any:
    topic = {"topic": "/chatter", "rate_hz": rate_hz, "count": int(6 * rate_hz)}
    talker = {"name": "talker", "nodes": ["/talker"], "stopped_by": "INT", "exit_code": 0, "exit_s": 6.8}
    run = {"topics": [topic], "processes": [talker], "metadata": metadata}
    return build_runs({"runs": {"real": run}, "package": {}})


def test_evidence_is_judged_by_the_values_that_it_was_recorded_with(tmp_path: Path) -> None:
    lab = with_rate(tmp_path).rubric
    for rate in (6, 19):
        runs = runs_of(rate, {"made_up": json.dumps({"rate": rate, "gone": 3}), "submission.digest": "x"})
        first, other = judge(lab, runs)
        assert (first.status, first.made_up) == (Status.PASS, {"rate": rate})
        assert (other.status, other.made_up) == (Status.FAIL, {"rate": rate})
        placed = with_recorded_values(lab, runs)
        assert placed.values == {"rate": rate}
        digest = placed.scenarios["real"].digest
        fitting = runs_of(rate, {"made_up": f'{{"rate": {rate}}}', "scenario.digest": digest})
        assert "real" in fitting_runs(lab, fitting)
        others = runs_of(rate, {"made_up": '{"rate": 7}', "scenario.digest": digest})
        assert "real" not in fitting_runs(lab, others)


def test_a_value_of_the_programs_own_is_named_as_the_cause(tmp_path: Path) -> None:
    lab = with_rate(tmp_path).rubric
    wrong, _ = judge(lab, runs_of(7, {"made_up": '{"rate": 14}'}))
    assert wrong.status is Status.FAIL
    told = "<rate> is made up for each submission, 14 here, and comes with the argument _rate:=14"
    assert wrong.hint.endswith(f"; {told}")
    assert "rospy.Rate(<rate>)" in wrong.hint
    assert "rospy.Rate(14)" not in wrong.hint
    _, fixed = judge(lab, runs_of(14, {"made_up": '{"rate": 14}'}))
    assert fixed.status is Status.FAIL
    assert "made up" not in fixed.hint, "10 Hz is asked for, and no one makes that up"


def test_a_value_that_the_program_has_got_is_not_the_cause(tmp_path: Path) -> None:
    lab = with_values(with_rate(tmp_path).rubric, {"rate": 14})
    (criterion, _) = lab.criteria
    told = "; <rate> is made up for each submission, 14 here, and comes with the argument _rate:=14"
    for hint, seen, words in (
        (
            "write 14 on line 14, 14.5 or v14: (14)",
            "10 Hz",
            "write <rate> on line 14, 14.5 or v14: (<rate>)" + told,
        ),
        ("write 14", "a: 10, b: 14", "write 14"),
        ("", "114 and 14.2", told.removeprefix("; ")),
    ):
        assert tell_made_up(lab, criterion, hint, seen) == words


@pytest.mark.parametrize("recorded", ['{"rate": "fast"}', '{"rate": -5}', "[1]", "{"])
def test_values_that_do_not_fit_the_rubric_are_said_to_be_so(recorded: str, tmp_path: Path) -> None:
    path = making_up(tmp_path, f"{{rate: {RATE}}}", ("window_s: 5", "window_s: {made_up: rate}"))
    with pytest.raises(EvidenceError, match="do not fit the rubric"):
        judge(load_rubric(str(path)).rubric, runs_of(10, {"made_up": recorded}))


def test_reports_name_the_values_of_the_criteria_that_they_show() -> None:
    shown = criterion("rate", Status.PASS, 40, 40, made_up={"rate": 14, "on": True})
    hidden = criterion("more", Status.FAIL, 0, 60, made_up={"secret": "xvbq"})
    whole = made_result("ada", (shown, hidden))
    words = "Values chosen at random for this submission: rate = 14, on = true"
    assert made_up_words(whole) == (f"{words}, secret = xvbq",)
    assert made_up_words(for_student(whole, frozenset({"more"}))) == (words,)
    assert words in render_markdown(whole, rubric()).replace("`", "")
    assert words in render_html(whole, rubric())
    assert words in render_terminal(whole, rubric()).replace("\n", " ")
    criteria = json.loads(result_bytes(whole))["criteria"]
    assert criteria[0]["made_up"] == {"rate": 14, "on": True}
    assert made_up_words(made_result("bob", (shown.model_copy(update={"made_up": {}}),))) == ()


def test_a_quotient_is_told_as_verdicts_show_it(tmp_path):
    declared = "{by: {one_of: [3, 7]}, rate: {quotient: [50, by]}}"
    path = making_up(tmp_path, declared, ("rate_hz: 10}", "rate_hz: {made_up: rate}}"))
    lab = with_values(load_rubric(str(path)).rubric, {"by": 3, "rate": 50 / 3})
    (criterion, _) = lab.criteria
    told = tell_made_up(lab, criterion, "write 16.66667 there", "10 Hz")
    assert told.startswith("write <rate> there; <rate> is made up for each submission, 16.66667 here, and ")
    assert tell_made_up(lab, criterion, "write it", "16.66667 Hz") == "write it"
