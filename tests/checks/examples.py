"""Runs a check on a timeline: evidence as text, the check's parameters, and the verdict that it must give.

`timelines/<check>.yaml` holds the cases of one check by name.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from grader.checks import CHECKS
from grader.checks.support.recorder_losses import account_for_losses
from grader.checks.support.text import in_language
from grader.evidence.run import Run
from grader.judging.judge import explain_loss
from grader.model.message_definitions import parse_interface
from grader.model.package import PackageFacts
from grader.model.verdict import Status, Verdict
from grader.package.launch import parse_launch_files
from tests.support.timeline import build_runs

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
TIMELINES = Path(__file__).parent / "timelines"
KEYS = {"expect", "with", "run", "build", "package"}


@dataclass(frozen=True, kw_only=True)
class Example:
    """One case. `expect`: `status`, `unjudged`, and regular expressions for fields of the verdict."""

    check: str
    name: str
    data: dict[str, Any]

    @property
    def id(self) -> str:
        return f"{self.check}/{self.name}"

    @property
    def expect(self) -> dict[str, Any]:
        return self.data["expect"]

    def verdict(self) -> Verdict:
        return judge_example(self.check, self.data)


def exemplified() -> list[str]:
    """The checks that have cases."""
    return sorted(path.stem for path in TIMELINES.glob("*.yaml"))


@cache
def examples_of(check: str) -> tuple[Example, ...]:
    """The cases of one check: read once, changed by nobody."""
    cases = _read(TIMELINES / f"{check}.yaml").items()
    return tuple(Example(check=check, name=name, data=data) for name, data in cases)


def _read(path: Path) -> dict[str, Any]:
    """Return the cases by name. Raises ValueError for a name that is given twice, of which YAML keeps the last."""
    loader = LOADER(path.read_text(encoding="utf-8"))
    node = loader.get_single_node()
    names = [key.value for key, _ in node.value]
    if len(set(names)) < len(names):
        raise ValueError(f"{path.name} has two cases of one name")
    return loader.construct_document(node)


def judge_example(check: str, data: dict[str, Any]) -> Verdict:
    """The verdict of one check on `run`, `build` and `package` (all optional), with the parameters `with`."""
    if unknown := data.keys() - KEYS:
        raise ValueError(f"unknown keys: {sorted(unknown)}")
    return judge_runs(check, data.get("with", {}), runs_of(data))


def runs_of(data: dict[str, Any]) -> dict[str, Run]:
    recorded = {**data.get("build", {}), "package": _package(data.get("package", {}))}
    return {**build_runs({"runs": {"run": data.get("run", {})}}), **_package_run(json.dumps(recorded))}


@cache
def _package_run(recorded: str) -> dict[str, Run]:
    """Return the run of a build that this JSON tells: written and read once for all cases of the same package."""
    return build_runs({"runs": {"package": json.loads(recorded)}})


def _package(given: dict[str, Any]) -> dict[str, Any]:
    """Launch files and definitions that are given as text (`launch: {path: xml}`) are read as of a real package."""
    facts = {key: value for key, value in given.items() if key not in {"launch", "definitions"}}
    if "definitions" in given:
        read_ones = (parse_interface(text.encode(), path) for path, text in given["definitions"].items())
        facts["interfaces"] = [one.model_dump() for one in read_ones]
    if "launch" not in given:
        return facts
    texts = {path: text.encode() for path, text in given["launch"].items()}
    read = parse_launch_files(texts, (facts.get("name", "lab1"),))
    known = {file["path"] for file in facts.get("files", ())}
    facts["files"] = [*facts.get("files", ()), *({"path": path} for path in texts if path not in known)]
    return {**facts, "launch_files": [file.model_dump() for file in read]}


def judge_runs(name: str, params: dict[str, Any], runs: dict[str, Run]) -> Verdict:
    check = CHECKS[name]
    facts = {
        "run": runs["run"],
        "build": runs["package"],
        "package": PackageFacts.model_validate_json(runs["package"].package_json or b""),
        "params": check.params.model_validate(params),
    }
    asked = {fact: facts[fact] for fact in check.facts}
    verdict = account_for_losses(check, asked, check.function(**asked))
    verdict = explain_loss(check, facts["package"], facts["run"], verdict)
    return verdict.model_copy(update={"hint": in_language(verdict.hint, "python")})


def differences(verdict: Verdict, expect: dict[str, Any]) -> list[str]:
    """What the verdict lacks of what was expected, in words."""
    found = []
    if verdict.status is not Status(expect["status"]):
        found.append(f"status {verdict.status.value}, expected {expect['status']}")
    if verdict.basis.unjudged != expect.get("unjudged", False):
        found.append(f"unjudged {verdict.basis.unjudged}")
    for field in expect.keys() - {"status", "unjudged", "cites"}:
        text = str(getattr(verdict if field in Verdict.model_fields else verdict.basis, field))
        if not re.search(str(expect[field]), text):
            found.append(f"{field} {text!r} does not match {expect[field]!r}")
    cited = [c.model_dump(exclude_none=True) for c in verdict.citations]
    found += [f"no citation {c} in {cited}" for c in expect.get("cites", []) if not _is_cited(c, cited)]
    return found


def _is_cited(wanted: dict[str, Any], cited: list[dict[str, Any]]) -> bool:
    return any(wanted.items() <= citation.items() for citation in cited)
