"""What commands on recorded evidence do: judge it, print what is in a file, export it as bags. None needs ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from grader.classes.batch.existing_results import Judged, judge_all
from grader.cli.errors import report
from grader.cli.outcome import exit_code
from grader.cli.output import say, say_document
from grader.errors import EvidenceError, ExitCode, UsageError
from grader.evidence.export import export_bag
from grader.evidence.inspect import ChannelSummary, Inspection, ProcessSummary
from grader.evidence.reader import load_evidence
from grader.evidence.run import Run
from grader.files import atomic_write
from grader.judging import judge
from grader.judging.summary import criteria_text, judged_text
from grader.model.result import CriterionResult
from grader.report.terminal import emit, open_console
from grader.report.text import line
from grader.rubric.find import named_labs
from grader.rubric.load import LoadedRubric, load_rubric
from grader.verification import Finding, compare, read_whole, result_folders, verify
from grader.wording import number

WORST_FIRST = (ExitCode.NOT_GRADED, ExitCode.BELOW_PASS_MARK, ExitCode.INCONCLUSIVE)
CHANNELS_MAX = 500
FINDING_CHARS = 500


def judge_evidence(evidence: Sequence[Path], loaded: LoadedRubric, out: str) -> ExitCode:
    """Judge one submission and write its criteria as JSON to the file `out`, or to stdout for `-`."""
    criteria = judge(loaded.rubric, load_evidence(evidence), loaded.checks, loaded.handed_out)
    _write(out, lambda ascii_only: criteria_text(criteria, ascii_only=ascii_only))
    return exit_code(criteria, loaded.rubric)


def judge_submissions(folders: Sequence[Path], loaded: LoadedRubric, out: str, jobs: int) -> ExitCode:
    """Judge several submissions and write a list of them. One that cannot be judged is reported and does not affect the
    others. Return the exit code of the worst."""
    order = {folder: index for index, folder in enumerate(folders)}
    judged = sorted(judge_all(folders, loaded, jobs), key=lambda one: order[one.folder])
    _write(out, lambda ascii_only: judged_text(loaded.rubric, map(_named, judged), ascii_only=ascii_only))
    for one in judged:
        if one.criteria is None:
            report(EvidenceError(one.error, hint=one.hint))
    codes = {
        ExitCode.NOT_GRADED if c is None else exit_code(c, loaded.rubric)
        for c in (j.criteria for j in judged)
    }
    return next((code for code in WORST_FIRST if code in codes), ExitCode.PASSED)


def _named(one: Judged) -> tuple[str, tuple[CriterionResult, ...] | str]:
    return one.folder.name, one.error if one.criteria is None else one.criteria


def _write(out: str, text: Callable[[bool], str]) -> None:
    if out == "-":
        say_document(text)
    else:
        atomic_write(Path(out), text(False).encode())


def print_inspection(inspection: Inspection, stream: IO[str]) -> None:
    """Print rates, gaps, nodes and how the run went."""
    lines = [Text(line(text, 500)) for text in _head(inspection)]
    table: list[RenderableType] = [Text(), _channels(inspection)] if inspection.channels else []
    left = len(inspection.channels) - CHANNELS_MAX
    more = [Text(f"and {left} more channels (--json lists them all)")] if left > 0 else []
    emit(open_console(stream), [*lines, *table, *more])


def _head(inspection: Inspection) -> Iterator[str]:
    warp = f", {inspection.warp:g} times as fast" if inspection.clock == "warped" else ""
    yield f"{inspection.file}: scenario {inspection.scenario}, clock {inspection.clock}{warp}"
    counts = f"{inspection.messages} messages, {len(inspection.channels)} channels"
    yield f"{number(inspection.duration_s)} s, {counts}, {inspection.console_lines} console lines"
    if inspection.outcome:
        yield f"ended: {inspection.outcome} {inspection.outcome_detail}".rstrip()
    if inspection.late_max_ms is not None:
        yield f"this machine's timer was at most {inspection.late_max_ms:.1f} ms late"
    if inspection.nodes:
        yield f"nodes: {' '.join(inspection.nodes)}"
    for process in (p for p in inspection.processes if p.role != "grader"):
        yield f"process {process.name}: {_end(process)}"
    yield from (f"noticed: {text}" for text in inspection.noticed)


def _end(process: ProcessSummary) -> str:
    if process.exit_s is None:
        return "its end was not recorded"
    stopped = f", stopped by {process.stopped_by}" if process.stopped_by else ""
    how = f"signal {process.signal}" if process.signal is not None else f"exit code {process.exit_code}"
    return f"{how}{stopped}"


def _channels(inspection: Inspection) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for heading in ("count", "Hz", "gaps in ms"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("topic, type, publisher", overflow="fold", ratio=1)
    for channel in inspection.channels[:CHANNELS_MAX]:
        names = f"{line(channel.topic, 200)}\n{line(channel.type, 200)} by {line(channel.publisher, 200)}"
        table.add_row(*map(Text, (str(channel.rate.count), *_rate(channel), names)))
    return table


def _rate(channel: ChannelSummary) -> tuple[str, str]:
    """Hertz, and the smallest, middle and largest gap."""
    rate = channel.rate
    hertz = "" if rate.mean_hz is None else f"{rate.mean_hz:.2f}"
    gaps_s = (rate.gap_min_s, rate.gap_median_s, rate.gap_max_s)
    return hertz, " / ".join(f"{gap_s * 1e3:.1f}" for gap_s in gaps_s if gap_s is not None)


def export_bags(evidence: Path, out: Path | None, *, everything: bool) -> None:
    """Write one bag for a file, at `out`; for a folder one bag per scenario, in the folder `out`.

    Raises UsageError if a bag would replace a file that was not named.
    """
    runs = load_evidence([evidence])
    if not evidence.is_dir():
        (single,) = runs.values()
        _export(single, _target(single, evidence, out), everything=everything)
        return
    folder = out or Path()
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is not a folder", hint=f"{evidence} is one, so its bags go to a folder")
    chosen = [r for r in runs.values() if everything or any(c.messages for c in r.channels)]
    if not chosen:
        raise EvidenceError(
            f"{evidence}: holds no messages to export", hint="--all exports the grader's records"
        )
    for each in chosen:
        _export(each, _free(folder / _name(each), evidence, named=False), everything=everything)


def _target(run: Run, evidence: Path, out: Path | None) -> Path:
    if out is None:
        return _free(Path(_name(run)), evidence, named=False)
    return _free(out / _name(run) if out.is_dir() else out, evidence, named=not out.is_dir())


def _free(path: Path, evidence: Path, *, named: bool) -> Path:
    if path.exists() and (not named or path.samefile(evidence)):
        raise UsageError(f"{path} already exists", hint="choose another name with --out")
    return path


def _name(run: Run) -> str:
    return f"{Path(run.evidence).stem}.bag"


def verify_results(results: Sequence[Path], rubric: str | None, allowed: Path | None) -> ExitCode:
    """Verify each result, print what was found, and return the exit code of the worst."""
    folders = result_folders(list(results))
    rubrics: dict[str, LoadedRubric] = {}
    codes = set()
    for folder in folders:
        try:
            name = rubric or read_whole(folder).rubric.id
            if name not in rubrics:
                rubrics[name] = _rubric_named(name, given=rubric is not None)
            codes.add(_print_findings(folder, verify(folder, rubrics[name], allowed)))
        except EvidenceError as error:  # noqa: PERF203 - each result has its own
            report(error)
            codes.add(ExitCode.NOT_GRADED)
    return next((code for code in WORST_FIRST if code in codes), ExitCode.PASSED)


def _rubric_named(name: str, *, given: bool) -> LoadedRubric:
    """Load it; what a result says must not lead to a file."""
    if not given and not named_labs(name):
        raise UsageError(
            f"there is no lab {line(name, 100)} here", hint="give the course's rubric with --rubric"
        )
    return load_rubric(name)


def compare_results(own: Path, official: Path) -> ExitCode:
    """Print what differs between a student's own result and the official one."""
    (mine,), (theirs,) = (result_folders([path]) for path in (own, official))
    return _print_findings(mine, compare(read_whole(mine), read_whole(theirs)))


def _print_findings(folder: Path, findings: Sequence[Finding]) -> ExitCode:
    wrong = any(finding.wrong for finding in findings)
    say(f"{folder}: {'something does not fit' if wrong else 'ok'}")
    for finding in sorted(findings, key=lambda finding: not finding.wrong):
        say(f"  {'x' if finding.wrong else '+'} {finding.about}: {line(finding.text, FINDING_CHARS)}")
    return ExitCode.BELOW_PASS_MARK if wrong else ExitCode.PASSED


def _export(run: Run, path: Path, *, everything: bool) -> None:
    count = export_bag(run, path, everything=everything)
    say(f"{path}: {count} messages")
