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
    "launch",
    "launch_xml",
    "message",
)
for family in FAMILIES:
    import_module(f"grader.checks.{family}")

__all__ = ["CHECKS", "FAMILIES", "HEADINGS", "Check"]
