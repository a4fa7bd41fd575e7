"""Which criteria are `blocked`: by a lost one that they require, which explains that there was nothing to judge, or by
one that lost its points to the same cause."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import PurePath

from grader.checks import Check
from grader.checks.support.scripts import SYNTAX
from grader.checks.support.text import texts_in
from grader.judging.repair_charges import BUILD, is_unmade
from grader.model.verdict import Status, Verdict, cited_lines, inconclusive
from grader.rubric.model import Criterion, Rubric

OF_CONNECTIONS = ("connected", "launch-connects", "launch-runs")
"""Checks of which nodes are connected, at whatever rate messages come."""
OTHER_TYPE = re.compile(r"expected \[[^\]]*\] but got \[")
"""What rospy says of a message that a Publisher is not made for."""


class Requirements:
    """Applies `requires`: give it each criterion's verdict after those of the criteria that it requires."""

    def __init__(self, rubric: Rubric, checks: Mapping[str, Check]) -> None:
        self._rubric = rubric
        self._criteria = {c.id: c for c in rubric.criteria}
        self._checks = checks
        self._roots: dict[str, str] = {}
        self.verdicts: dict[str, Verdict] = {}

    def apply(self, criterion: Criterion, verdict: Verdict) -> Verdict:
        """Return `blocked` where there was nothing to judge and a required criterion explains it, named by its root.

        What was found here stays in the message.
        """
        if not verdict.basis.unjudged:
            return verdict
        lost = [r for r in criterion.requires if self._explains(r, criterion, verdict)]
        same = [r for r in lost if _cause(self.verdicts[r]) == _cause(verdict)]
        same = same or [r for r in lost if _cause(self.verdicts[r]) in verdict.message]
        if lost:
            # what is not there at all explains most, then what is said of the same topics and nodes
            names = _graph_names(criterion)
            shared = {r: len(names & _graph_names(self._criteria[r])) for r in lost}
            blocking = min(same or lost, key=lambda r: (not self.verdicts[r].basis.unjudged, -shared[r]))
            # The root of a chain: what has to be fixed first, and not what is blocked itself.
            root = self._roots[criterion.id] = self._roots.get(blocking, blocking)
            message = f"blocked by {root}: {self.verdicts[root].message}"
            if verdict.message not in message:
                message = f"{message}; for this criterion: {verdict.message_without_cause}"
            # what is sure and explains it would come again with the run
            sure = self.verdicts[root].basis.unjudged or self._criteria[root].scenario == criterion.scenario
            timing = self.verdicts[root].basis.timing or not sure
            return _blocked(verdict, root, message, timing=timing)
        undecided = next((r for r in criterion.requires if self.verdicts[r].status.is_open), None)
        if undecided is None:
            part = {"status": Status.PARTIAL, "score": verdict.basis.part}
            return verdict.model_copy(update=part) if verdict.basis.part else verdict
        message = f"{verdict.message}; and {undecided} could not be judged"
        # what this one was told would put right what nobody knows to be wrong
        hint = f"see {undecided} first"
        return inconclusive(message, expected=verdict.expected, measured=verdict.measured, hint=hint)

    def _explains(self, required: str, criterion: Criterion, found: Verdict) -> bool:
        """Return whether the loss of a required criterion can be why there was nothing to judge for this one.

        What else was wrong with a node, or with a file, is no reason for its process, or for the build, to end; unless
        it was at the same line, or what is absent is named.
        """
        verdict = self.verdicts[required]
        # the line below which a call that is missing goes is not a fault
        is_missing = bool(verdict.sought_name("call") or verdict.sought_name("below"))
        same_line = not is_missing and not cited_lines(verdict.citations).isdisjoint(
            cited_lines(found.citations)
        )
        same_run = self._criteria[required].scenario == criterion.scenario
        # a manifest that has the name which a launch file lacks
        is_named = (
            f'pkg="{self._criteria[required].parameters.get("name")}"' in found.hint
            and not verdict.basis.unjudged
        )
        # messages came, only too fast or too slow
        is_other = found.basis.misfit and not verdict.basis.unjudged and self._is_of_rate(required)
        if not verdict.status.is_lost or is_unmade(verdict) or is_named or is_other:
            return False  # a program that the build did not make is no reason for the build to fail
        if same_run and self._criteria[required].check == "topic-type" and OTHER_TYPE.search(found.message):
            return True  # its process ended of the wrong type
        named = verdict.basis.unjudged and any(
            text in found.message for text in _paths(self._criteria[required])
        )
        unbuilt = found.basis.unbuilt and verdict.basis.unbuilt
        if (
            same_run
            and found.basis.cause not in {"", verdict.basis.cause}
            and not (named or same_line or unbuilt)
        ):
            return False  # its process ended of something else
        if verdict.basis.unjudged:
            return True
        if self._is_repaired(required, criterion, found) and not same_line:
            return False
        was_there = (
            found.basis.silent and (same_run or found.status is Status.PASS)
        ) or self._leaves_it_there(required, criterion)
        return not was_there or bool(verdict.basis.cause) or _cause(verdict) in found.message

    def _is_repaired(self, required: str, criterion: Criterion, found: Verdict) -> bool:
        """Return whether the arena puts right what the required criterion asks for, bits and first lines, before it
        runs anything."""
        check = self._checks.get(self._criteria[required].check)
        # the build itself is of the package as it is, whatever it runs afterwards
        of_build = criterion.scenario is None or criterion.check == "build-and-run"
        if check is None or not check.run_anyway or of_build:
            return False
        return check.name != "build" or not (found.basis.unbuilt or self._is_compiled(criterion))

    def _leaves_it_there(self, required: str, criterion: Criterion) -> bool:
        """Return whether what the required criterion judges can be wrong of a node that is there and connected."""
        one = self._criteria[required]
        check = self._checks.get(one.check)
        if check is None:
            return False
        rate = criterion.check in OF_CONNECTIONS and self._is_of_rate(required)
        return rate or (check.of_lives and not self._is_below(required, criterion))

    def _is_of_rate(self, required: str) -> bool:
        check = self._checks.get(self._criteria[required].check)
        return check is not None and hasattr(check.params, "rate_bounds")

    def _is_below(self, required: str, criterion: Criterion) -> bool:
        """Return whether the criterion asks for a private name of the node that the required one names."""
        parts = {part for text in texts_in(criterion.parameters) for part in text.split("/")[:-1] if part}
        return bool(parts.intersection(texts_in(self._criteria[required].parameters.get("names"))))

    def _is_compiled(self, criterion: Criterion) -> bool:
        """Return whether it is about a program that only a build makes: a script runs from its source."""
        starts = self._rubric.starts_of(criterion)
        return any(start.built or (start.script and not PurePath(start.script).suffix) for start in starts)


