"""The checks: one pure function each, in family files.

Facts come in, by the names of a check's parameters (`package`, `build`, `run`, `params`); a verdict goes out. Opening
files, reading clocks and awarding points are not its business. What an instructor's own check needs can be imported
from here (docs/how-to/own-checks.md), and stays.
"""

from importlib import import_module

from grader.checks.all_runs import Evidence
from grader.checks.registry import CHECKS, HEADINGS, Check, ProcessName, Refers, check
from grader.evidence.run import Channel, Message, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    EvidenceCitation,
    FileCitation,
    Verdict,
    failed,
    inconclusive,
    partial,
    passed,
    unjudged,
)

FAMILIES = (
    "manifest",
    "cmake",
    "build",
    "executable",
    "layout",
    "node",
    "topics",
    "messages",
    "fields",
    "reacts",
    "stamps",
    "definition",
    "transform",
    "rate",
    "counter",
    "listener",
    "logs",
    "console",
    "files_left",
    "launch_xml",
    "launch_runs",
    "launch_params",
    "launch_opens",
    "parameters",
    "services",
    "calls",
    "actions",
    "rostest",
    "connections",
    "two_copies",
    "robot_path",
    "robot_places",
)
for family in FAMILIES:
    import_module(f"grader.checks.{family}")

__all__ = [
    "CHECKS",
    "FAMILIES",
    "HEADINGS",
    "Channel",
    "Check",
    "Evidence",
    "EvidenceCitation",
    "FileCitation",
    "Message",
    "PackageFacts",
    "ProcessName",
    "Record",
    "Refers",
    "Run",
    "Verdict",
    "check",
    "failed",
    "inconclusive",
    "partial",
    "passed",
    "unjudged",
]
