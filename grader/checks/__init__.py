"""The checks: one pure function each, in family files. No I/O in here."""

from importlib import import_module

from grader.checks.registry import CHECKS, HEADINGS, Check

FAMILIES = (
    "manifest",
    "cmake",
    "build",
    "executable",
    "node",
    "topic",
    "rate",
    "counter",
    "hears",
    "install",
    "launch",
    "layout",
    "logs",
    "launch_xml",
    "launch_runs",
    "message",
    "programs",
    "services",
    "latched",
    "bounds",
    "topics",
    "connections",
    "path",
    "param_value",
)
for family in FAMILIES:
    import_module(f"grader.checks.{family}")

__all__ = ["CHECKS", "FAMILIES", "HEADINGS", "Check"]
