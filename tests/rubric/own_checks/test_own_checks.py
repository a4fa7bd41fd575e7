"""An instructor's file of checks: it takes part in everything, prints nothing raw; its faults have file and line."""

from __future__ import annotations

import io
import json
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import jsonschema
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from grader.checks import CHECKS
from grader.cli.main import run as grader
from grader.errors import RubricError
from grader.judging import judge
from grader.model.verdict import Status
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.own_checks import VisibleText, printing_to_stderr
from grader.rubric.schema import rubric_schema
from tests.report.nasty import STEERING, TEXTS, TO_A_CI
from tests.rubric.own_checks.samples import GREETING, HEAD, OWN, judged, runs, write_rubric


def faults(path: Path) -> list[str]:
    with pytest.raises(RubricError) as caught:
        load_rubric(str(path))
    return [fault.replace(f"{path.parent}/", "") for fault in caught.value.faults]


def body(lines: str) -> str:
    """The sample with its check's last lines replaced."""
    head = GREETING.partition("    texts = ")[0]
    return head + "".join(f"    {line}\n" for line in lines.splitlines())


def test_a_check_of_ones_own_judges(tmp_path):
    path = write_rubric(tmp_path, OWN, checks=GREETING)
    assert judged(path)["own"].status is Status.PASS
    rude = runs(topics=[{"topic": "/chatter", "count": 3, "values": ["hello", "what?"]}])
    result = judged(path, rude)["own"]
    assert (result.status, result.message, result.hint, result.points) == (Status.FAIL, "rude", "greet", 0)


def test_the_graders_own_registry_stays_as_it_is(tmp_path):
    before = dict(CHECKS)
    load_rubric(str(write_rubric(tmp_path, OWN, checks=GREETING)))
    assert before == CHECKS


def test_two_rubrics_may_use_one_name(tmp_path):
    first = write_rubric(tmp_path / "a", OWN, checks=GREETING)
    second = write_rubric(tmp_path / "b", OWN, checks=GREETING.replace('"polite"', '"kind"'))
    loaded = [load_rubric(str(path)) for path in (first, second)]
    messages = [judge(one.rubric, runs(), one.checks)[0].message for one in loaded]
    assert messages == ["polite", "kind"]


def test_nothing_is_left_beside_the_rubric(tmp_path):
    judged(write_rubric(tmp_path, OWN, checks=GREETING))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lab.yaml", "my_checks.py"]


def test_nothing_to_judge_is_blocked_by_what_explains_it(tmp_path):
    criteria = OWN.replace("points: 100", "points: 50, requires: [type]") + (
        "  - {id: type, title: t, points: 50, check: topic-type, scenario: talker,\n"
        "     with: {topic: /chatter, type: std_msgs/String}}\n"
    )
    results = judged(write_rubric(tmp_path, criteria, checks=GREETING), runs(topics=[]))
    assert (results["type"].status, results["own"].status) == (Status.FAIL, Status.BLOCKED)


def test_the_digest_is_of_both_files(tmp_path):
    path = write_rubric(tmp_path, OWN, checks=GREETING)
    first = load_rubric(str(path)).digest
    assert load_rubric(str(path)).digest == first
    (tmp_path / "my_checks.py").write_text(GREETING + "\n")
    assert load_rubric(str(path)).digest != first


def test_parameters_are_validated(tmp_path):
    criteria = OWN.replace("{word: hello}", "{words: hello, times: x}")
    assert faults(write_rubric(tmp_path, criteria, checks=GREETING)) == [
        "lab.yaml:13: criteria[0].with.word: is missing",
        'lab.yaml:13: criteria[0].with.times: must be a whole number, not "x"',
        'lab.yaml:13: criteria[0].with.words: is not known here (did you mean "word"?)',
    ]


def test_a_misspelt_check_of_ones_own_is_known(tmp_path):
    path = write_rubric(tmp_path, OWN.replace("check: greeting", "check: greetin"), checks=GREETING)
    assert faults(path) == [
        'lab.yaml:13: criteria[0].check: there is no check "greetin" (did you mean "greeting"?)'
    ]


BROKEN = '''\
from grader.checks import Run, check, passed

@check("rate")
def rate(run: Run):
    """Taken."""

@check("one")
def one(run: Run, speed, colour):
    """Unknown facts."""

@check("two")
def two(run: Run):
    return passed("")

@check("one-more", params=dict)
def three(run: Run):
    """Params."""

@check("Four")
def four(run: Run):
    """Name."""

@check("twice")
def five():
    """First."""

@check("twice")
def six():
    """Second."""

1 / 0
'''


def test_all_faults_of_the_file_come_with_those_of_the_rubric(tmp_path):
    criteria = OWN.replace("points: 100", "points: 90") + (
        "  - {id: b, title: b, points: 0, check: ratee, scenario: talker}\n"
    )
    found = faults(write_rubric(tmp_path, criteria, checks=BROKEN))
    assert found == [
        "lab.yaml:12: criteria: the points add up to 90, not to 100",
        'lab.yaml:14: criteria[1].check: there is no check "ratee" (did you mean "rate"?)',
        'my_checks.py:3: check "rate": the grader itself has a check of that name',
        (
            'my_checks.py:7: check "one": there is no fact speed, colour; '
            "a check can ask for package, build, run, evidence, params"
        ),
        'my_checks.py:11: check "two": has no docstring: its first line is the title that a student reads',
        'my_checks.py:15: check "one-more": params must be a class derived from Record',
        'my_checks.py:19: check "Four": a name is lower-case letters, digits and hyphens, beginning with a letter',
        'my_checks.py:27: check "twice": is registered twice',
        "my_checks.py:31: ZeroDivisionError: division by zero",
    ]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("x = 1\ndef f(:\n", "my_checks.py:2: invalid syntax"),
        ("import nowhere\n", "my_checks.py:1: ModuleNotFoundError: No module named 'nowhere'"),
        ("import sys\n\nsys.exit('no')\n", "my_checks.py:3: SystemExit: no"),
        ("", "my_checks.py:1: registers no check: decorate functions with @check(…), from grader.checks"),
        ("# -*- coding: klingon -*-\n", "my_checks.py:1: unknown encoding: klingon"),
        ("def f():\n    raise ValueError('a\\nb')\n\nf()\n", "my_checks.py:2: ValueError: a"),
    ],
)
def test_a_file_that_cannot_be_run(tmp_path, text, fault):
    assert faults(write_rubric(tmp_path, OWN, checks=text)) == [fault]


