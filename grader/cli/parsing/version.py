"""`grader --version`."""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from grader import __version__


class VersionAction(argparse.Action):
    """Prints a line for the grader (`grader X.Y.Z`), one for Python and one for ROS, and ends the command."""

    def __init__(self, option_strings: Sequence[str], dest: str, **rest: Any) -> None:  # noqa: ANN401 - as argparse
        super().__init__(option_strings, dest, nargs=0, default=argparse.SUPPRESS, **rest)

    def __call__(self, parser: argparse.ArgumentParser, *_rest: object) -> NoReturn:
        """Raise SystemExit with code 0."""
        from grader.cli.output import say  # noqa: PLC0415 - `--help` does without

        say(f"grader {__version__}")
        say(f"Python {platform.python_version()} ({sys.executable})")
        say(_ros())
        parser.exit()


def _ros() -> str:
    """What ROS 1 the grader would use here; whatever is wrong with it is for `grader doctor` to say at length."""
    from grader.errors import GraderError  # noqa: PLC0415 - as above

    try:
        from grader.arena.ros_env import find_ros  # noqa: PLC0415 - as above

        ros = find_ros()
    except (GraderError, ImportError, OSError) as error:
        return f"ROS 1 not usable: {error}"
    return f"ROS 1 {ros.label}" if ros else "ROS 1 not found"
