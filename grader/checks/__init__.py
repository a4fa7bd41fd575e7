"""The checks: one pure function each, in family files.

Facts come in, by the names of a check's parameters (`package`, `build`, `run`, `params`); a verdict goes out. Opening
files, reading clocks and awarding points are not its business. What an instructor's own check needs can be imported
from here (docs/how-to/own-checks.md), and stays.
"""

from importlib import import_module

from grader.checks.registry import CHECKS, HEADINGS, Check, Evidence, ProcessName, Refers, check
from grader.evidence.run import Channel, Message, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    EvidenceCitation,
    FileCitation,
    Verdict,
    failed,
    failed_or_blocked,
    inconclusive,
    partial,
    passed,
)

FAMILIES = (
    "package_files", "cmake", "build", "executable", "node", "topics", "messages", "field_values", "reacts", "stamps",
    "interfaces", "transform", "rate", "counter", "listener", "console", "logs", "files_left", "launch_files",
    "launch_runs", "launch_params", "parameter_files", "parameters", "service_servers", "service_clients", "actions",
    "rostest", "two_copies", "robot_path", "ends_at", "stays_within",
)  # fmt: skip
# The stable name of docs/how-to/own-checks.md, which checks of courses import.
unjudged = failed_or_blocked

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
    "failed_or_blocked",
    "inconclusive",
    "partial",
    "passed",
    "unjudged",
]
