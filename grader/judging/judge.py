"""From evidence and rubric to criteria: run the checks, find what blocks what, award the points.

`judge_files` judges what a package's files alone decide, before anything is built or run.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from graphlib import TopologicalSorter
from pathlib import PurePath
from traceback import extract_tb
from types import MappingProxyType
from typing import Any, NamedTuple, cast

from grader.checks import CHECKS, Check
from grader.checks.build import explain_by_build
from grader.checks.registry import NotRecorded
from grader.checks.support.absent_parameters import explain_by_absent_parameter
from grader.checks.support.exit_causes import explain_by_exception
from grader.checks.support.launch import explain_by_refused_launch
from grader.checks.support.launch_connections import explain_by_late_remap
from grader.checks.support.launch_slips import explain_by_lacking_program
from grader.checks.support.parameters import (
    explain_by_given_value,
    explain_by_misplaced_parameter,
    explain_by_overwritten_parameter,
    explain_by_unread_parameter,
)
from grader.checks.support.processes import plain_type
from grader.checks.support.recorder_losses import account_for_losses
from grader.checks.support.scripts import without_git
from grader.checks.support.text import near_names, texts_in
from grader.checks.support.topics import (
    SYSTEM_TOPICS,
    explain_by_unheard_topic,
)
from grader.checks.support.wrong_lines import (
    explain_by_misplaced_value,
    explain_by_waiting_callback,
    explain_by_wrong_value,
)
from grader.errors import EvidenceError
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.run import Run
from grader.judging.cited_lines import (
    cite_commented_call,
    cite_find,
    cite_name,
    cite_quoted,
    cite_source,
    cite_unused_argument,
    cite_word_of_call,
    show_lines,
)
from grader.judging.facts import NOT_RUN, Facts, is_other_rate, try_facts, views_of
from grader.judging.hint_additions import (
    add_advice,
    allow_typing,
    choose_hint_language,
    compile_command,
    fill_slots,
    keep_other_names,
    lab_names,
    name_connections,
    name_other_imports,
    name_other_lines,
    name_other_parameters,
    name_rospy,
    name_same_file,
    with_lab_names,
    with_own_name,
)
from grader.judging.later_faults import add_later_faults
from grader.judging.repeats_and_repairs import (
    SplitRuns,
    apply_repaired_copy,
    drop_unrepeated_losses,
    launched_in,
    needs_build,
    repairs_of,
    split_runs,
    was_built,
)
from grader.judging.requirements import Requirements, charge_once
from grader.judging.summary import leave_out, name_unchanged_files, round_half_up
from grader.model.package import PackageFacts
from grader.model.result import CriterionResult, EarlyVerdict, Repaired
from grader.model.verdict import Status, Verdict, inconclusive, share_text
from grader.rubric.made_up import Value, tell_made_up, values_of, with_recorded_values
from grader.rubric.model import Criterion, Rubric

MANUAL = "manual"


def judge(
    rubric: Rubric,
    runs: Mapping[str, Run],
    checks: Mapping[str, Check] = CHECKS,
    handed_out: Collection[str] = (),
) -> tuple[CriterionResult, ...]:
    """Return every criterion in the rubric's order. `runs` maps scenarios, and `package`, to their recorded runs.

    `checks` are the grader's and the rubric's own (`LoadedRubric.checks`), `handed_out` the sha256 of the starter's
    files (`LoadedRubric.handed_out`). The same evidence and rubric always give
    equal results; nothing that is wrong with the evidence raises, but EvidenceError where values that were made up for
    the runs do not fit the rubric.
    """
    return judge_all_runs(rubric, runs, checks, handed_out).criteria


class Judgement(NamedTuple):
    """The criteria in the rubric's order."""

    criteria: tuple[CriterionResult, ...]
    doubtful: frozenset[str]
    """The scenarios whose losses one run's timing could have made."""
    undecided: frozenset[str]
    """The scenarios that left a criterion inconclusive, for no lack of the machine's."""
    doubtful_on_copy: frozenset[str] = frozenset()
    """Of the repaired copy: the scenarios whose losses its one run's timing could have made."""


