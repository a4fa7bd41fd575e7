"""`python -m grader`."""

from __future__ import annotations

import gc
import os
import signal
import sys

COLLECT_AFTER = 200_000
"""So many new objects until Python looks for cycles: to import the grader makes 150,000 that stay."""


def main() -> int:
    # numpy's OpenBLAS reserves memory per core, which nothing here needs, and ends the process if it gets none.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # to look for plug-ins pydantic reads what every installed package says of itself; the grader has none
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    gc.set_threshold(COLLECT_AFTER)
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may be typed next
        from grader.cli.completion import answer  # noqa: PLC0415 - as below

        answer()
    from grader.cli.main import run  # noqa: PLC0415 - keeps `python -m grader --help` quick to import

    code = run(sys.argv[1:])
    # everything is printed: a late Ctrl-C does not change the outcome
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # Python would look through all that is left for cycles, to free what ends with the process anyway
    return code


if __name__ == "__main__":
    sys.exit(main())
