"""`python -m grader`."""

from __future__ import annotations

import os
import signal
import sys


def main() -> int:
    # numpy's OpenBLAS takes memory for each core, which nothing here needs, and where it gets none it ends the process.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may be typed here
        from grader.cli.completion import answer  # noqa: PLC0415 - as below

        answer()
    from grader.cli.main import run  # noqa: PLC0415 - keeps `python -m grader --help` quick to import

    code = run(sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is said: a late Ctrl-C does not change how it ended
    return code


if __name__ == "__main__":
    sys.exit(main())