def judge_all_runs(
    rubric: Rubric,
    runs: Mapping[str, Run],
    checks: Mapping[str, Check] = CHECKS,
    handed_out: Collection[str] = (),
) -> Judgement:
    """Judge the first runs, then what repeated runs and a repaired copy say besides."""
    split = split_runs(runs)
    first, repeated, doubtful_on_copy = split.first, split.repeated, frozenset[str]()
    facts = _facts_as_recorded(rubric, runs, first)
    rubric = facts.rubric
    verdicts = judge_facts(rubric, facts, checks)
    doubtful = frozenset(c.scenario for c in rubric.criteria if verdicts[c.id].basis.timing and c.scenario)
    if repeated:
        again = judge_facts(rubric, try_facts(rubric, {**first, **repeated}), checks)
        verdicts = drop_unrepeated_losses(rubric, verdicts, again, repeated.keys())
    if split.repaired:
        of_copy = try_facts(rubric, {**first, **split.repaired})
        on_copy = judge_facts(rubric, of_copy, checks)
        doubtful_on_copy = _doubtful_on_copy(rubric, verdicts, on_copy) & split.repaired.keys()
        if later := split.repaired_again:
            again = judge_facts(rubric, try_facts(rubric, {**first, **split.repaired, **later}), checks)
            on_copy = drop_unrepeated_losses(rubric, on_copy, again, later.keys())
        verdicts, uses = _with_repaired_copy(facts, of_copy, verdicts, on_copy, split)
    else:
        verdicts, uses = add_later_faults(charge_once(rubric, verdicts), rubric, facts), {}
    shown = {
        c.id: _without_git(_with_cited_lines(verdicts[c.id], c, facts, uses.get(c.id)), facts.package)
        for c in rubric.criteria
    }
    names = lab_names(rubric, {i for i, v in shown.items() if v.status.is_lost}, facts.package)
    package = facts.package
    told = {i: with_lab_names(verdict, names) for i, verdict in shown.items()}
    results = tuple(
        result_of(
            c,
            told[c.id],
            rubric.digits,
            repaired=uses.get(c.id),
            made_up=values_of(rubric, c),
            package=package,
        )
        for c in rubric.criteria
    )
    # Last, when all hints have their final words: advice that one of them has is left out.
    if package is not None:
        named = (name_unchanged_files(result, rubric, package, handed_out) for result in results)
        results = add_advice([with_own_name(one, rubric, package) for one in named], package, rubric)
    undecided = _undecided(rubric, shown)
    return Judgement(leave_out(rubric, results), doubtful, undecided, doubtful_on_copy)


def _doubtful_on_copy(
    rubric: Rubric, verdicts: Mapping[str, Verdict], on_copy: Mapping[str, Verdict]
) -> frozenset[str]:
    """Return the scenarios whose losses one run of the copy could have made; what the first run lost in this way too
    has been seen twice."""

    def may_be_late(verdict: Verdict) -> bool:
        return verdict.basis.timing and verdict.status is not Status.BLOCKED

    names = (c for c in rubric.criteria if may_be_late(on_copy[c.id]) and not may_be_late(verdicts[c.id]))
    return frozenset(c.scenario for c in names if c.scenario)


def _undecided(rubric: Rubric, verdicts: Mapping[str, Verdict]) -> frozenset[str]:
    """Return the scenarios of the open criteria, without those that rest on what the machine lacks."""
    if all(verdict.status is not Status.INCONCLUSIVE for verdict in verdicts.values()):
        return frozenset()
    by_id, lacking = {c.id: c for c in rubric.criteria}, set[str]()
    for name in _in_order(rubric):
        is_open = verdicts[name].status is Status.INCONCLUSIVE
        if verdicts[name].basis.of_machine or (is_open and lacking.intersection(by_id[name].requires)):
            lacking.add(name)
    late = (
        c for c in rubric.criteria if verdicts[c.id].status is Status.INCONCLUSIVE and c.id not in lacking
    )
    return frozenset(c.scenario for c in late if c.scenario)


