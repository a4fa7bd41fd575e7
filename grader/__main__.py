"""`python -m grader`."""

from __future__ import annotations

import sys


def main() -> int:
    from grader.cli.main import run  # noqa: PLC0415 - keeps `python -m grader --help` quick to import

    return run(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
