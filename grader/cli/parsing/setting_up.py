"""The commands for whoever sets the grader up."""

from __future__ import annotations

from grader.cli.parsing.base import Adder

SHELLS = ("bash", "zsh", "fish")


def add_setting_up(add: Adder) -> None:
    """Add `completion`."""
    completion = add(
        "completion", "print what a shell loads to complete grader's commands, options and names"
    )
    completion.add_argument("shell", metavar="SHELL", choices=SHELLS, help="bash, zsh or fish")
