"""What to type to go on with a batch."""

from __future__ import annotations

import shlex
from pathlib import Path

from markupsafe import Markup

from grader.model.batch import BatchRun
from grader.report.text import html


def again(run: BatchRun, out: Path, only: str = "", *, static: bool | None = None) -> Markup:
    """The batch once more, from any folder; `only` as `--only` has it. `static` if not as it was."""
    roster = Path(run.roster)
    words = ["grader", "batch", str(roster.absolute() if roster.exists() else roster)]
    words += ["--rubric", run.rubric_source or run.rubric.id, "--out", str(out.absolute())]
    words += ["--static"] if (run.static_only if static is None else static) else []
    words += ["--before", run.before.isoformat()] if run.before else []
    words += [word for folder in run.allow_local for word in ("--allow-local", folder)]
    words += ["--remote-only"] if run.remote_only else []
    words += ["--cluster", run.cluster] if run.cluster else []
    words += ["--cluster-insecure"] if run.cluster_insecure else []
    words += ["--only", only] if only else []
    return _typed(words)


def review(out: Path) -> Markup:
    """Where a person gives points."""
    return _typed(["grader", "review", str(out.absolute())])


def _typed(words: list[str]) -> Markup:
    """Whole, however long it is."""
    return Markup(html(shlex.join(words)))  # noqa: S704 - escaped