@pytest.mark.parametrize("name", ["../my_checks.py", "/etc/x.py", "my_checks.txt", "a/../../b.py"])
def test_the_file_lies_beside_the_rubric(tmp_path, name):
    path = write_rubric(tmp_path, OWN, head=f"{HEAD}checks: {name}\n")
    assert faults(path) == [
        "lab.yaml:6: checks: must name a Python file beside the rubric, like my_checks.py"
    ]


def test_a_file_that_is_not_there(tmp_path):
    path = write_rubric(tmp_path, OWN, head=f"{HEAD}checks: my.py\n")
    assert faults(path) == [
        "lab.yaml:6: checks: my.py cannot be read beside the rubric: No such file or directory"
    ]


@pytest.mark.parametrize(
    ("lines", "hint"),
    [
        ("return run.nothing", "AttributeError: 'Run' object has no attribute 'nothing'"),
        ("return True", "TypeError: it returned bool, not a verdict"),
        ("from grader.checks import partial\nreturn partial(2, '')", "ValueError: its score is 2"),
        ("import sys\nsys.exit(0)", "RuntimeError: it called sys.exit"),
    ],
)
def test_a_broken_check_costs_no_mark_and_names_its_line(tmp_path, lines, hint):
    result = judged(write_rubric(tmp_path, OWN, checks=body(lines)))["own"]
    assert (result.status, result.message.endswith("this costs no marks")) == (Status.ERROR, True)
    assert hint in result.hint
    assert result.hint.startswith("for the instructor: my_checks.py")


def test_a_run_that_is_not_there_is_open(tmp_path):
    text = GREETING.replace("package: PackageFacts, run: Run,", "evidence,").replace(
        "run.stu", 'evidence["other"].stu'
    )
    result = judged(write_rubric(tmp_path, OWN, checks=text))["own"]
    assert (result.status, result.message) == (Status.INCONCLUSIVE, "the scenario 'other' was not run")


def test_what_it_prints_does_not_spoil_the_json(tmp_path, capsys):
    text = "print('loading')\n" + body("print('judging')\nreturn passed('')").replace(
        "from __future__ import annotations\n", ""
    )
    path = write_rubric(tmp_path, OWN, checks=text)
    recordings = Path(__file__).parent.parent.parent / "data" / "recordings" / "correct"
    assert grader(["judge", str(recordings), "--rubric", str(path)]) == 0
    shown = capsys.readouterr()
    assert json.loads(shown.out)[0]["status"] == "pass"
    assert "judging" in shown.err


@pytest.mark.full
def test_the_schema_offers_it(tmp_path, capsys):
    path = write_rubric(tmp_path, OWN, checks=GREETING)
    assert grader(["rubric", "schema", "--rubric", str(path)]) == 0
    schema = json.loads(capsys.readouterr().out)
    data = yaml.safe_load(path.read_text())
    jsonschema.validate(data, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, rubric_schema())
    data["criteria"][0]["with"] = {"word": 5}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, schema)


def test_it_is_explained(tmp_path, capsys):
    path = write_rubric(tmp_path, OWN, checks=GREETING)
    for argv in (["greeting", "--rubric", str(path)], [f"{path}/own"], ["own", "--rubric", str(path)]):
        assert grader(["explain", *argv]) == 0
        shown = capsys.readouterr().out
        assert "greeting: Every message begins with a greeting." in shown
        assert "The first word." in shown
    assert grader(["explain", "greeting"]) == 2


def _in_worker(loaded: LoadedRubric) -> list[str]:
    return [f"{c.status.value}: {c.message}" for c in judge(loaded.rubric, runs(), loaded.checks)]


@pytest.mark.full
def test_it_works_in_a_process_of_its_own(tmp_path):
    loaded = load_rubric(str(write_rubric(tmp_path, OWN, checks=GREETING)))
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert pool.submit(_in_worker, loaded).result(60) == ["pass: polite"]


@given(st.lists(TEXTS, max_size=6))
def test_pieces_that_are_harmless_alone_are_harmless_together(pieces):
    out = io.StringIO()
    shown = VisibleText(out)
    for piece in pieces:
        assert shown.write(piece) == len(piece)
    shown.finish()
    assert STEERING.search(out.getvalue()) is None
    assert TO_A_CI.search(out.getvalue()) is None


def test_a_line_without_an_end_does_not_fill_the_memory():
    out = io.StringIO()
    shown = VisibleText(out)
    for _ in range(300):
        shown.write("x" * 1000)
    assert len(out.getvalue()) > 250_000


def test_both_streams_go_to_stderr_also_where_the_check_fails(capsys):
    def check() -> None:
        with printing_to_stderr():
            print("loading \x1b[2J")
            sys.stderr.write(":")
            sys.stderr.write(":error::x")
            raise ValueError

    with pytest.raises(ValueError, match=r"^$"):
        check()
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "loading \\x1b[2J\n\\x3a:error::x\n"
