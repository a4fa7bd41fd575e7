"""`python -m grader.integrations.deliver PLATFORM FOLDER`: what an exported grader does in the platform's container."""

from __future__ import annotations

import signal
import sys
import warnings
from pathlib import Path
from types import FrameType

from grader.integrations import gradescope
from grader.integrations import prairielearn
from grader.integrations.autograde import deliver

PLATFORMS = {
    "gradescope": (gradescope.place, gradescope.FORM),
    "prairielearn": (prairielearn.place, prairielearn.FORM),
}


def main() -> int:
    """0 where something was graded, 3 where results.json says that nothing was."""
    signal.signal(signal.SIGTERM, _interrupt)
    warnings.simplefilter("ignore")  # Python's remarks on a student's code are for nobody here
    platform, folder = sys.argv[1:]
    place, form = PLATFORMS[platform]
    return 0 if deliver(place(Path(folder)), form) else 3


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