def charge_once(
    rubric: Rubric, verdicts: Mapping[str, Verdict], judged: Collection[str] = ()
) -> dict[str, Verdict]:
    """Return the verdicts, with those blocked that lost all of their points to what another one has lost its own to
    already: an exception, a topic that no node hears, what the build did not make, a definition, a value that is not
    kept within its bounds, a first message or a file that is missing, a script that is not there or that Python cannot
    read. `requires` names nothing that is lost where the node goes on after it, as after one in a callback, or ends of
    it in another run. `judged` are the criteria that a repaired copy has judged."""
    charged, told = dict[str, str](), dict(verdicts)
    lost = [c.id for c in reversed(rubric.criteria) if verdicts[c.id].status is Status.FAIL]
    by_itself = {one: name for name in lost for one in verdicts[name].basis.lost_to}
    # students see the hint of the one that is charged: where the rubric asks for it, the one that asks for no exception
    for criterion in sorted(
        rubric.criteria, key=lambda c: (c.visibility != "visible", not c.points, c.check != "callbacks-clean")
    ):
        verdict = verdicts[criterion.id]
        is_whole = verdict.status is Status.FAIL and not verdict.score and criterion.penalty is None
        root = _of_script(rubric, verdicts, criterion, verdict) if is_whole else ""
        if not is_whole or (criterion.scenario is None and not root) or criterion.id in judged:
            continue
        root = root or _of_files(rubric, verdicts, verdict)
        if not root and verdict.basis.charged_once:
            root = charged.setdefault(verdict.basis.cause, criterion.id)
        if not root:
            root = next((charged[one] for one in verdict.basis.lost_to if one in charged), "")
            root = root or next((by_itself[one] for one in verdict.basis.beyond if one in by_itself), "")
            charged.update(dict.fromkeys(verdict.basis.lost_to, root or criterion.id))
        if root and root != criterion.id:
            told[criterion.id] = _blocked(verdict, root, f"blocked by {root}: {verdict.message}")
    return {name: _at_root(verdict, told) for name, verdict in told.items()}


def _of_files(rubric: Rubric, verdicts: Mapping[str, Verdict], verdict: Verdict) -> str:
    """Return the criterion of the files that is lost to the same; "" where there is none."""
    check = BUILD if verdict.basis.unbuilt else verdict.basis.judged_by
    lost = (c.id for c in rubric.criteria if c.check == check and verdicts[c.id].status is Status.FAIL)
    return next(lost, "")


def _of_script(
    rubric: Rubric, verdicts: Mapping[str, Verdict], criterion: Criterion, verdict: Verdict
) -> str:
    """Return the criterion that asks for a script, where this one is lost for there is no such script, or for Python
    cannot read it; "" where there is none."""
    own = cited_lines(verdict.citations) if any(kind in verdict.message for kind in SYNTAX) else set()
    for other in rubric.criteria if own or verdict.basis.unjudged else ():
        found = verdicts[other.id]
        lacks = (
            found.mistake.name if found.mistake is not None and found.mistake.kind == "file-missing" else ""
        )
        unread = other.check == "executable" and any(f": {kind}: " in found.message for kind in SYNTAX)
        is_same = (lacks and f"there is no {lacks} to run" in verdict.message) or (
            unread and own & cited_lines(found.citations)
        )
        if is_same and other.id != criterion.id and found.status is Status.FAIL:
            return other.id
    return ""


def _at_root(verdict: Verdict, told: Mapping[str, Verdict]) -> Verdict:
    """Return a blocked criterion as one that is blocked by what blocks the one that it is blocked by."""
    if not (above := verdict.blocked_by) or not (root := told[above].blocked_by):
        return verdict
    message = verdict.message.replace(f"blocked by {above}: ", f"blocked by {root}: ", 1)
    return verdict.model_copy(update={"message": message, "hint": f"fix {root} first", "blocked_by": root})


def _blocked(verdict: Verdict, root: str, message: str, *, timing: bool = False) -> Verdict:
    update = {
        "status": Status.BLOCKED,
        "score": 0.0,
        "message": message,
        "hint": f"fix {root} first",
        "blocked_by": root,
    }
    return verdict.model_copy(update=update).based_on(timing=verdict.basis.timing and timing)


def _graph_names(criterion: Criterion) -> set[str]:
    return {text for text in texts_in(criterion.parameters) if text.startswith("/")}


def _paths(criterion: Criterion) -> list[str]:
    """Return the parameters that look like the path of a file of the package: no topic."""
    return [text for text in texts_in(criterion.parameters) if "/" in text and not text.startswith("/")]


def _cause(verdict: Verdict) -> str:
    return verdict.basis.cause or verdict.message