def _with_repaired_copy(
    facts: Facts,
    of_copy: Facts,
    verdicts: Mapping[str, Verdict],
    on_copy: Mapping[str, Verdict],
    runs: SplitRuns,
) -> tuple[dict[str, Verdict], dict[str, Repaired]]:
    """Return the verdicts with what the runs of a repaired copy say besides, and the repairs that criteria rest on."""
    rubric, first, repaired = facts.rubric, runs.first, runs.repaired
    repairs = repairs_of(rubric, repaired)
    # a build that goes on as far as what the machine lacks, or makes messages before a program does not compile, shows
    # what the repaired line kept from being made
    shows = was_built(repaired) or any(
        (v.basis.of_machine and verdicts[i].status.is_lost)
        or (verdicts[i].basis.unbuilt and not v.status.is_lost)
        for i, v in on_copy.items()
    )
    verdicts, uses = apply_repaired_copy(
        rubric,
        verdicts,
        on_copy,
        repairs,
        built=not needs_build(of_copy.package) or was_built(first) or not shows,
        builds=was_built(first),
        launched=launched_in(of_copy.package, of_copy.runs.get(PACKAGE_RUN)),
    )
    verdicts = charge_once(rubric, verdicts, uses)
    # what no repair helps still has all of its faults, and where none helps anything, all have
    as_it_is = add_later_faults(verdicts, rubric, facts)
    if not uses:
        return as_it_is, uses
    behind = add_later_faults(verdicts, rubric, of_copy, handed_in=facts.package, repairs=repairs)
    told = {i: behind[i] if i in uses or not v.basis.of_machine else as_it_is[i] for i, v in verdicts.items()}
    return told, uses


def _facts_as_recorded(rubric: Rubric, runs: Mapping[str, Run], first: Mapping[str, Run]) -> Facts:
    """Return the facts of the first runs. Their rubric has the values that were made up for all of them, and the
    package's own types by the name that it has."""
    facts = try_facts(with_recorded_values(rubric, runs), first)
    name = facts.package.name if facts.package is not None else None
    return replace(facts, rubric=facts.rubric.with_types_of(name)) if name else facts


def _with_cited_lines(verdict: Verdict, criterion: Criterion, facts: Facts, used: Repaired | None) -> Verdict:
    """Return the verdict with the lines of the package that it is about, and their text."""
    build = facts.runs.get(PACKAGE_RUN)
    if build is None or verdict.status is Status.PASS:
        return verdict
    package = facts.package_of(criterion)
    verdict = cite_quoted(verdict, criterion, facts, build)
    verdict = cite_source(verdict, criterion, facts, build, used.repairs if used else ())
    verdict = cite_unused_argument(verdict, criterion, facts, build)
    verdict = cite_commented_call(verdict, package, build)
    verdict = cite_word_of_call(verdict, build)
    verdict = cite_find(verdict, criterion, package, build)
    return show_lines(cite_name(verdict, build), build)


def _in_order(rubric: Rubric) -> Iterable[str]:
    # The rubric has no circles: `consistency.py` refuses them.
    return TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order()


def judge_facts(rubric: Rubric, facts: Facts, checks: Mapping[str, Check] = CHECKS) -> dict[str, Verdict]:
    """Return the verdict of each criterion by its id."""
    criteria = {c.id: c for c in rubric.criteria}
    requirements = Requirements(rubric, checks)
    for name in _in_order(rubric):
        verdict = _with_made_up(rubric, criteria[name], verdict_of(criteria[name], facts, checks))
        applied = requirements.apply(criteria[name], verdict)
        requirements.verdicts[name] = (
            _seen_elsewhere(rubric, criteria[name], applied, facts, checks) or applied
        )
    return requirements.verdicts


