"""`grader export bag EVIDENCE`: recorded evidence as a ROS 1 bag."""

from __future__ import annotations

from pathlib import Path

from grader.cli.output import say
from grader.errors import EvidenceError, ExitCode, UsageError
from grader.evidence.export import export_bag
from grader.evidence.reader import load_evidence
from grader.evidence.run import Run


def run(*, evidence: Path, out: Path | None = None, everything: bool = False) -> ExitCode:
    """One bag for a file, at `out`; for a folder one bag a scenario, in the folder `out`.

    Raises UsageError where a bag would take the place of a file that was not named.
    """
    runs = load_evidence([evidence])
    if not evidence.is_dir():
        (single,) = runs.values()
        _export(single, _target(single, evidence, out), everything=everything)
        return ExitCode.PASSED
    folder = out or Path()
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is no folder", hint=f"{evidence} is one: its bags go to a folder")
    chosen = [r for r in runs.values() if everything or any(c.messages for c in r.channels)]
    if not chosen:
        raise EvidenceError(f"{evidence}: holds no messages to export", hint="--all exports the records too")
    for each in chosen:
        _export(each, _free(folder / _name(each), evidence, named=False), everything=everything)
    return ExitCode.PASSED


def _target(run: Run, evidence: Path, out: Path | None) -> Path:
    if out is None:
        return _free(Path(_name(run)), evidence, named=False)
    return _free(out / _name(run) if out.is_dir() else out, evidence, named=not out.is_dir())


def _free(path: Path, evidence: Path, *, named: bool) -> Path:
    if path.exists() and (not named or path.samefile(evidence)):
        raise UsageError(f"{path} is there already", hint="choose another name with --out")
    return path


def _name(run: Run) -> str:
    return f"{Path(run.evidence).stem}.bag"


def _export(run: Run, path: Path, *, everything: bool) -> None:
    count = export_bag(run, path, everything=everything)
    say(f"{path}: {count} messages")
