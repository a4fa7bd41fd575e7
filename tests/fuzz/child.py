"""The fuzzing process of the grader's side: `python -m tests.fuzz.child`, spoken to by `parent.py`."""

from __future__ import annotations

import os
import tempfile
import warnings

from tests.fuzz.loop import serve
from tests.fuzz.readers import READERS

CPU_S = 10.0
MEMORY_BYTES = 200 << 20


def main() -> None:
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", ResourceWarning)
    with tempfile.TemporaryDirectory(prefix="grader-fuzz-") as folder:
        os.chdir(folder)
        serve(READERS, CPU_S, MEMORY_BYTES)


if __name__ == "__main__":
    main()