def _seen_elsewhere(
    rubric: Rubric, criterion: Criterion, verdict: Verdict, facts: Facts, checks: Mapping[str, Check]
) -> Verdict | None:
    """Return what is wrong besides with the messages of a topic that is missing, where they come on another topic;
    None where nothing is, or where it is not plain which topic that is."""
    root = next((c for c in rubric.criteria if c.id == verdict.blocked_by), None)
    run = facts.runs.get(criterion.scenario or "")
    topic = root.parameters.get("topic") if root is not None else None
    if run is None or not isinstance(topic, str) or criterion.parameters.get("topic") != topic:
        return None
    package = facts.package_of(criterion)
    asked = [s for s in package.slips if s.kind == "rate-number"] if package else []
    if criterion.check == "rate" and any(
        is_other_rate(one, float(str(criterion.parameters["rate_hz"]))) for one in asked
    ):
        return None  # the script tells it, however briefly the run was watched
    known = {text for one in rubric.criteria for text in texts_in(one.parameters)}
    sent = {c.topic: plain_type(c.type) for c in run.student_channels() if c.messages}
    others = [name for name in sent if name not in known | SYSTEM_TOPICS]
    wanted = str(root.parameters.get("type")) if root is not None else ""
    others = [name for name in others if sent[name] == wanted] or others
    if topic in sent or len(others) != 1 or near_names(topic, others):  # a slip is repaired on a copy
        return None
    elsewhere = criterion.model_copy(update={"parameters": {**criterion.parameters, "topic": others[0]}})
    seen = _with_made_up(rubric, criterion, verdict_of(elsewhere, facts, checks))
    if seen.basis.unjudged or seen.status not in {Status.FAIL, Status.PARTIAL}:
        return None
    message = f"on {others[0]}, which comes in place of {topic}: {seen.message}"
    update = {"status": Status.FAIL, "score": 0.0, "message": message, "expected": verdict.expected}
    return seen.model_copy(update=update).based_on(timing=False)


def _with_made_up(rubric: Rubric, criterion: Criterion, verdict: Verdict) -> Verdict:
    """Return a verdict on what is wrong, without another cause, with where the values come from that are asked for."""
    if verdict.status not in {Status.FAIL, Status.PARTIAL} or verdict.basis.unjudged or verdict.basis.cause:
        return verdict
    hint = tell_made_up(rubric, criterion, verdict.hint, verdict.measured)
    return verdict if hint == verdict.hint else verdict.model_copy(update={"hint": hint})


# In this order: each gets the verdict as the one before it left it.
EXPLANATIONS = (
    explain_by_lacking_program,
    explain_by_refused_launch,
    explain_by_late_remap,
    explain_by_absent_parameter,
    explain_by_misplaced_value,
    explain_by_exception,
    explain_by_unheard_topic,
    explain_by_overwritten_parameter,
    explain_by_given_value,
    explain_by_unread_parameter,
    explain_by_misplaced_parameter,
    explain_by_wrong_value,
)


def explain_loss(check: Check, package: PackageFacts | None, run: object, verdict: Verdict) -> Verdict:
    """Return a lost mark with what explains it in the run as a whole."""
    if package is None or not isinstance(run, Run):
        return verdict
    for explain in EXPLANATIONS:
        verdict = verdict if not verdict.status.is_lost else explain(check, package, run, verdict)
    return explain_by_waiting_callback(check, package, run, verdict)  # that may take back an excuse


def _of_the_build(criterion: Criterion, facts: Facts, run: object, verdict: Verdict) -> Verdict:
    """Return a lost mark with what explains it in the build."""
    own = facts.rubric.starts_of(criterion)
    started = {event.name for _, event in run.processes} if isinstance(run, Run) else set()
    all_of_run = facts.rubric.starts_of(criterion.model_copy(update={"parameters": {}}))
    beside = [s.script for s in all_of_run if s.script and s.name not in started]
    asked_for = [s.script for s in own if s.script]
    package = facts.package_of(criterion)
    return explain_by_build(package, facts.runs.get(PACKAGE_RUN), verdict, asked_for, beside)


def verdict_of(criterion: Criterion, facts: Facts, checks: Mapping[str, Check] = CHECKS) -> Verdict:
    """Return what the criterion's check says; an exception inside it is not the student's fault and says so."""
    if criterion.check == MANUAL:
        return Verdict(status=Status.MANUAL, score=0.0, message="a person awards these points")
    check = checks.get(criterion.check)
    if check is None:
        message = f"this grader has no check {criterion.check!r}"
        hint = "`grader rubric validate` finds this"
        return Verdict(status=Status.ERROR, score=0.0, message=message, hint=hint)
    try:
        asked = facts.of(check, criterion, check.params.model_validate(criterion.parameters))
        if isinstance(asked, Verdict):
            found = asked
        else:
            found = account_for_losses(check, asked, _sound(check.function(**asked)))
            if found.status is not Status.PASS:  # a pass needs no explanation
                run = asked.get("run")
                found = explain_loss(check, facts.package_of(criterion), run, found)
                found = _of_the_build(criterion, facts, run, found)
        if found.status is not Status.PASS or found.hint:
            found = _with_better_hint(found, criterion, facts)
        found = _with_package_name(found, criterion, facts)
        found = name_same_file(name_rospy(found, criterion, facts), criterion, facts)
        return _without_git(found, facts.package)
    except NotRecorded as missing:
        return missing.verdict
    except EvidenceError as error:
        return inconclusive(error.message, hint=error.hint)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in a check must not cost a student a mark
        return _verdict_of_crash(check, error)


