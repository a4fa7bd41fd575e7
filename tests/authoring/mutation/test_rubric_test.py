"""The test of a rubric with gradings that are made up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from grader.authoring.mutation import rubric_test
from grader.authoring.mutation.faulty_packages import Planned, plan_all
from grader.authoring.mutation.rubric_test import Comparison, Plan, compare, find_lost, run_test
from grader.authoring.mutation.solution import Solution
from grader.classes.batch.job import FolderJob, GradedSubmission
from grader.errors import HostError
from grader.model.mutants import Mutant
from grader.model.result import CriterionResult, Silence
from grader.rubric.load import load_rubric
from tests.authoring.mutation.samples import tree_of
from tests.report.hostile import result
from tests.rubric.samples import spoiled
from tests.support.a_class import criterion

SCRIPT = "#!/usr/bin/env python\nimport rospy\nrospy.init_node('talker')\nrospy.spin()\n"
Statuses = dict[str, str]


@dataclass
class Lab:
    """A rubric with two criteria, and a grader that says what `judged` wants."""

    folder: Path
    judged: Callable[[FolderJob], Statuses | str]
    calls: list[tuple[str, int]] = field(default_factory=list)

    def plan(self, only: str = "bit-removed", **changes: object) -> Plan:
        solution = Solution(tree=tree_of({"lab1/src/talker.py": SCRIPT}, ""), folder="lab1/", name="lab1")
        mutants = [m for m in plan_all(solution) if m.mutant.operators[0] in only.split()]
        data = {
            "rubric": load_rubric(str(spoiled(self.folder))),
            "solution": solution,
            "given": "x",
            "mutants": mutants,
            "jobs": 3,
            "out": self.folder / "out",
            "keep_all": False,
        }
        return Plan(**{**data, **changes})

    def grade_all(self, jobs, side_by_side, begun) -> Iterator[GradedSubmission]:
        for job in jobs:
            begun(job.name)
            self.calls.append((job.name, side_by_side))
            assert (job.source / "lab1/src/talker.py").is_file()
            assert self.folder not in job.source.parents
            (job.out / job.name / "evidence").mkdir(exist_ok=True, parents=True)
            yield self.graded(job)

    def graded(self, job: FolderJob) -> GradedSubmission:
        judged = self.judged(job)
        if isinstance(judged, str):
            return GradedSubmission(name=job.name, result=None, error=judged)
        points = {"talker-node": 40, "chatter-rate": 60, "advice": 0}
        statuses = {"talker-node": "pass", "chatter-rate": "pass", **judged}
        found = tuple(criterion(name, status, 0, points[name]) for name, status in statuses.items())
        return GradedSubmission(name=job.name, result=result(criteria=found))


@pytest.fixture
def lab(tmp_path, monkeypatch):
    made = Lab(tmp_path, lambda job: {} if job.name == "reference" else {"talker-node": "fail"})
    monkeypatch.setattr(rubric_test, "grade_all", made.grade_all)
    return made


def costing(mutants: list[Planned], **costs: str) -> list[Planned]:
    named = {name.replace("_", "-"): status for name, status in costs.items()}
    return [
        Planned(name=m.name, label=m.label, mutant=m.mutant, tree=m.tree, costs=named)
        for m in mutants
    ]  # fmt: skip


def test_all_killed(lab):
    plan = lab.plan("bit-removed crlf", partial=True)
    test = run_test(plan, Silence())
    assert test.passed
    assert [m.state for m in test.mutants] == ["killed", "killed"]
    assert lab.calls == [("reference", 1), *((m.name, 3) for m in plan.mutants)]
    assert list(plan.out.iterdir()) == []


def test_a_criterion_that_no_mutant_costs_is_a_weakness(lab):
    test = run_test(lab.plan(), Silence())
    assert test.uncosted == ("chatter-rate",)
    assert not test.passed


def test_a_survivor_is_kept_with_its_diff(lab):
    lab.judged = lambda _job: {}
    plan = lab.plan()
    test = run_test(plan, Silence())
    (mutant,) = test.mutants
    assert mutant.state == "survived"
    assert mutant.evidence == str(plan.out / mutant.name)
    assert (plan.out / mutant.name / "mutant.diff").read_text() == mutant.diff
    assert "old mode 100755" in mutant.diff
    assert (plan.out / mutant.name / "source/lab1/src/talker.py").read_text() == SCRIPT
    assert not test.passed
    assert not (plan.out / "reference").exists()


def test_all_is_kept_where_the_user_names_a_folder(lab):
    plan = lab.plan(keep_all=True)
    run_test(plan, Silence())
    assert sorted(p.name for p in plan.out.iterdir()) == ["bit-removed-src-talker.py", "reference"]


def test_a_reference_solution_that_loses_points_ends_the_test(lab):
    lab.judged = lambda _job: {"chatter-rate": "fail"}
    plan = lab.plan()
    test = run_test(plan, Silence())
    assert [c.id for c in test.reference.lost] == ["chatter-rate"]
    assert (test.mutants, test.uncosted, test.passed) == ((), None, False)
    assert test.reference.evidence == str(plan.out / "reference")
    assert [name for name, _ in lab.calls] == ["reference"]


@pytest.mark.parametrize(
    "judged", [{"chatter-rate": "inconclusive"}, {"chatter-rate": "error"}, "no disk left"]
)
def test_a_machine_that_cannot_judge_the_reference_says_so(judged, lab):
    lab.judged = lambda _job: judged
    with pytest.raises(HostError, match="the reference solution could not be"):
        run_test(lab.plan(), Silence())


def test_advice_that_the_reference_gets_too_counts_for_nothing(lab):
    lab.judged = lambda job: {
        "advice": "fail",
        **({} if job.name == "reference" else {"talker-node": "fail"}),
    }
    plan = lab.plan(partial=True)
    test = run_test(
        Plan(**{**vars(plan), "mutants": costing(list(plan.mutants), talker_node="fail")}), Silence()
    )
    assert test.passed
    assert [c.id for c in test.mutants[0].lost] == ["talker-node"]


def test_declared_costs_are_compared(lab):
    plan = lab.plan(partial=True)
    test = run_test(
        Plan(**{**vars(plan), "mutants": costing(list(plan.mutants), chatter_rate="fail", gone="fail")}),
        Silence(),
    )
    (mutant,) = test.mutants
    assert mutant.state == "differs"
    assert mutant.missing == ("chatter-rate", "gone (the rubric has no such criterion)")
    assert mutant.surplus == ("talker-node",)


def test_what_is_inconclusive_is_graded_once_more_alone(lab):
    seen: list[str] = []

    def judged(job: FolderJob) -> Statuses:
        seen.append(job.name)
        if job.name == "reference":
            return {}
        return {"talker-node": "fail" if seen.count(job.name) > 1 else "inconclusive"}

    lab.judged = judged
    plan = lab.plan("bit-removed crlf", partial=True)
    test = run_test(plan, Silence())
    assert test.passed
    assert lab.calls[3:] == [(m.name, 1) for m in plan.mutants]


def test_what_stays_inconclusive_or_cannot_be_graded_is_not_killed(lab):
    lab.judged = lambda job: (
        {}
        if job.name == "reference"
        else "no room"
        if "crlf" in job.name
        else {"talker-node": "inconclusive"}
    )
    plan = lab.plan("bit-removed crlf", partial=True)
    test = run_test(plan, Silence())
    assert [m.state for m in test.mutants] == ["inconclusive", "error"]
    assert test.mutants[1].error == "no room"
    assert not test.passed
    assert len(lab.calls) == 4


def test_launch_files_go_first_for_they_wait_longest(tmp_path, lab):
    launch = '<launch><node name="a" pkg="lab1" type="talker.py"/></launch>'
    tree = tree_of({"lab1/src/talker.py": SCRIPT, "lab1/a.launch": launch})
    solution = Solution(tree=tree, folder="lab1/", name="lab1")
    found = {m.mutant.operators[0]: m for m in plan_all(solution)}
    mutants = [found["crlf"], found["launch-malformed"]]
    test = run_test(lab.plan(solution=solution, mutants=mutants, partial=True), Silence())
    assert [name for name, _ in lab.calls][1:] == ["launch-malformed-a.launch", "crlf-src-talker.py"]
    assert [m.operator for m in test.mutants] == ["crlf", "launch-malformed"]


def criteria(**statuses: str) -> list[CriterionResult]:
    return [criterion(name, status, 0, 5, message=f"about {name}") for name, status in statuses.items()]


@pytest.mark.parametrize(
    ("expected", "found", "state", "differences"),
    [
        ({"a": "fail"}, {"a": "fail", "b": "pass"}, "killed", ((), (), ())),
        ({"a": "fail", "b": "blocked"}, {"a": "fail", "b": "blocked"}, "killed", ((), (), ())),
        ({"a": "fail"}, {"a": "pass", "b": "pass"}, "survived", (("a",), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "fail"}, "differs", ((), ("b",), ())),
        ({"a": "fail"}, {"a": "pass", "b": "fail"}, "differs", (("a",), ("b",), ())),
        ({"a": "fail"}, {"a": "partial"}, "differs", ((), (), ("a is partial, not fail",))),
        ({"a": "fail"}, {"a": "blocked"}, "differs", ((), (), ("a is blocked, not fail",))),
        ({"a": "fail"}, {"b": "pass"}, "survived", (("a (the rubric has no such criterion)",), (), ())),
        ({"a": "fail", "b": "fail"}, {"b": "fail"}, "differs", (("a (the rubric has no such criterion)",), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "inconclusive"}, "inconclusive", ((), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "error"}, "inconclusive", ((), (), ())),
        ({"a": "fail"}, {"a": "fail", "b": "manual"}, "killed", ((), (), ())),
        (None, {"a": "pass", "b": "partial"}, "killed", ((), (), ())),
        (None, {"a": "pass", "b": "pass"}, "survived", ((), (), ())),
    ],
)  # fmt: skip
def test_states(expected, found, state, differences):
    """The differences are what is missing, what is too much, and what has another status."""
    compared = compare(expected, criteria(**found))
    assert compared.state == state
    assert (compared.missing, compared.surplus, compared.differing) == differences


def test_advice_that_the_reference_gets_too_is_no_loss():
    found = criteria(a="fail", advice="fail")
    assert compare({"a": "fail"}, found, {"advice"}).state == "killed"
    assert [c.id for c in find_lost(found, {"advice"})] == ["a"]


def test_advice_alone_kills_no_mutant():
    found = [*criteria(a="pass"), criterion("advice", "fail", 0, 0, message="about advice")]
    assert compare(None, found).state == "survived"
    assert compare(None, [*found, *criteria(b="blocked")]).state == "killed"


def test_a_person_gives_no_points_away():
    assert find_lost(criteria(a="pass", b="manual")) == ()


@pytest.mark.parametrize(
    ("words", "differing"),
    [
        ({"says": {"a": ("Rate(1)", "too  fast")}}, ()),
        ({"says": {"a": ("flooded",)}}, ("a does not say 'flooded': too fast use rospy.rate(1)",)),
        ({"never_says": ("rospy.Rate",)}, ("a says 'rospy.Rate': too fast use rospy.rate(1)",)),
        ({"never_says": {"b": ("rospy.Rate",)}}, ()),
        ({"points": 92.5}, ()),
        ({"points": 95}, ("it gets 92.5 points, not 95",)),
    ],
)
def test_words_of_the_report_are_compared(words, differing):
    mutant = Mutant.model_validate({"edits": ({"crlf": {"file": "x"}},), "expect": {"a": "fail"}, **words})
    (found,) = criteria(a="fail")
    found = found.model_copy(update={"message": "Too fast", "measured": "", "hint": "use rospy.Rate(1)"})
    compared = Comparison(state="killed").with_words(mutant, result(criteria=(found,), points=92.5))
    assert compared.differing == differing
    assert compared.state == ("differs" if differing else "killed")
