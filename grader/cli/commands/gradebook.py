"""`grader gradebook DIR --form FORM`: a batch's results as a table, for people, programs and learning platforms."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from grader.classes.batch.folder import open_batch
from grader.classes.gradebook import Form, write_gradebook
from grader.cli.output import say, say_beside
from grader.errors import ExitCode, UsageError

NAMES: dict[Form, str] = {
    "csv": "gradebook.csv",
    "jsonl": "results.jsonl",
    "xlsx": "gradebook.xlsx",
    "canvas": "gradebook-canvas.csv",
    "moodle": "gradebook-moodle.csv",
    "blackboard": "gradebook-blackboard.csv",
}
STDOUT = "-"


def run(
    *,
    folder: Path,
    form: Form,
    out: str = "",
    per_criterion: bool = False,
    template: Path | None = None,
    column: str = "",
) -> ExitCode:
    """Write the gradebook to `out` (`-`: stdout), and say on stderr what a person has to know of it.

    Raises UsageError where the template would be written over.
    """
    batch = open_batch(folder)
    target = Path(out) if out else folder / _name(form, template)
    if template and out != STDOUT and target.exists() and target.samefile(template):
        raise UsageError(f"{target} is the template itself", hint="give another name with --out")
    with TemporaryDirectory(prefix="gradebook-") as temporary:
        place = Path(temporary, NAMES[form]) if out == STDOUT else target
        remarks = write_gradebook(
            batch.book(),
            batch.rows(),
            place,
            form,
            per_criterion=per_criterion,
            template=template,
            column=column,
        )
        for remark in remarks:
            say_beside(f"{form}: {remark}")
        if out == STDOUT:
            with place.open("rb") as written:
                shutil.copyfileobj(written, sys.stdout.buffer)
        else:
            say(str(target))
    return ExitCode.PASSED


def _name(form: Form, template: Path | None) -> str:
    """With the ending that the platform's own file has: Blackboard's tables of tabs are `.xls`."""
    return str(Path(NAMES[form]).with_suffix(template.suffix)) if template else NAMES[form]