def _with_better_hint(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict with a hint that says what the check does not know: the rubric, and what other runs show."""
    found = fill_slots(choose_hint_language(verdict, criterion, facts), criterion, facts.rubric)
    found = name_other_imports(name_other_lines(found, facts), criterion, facts)
    found = allow_typing(name_other_parameters(found, criterion, facts), criterion, facts)
    return keep_other_names(name_connections(found, facts), criterion, facts.rubric)


def _without_git(verdict: Verdict, package: PackageFacts | None) -> Verdict:
    """Return the verdict with a hint that works where the package was not handed in with git."""
    hint = without_git(verdict.hint, package)
    return verdict if hint == verdict.hint else verdict.model_copy(update={"hint": hint})


def _with_package_name(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return a verdict on another package than the main one with its name, and its files seen from the main one."""
    main, package = facts.package, facts.package_of(criterion)
    if main is None or package is None or package is main:
        return verdict
    of_package = verdict.moved(main.way_to(package))
    if not verdict.status.is_lost or package.name in verdict.message.partition(";")[0]:
        return of_package
    return of_package.model_copy(update={"message": f"{package.name}: {verdict.message}"})


def _sound(verdict: object) -> Verdict:
    """Raise TypeError or ValueError for what an instructor's own check must not return."""
    if not isinstance(verdict, Verdict):
        raise TypeError(f"it returned {type(verdict).__name__}, not a verdict: return passed(…) or failed(…)")
    if not 0 <= verdict.score <= 1:
        raise ValueError(f"its score is {verdict.score:g}: a score is 0 to 1")
    return verdict


def _verdict_of_crash(check: Check, error: Exception) -> Verdict:
    kind = type(error).__name__
    message = f"the check {check.name!r} itself failed ({kind}); this costs no marks"
    hint = "please report this with the evidence file"
    if check.source:
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == check.source]
        place = f"{PurePath(check.source).name}:{lines[-1]}" if lines else PurePath(check.source).name
        hint = f"for the instructor: {place}: {kind}: {error}"
    return Verdict(status=Status.ERROR, score=0.0, message=message, hint=hint)


def result_of(
    criterion: Criterion,
    verdict: Verdict,
    digits: int,
    *,
    repaired: Repaired | None = None,
    made_up: Mapping[str, Value] = MappingProxyType({}),
    package: PackageFacts | None = None,
) -> CriterionResult:
    """Return the report's line of a criterion, with the points of its verdict."""
    # What a copy earned in full needs no advice of the rubric's on how to fix it.
    earned = repaired is not None and not repaired.charged and verdict.score >= repaired.share
    lost = (verdict.status.is_lost or verdict.status is Status.INCONCLUSIVE) and not earned
    share = f"; {share_text(verdict.score)} of the points for what is right: "
    right = share + verdict.right if verdict.status is Status.PARTIAL and verdict.right else ""
    return CriterionResult(
        id=criterion.id,
        title=criterion.title,
        check=criterion.check,
        scenario=criterion.scenario,
        status=verdict.status,
        points=round_half_up(_points(criterion, verdict), digits),
        max_points=criterion.points,
        extra=criterion.extra,
        message=f"{verdict.message}{right}",
        expected=verdict.expected,
        measured=verdict.measured,
        hint=verdict.hint or (criterion.hint if lost else ""),
        reproduce=compile_command(verdict, package) or criterion.reproduce,
        citations=verdict.citations,
        blocked_by=verdict.blocked_by,
        mistake=verdict.mistake if verdict.status.is_lost else None,
        repaired=repaired,
        made_up=dict(made_up),
    )


def _points(criterion: Criterion, verdict: Verdict) -> float:
    """Return the points of a verdict: a penalty is taken off for what was found, not for what could not be judged."""
    if criterion.penalty is None:
        return verdict.score * (criterion.bonus or criterion.points)
    found = verdict.status in {Status.FAIL, Status.PARTIAL}
    return (verdict.score - 1) * criterion.penalty if found else 0.0


FROM_FILES = {"package", "build", "params"}
REFINED = frozenset({"cmake", "slips"})
REFINED_OF_FILES = frozenset({"python_fault"})
"""What the build makes more precise (`package.facts.with_build_facts`)."""
# Stands for the build's run before there is one: a check that asks for it finds that nothing was built.
UNBUILT = Run(
    evidence=f"{PACKAGE_RUN}.mcap",
    scenario=PACKAGE_RUN,
    clock="real",
    warp=1.0,
    metadata={NOT_RUN: "it is not built yet"},
    start_ns=0,
    end_ns=0,
)


def judge_files(
    rubric: Rubric,
    package: PackageFacts,
    checks: Mapping[str, Check] = CHECKS,
    handed_out: Collection[str] = (),
) -> tuple[EarlyVerdict, ...]:
    """Return the criteria that need no run, as far as the files decide them, in the rubric's order; with them those
    of a launch file that nothing can read.

    What needs the build, or a criterion that is not decided yet, is left out. A verdict is final where nothing that
    the build makes more precise was looked at for it.
    """
    judging = _Judging(rubric, package, checks)
    for name in _in_order(rubric):
        judging.judge(name)
    found = [judging.results[c.id] for c in rubric.criteria if c.id in judging.results]
    names = lab_names(rubric, {v.criterion.id for v in found if v.criterion.status.is_lost}, package)
    told = [with_lab_names(v.criterion, names) for v in found]
    return tuple(
        one.model_copy(update={"criterion": name_unchanged_files(criterion, rubric, package, handed_out)})
        for one, criterion in zip(found, told, strict=True)
    )


class _Judging:
    """Goes through the criteria, each after those that it requires."""

    def __init__(self, rubric: Rubric, package: PackageFacts, checks: Mapping[str, Check]) -> None:
        self._rubric = rubric
        self._package = package
        self._checks = checks
        self._criteria = {c.id: c for c in rubric.criteria}
        self._requirements = Requirements(rubric, checks)
        self.results: dict[str, EarlyVerdict] = {}

    def judge(self, name: str) -> None:
        criterion = self._criteria[name]
        check = self._checks.get(criterion.check)
        if check is None:
            return
        asked: set[str] = set()
        facts = self._facts(asked)
        from_files = FROM_FILES.issuperset(check.facts)
        if not from_files and not facts.unreadable(check, criterion):
            return
        verdict = verdict_of(criterion, facts, self._checks)
        final = not asked
        # Which criterion explains it is known only once all that it requires are judged.
        if verdict.basis.unjudged:
            if not self.results.keys() >= set(criterion.requires):
                return
            final = final and all(self.results[r].final for r in criterion.requires)
            verdict = self._requirements.apply(criterion, verdict)
        if not verdict.status.is_open:
            self._requirements.verdicts[name] = verdict
            result = result_of(criterion, verdict, self._rubric.digits, package=self._package)
            self.results[name] = EarlyVerdict(criterion=result, final=final)

    def _facts(self, asked: set[str]) -> Facts:
        """Return the facts; `asked` collects what was looked at that the build refines, or that only a build gives."""
        main, others = views_of(self._rubric, self._package)
        runs = {PACKAGE_RUN: cast("Run", _Watched(UNBUILT, asked))}
        return Facts(
            rubric=self._rubric,
            runs=runs,
            package=_watch_package(main, asked),
            others={name: _watch_package(package, asked) for name, package in others.items()},
        )


def _watch_package(package: PackageFacts, asked: set[str]) -> PackageFacts:
    files = tuple(_Watched(file, asked, REFINED_OF_FILES) for file in package.files)
    also = tuple(_watch_package(other, asked) for other in package.also)
    seen = package.model_copy(update={"files": files, "also": also})
    return cast("PackageFacts", _Watched(seen, asked, REFINED))


class _Watched:
    """A record that notes in `asked` which of its attributes it was asked for: of these, or of all."""

    def __init__(self, record: object, asked: set[str], noted: frozenset[str] | None = None) -> None:
        self._watched = record, asked, noted

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the record has
        record, asked, noted = self._watched
        if noted is None or name in noted:
            asked.add(name)
        return getattr(record, name)
