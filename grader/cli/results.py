"""What commands on existing results and evidence do.

They judge evidence again, verify, write reports, print what a file holds, and export bags. None of them needs ROS.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.batch.renew_results import (
    WrittenReports,
    figures_in,
    has_result,
    judge_all,
    result_in,
    write_all,
    write_one,
)
from grader.classes.batch.run import INDEX
from grader.cli.declare import STDOUT
from grader.cli.display import exit_code, worst
from grader.cli.output import report, say, say_beside, write_document
from grader.cli.select_rubric import package_prefix
from grader.errors import EvidenceError, ExitCode, UsageError
from grader.evidence.bag import export_bag
from grader.evidence.inspect import ChannelSummary, Inspection, ProcessSummary
from grader.evidence.reader import load_evidence
from grader.evidence.run import Run
from grader.files import atomic_write
from grader.judging import judge
from grader.judging.summary import criteria_text, judged_text
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation
from grader.portable import cores
from grader.report.class_page.page import write_class_page
from grader.report.class_page.submissions import salt_in
from grader.report.forms import FORMS, ReportInput
from grader.report.sentences import missing_hidden
from grader.report.terminal import Terminal, emit, open_console
from grader.report.text import line
from grader.report.view import without_hidden
from grader.results import RESULT, load_result
from grader.rubric.find import named_labs
from grader.rubric.load import LoadedRubric, load_rubric
from grader.verification import PartFinding, compare, result_folders, verify
from grader.wording import first_few, number

CHANNELS_MAX = 500
FINDING_CHARS = 500


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
    """Return the hertz, and the smallest, middle and largest gap."""
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
    # a bag without messages would be of no use
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
    # a name that was given may be replaced, but not the evidence itself
    if path.exists() and (not named or path.samefile(evidence)):
        raise UsageError(f"{path} already exists", hint="choose another name with --out")
    return path


def _name(run: Run) -> str:
    return f"{Path(run.evidence).stem}.bag"


def verify_results(results: Sequence[Path], rubric: str | None, allowed: Path | None) -> ExitCode:
    """Verify each result, print what was found, and return the exit code of the worst."""
    folders = result_folders(list(results))
    rubrics: dict[str, LoadedRubric] = {}
    codes = list[ExitCode]()
    for folder in folders:
        try:
            name = rubric or load_result(folder / RESULT).rubric.id
            if name not in rubrics:
                rubrics[name] = _rubric_named(name, given=rubric is not None)
            of_class = (folder.resolve().parent / RUN).is_file()
            found = verify(folder, rubrics[name], allowed, of_class=of_class)
            codes.append(_print_findings(folder, found))
        except EvidenceError as error:  # noqa: PERF203 - each result has its own
            report(error)
            codes.append(ExitCode.NOT_GRADED)
    return worst(codes)


def _rubric_named(name: str, *, given: bool) -> LoadedRubric:
    """Load the rubric of that name; what a result says must not lead to a file."""
    if not given and not named_labs(name):
        raise UsageError(
            f"there is no lab {line(name, 100)} here", hint="give the course's rubric with --rubric"
        )
    return load_rubric(name)


def compare_results(own: Path, official: Path) -> ExitCode:
    """Print what differs between a student's own result and the official one."""
    (mine,), (theirs,) = (result_folders([path]) for path in (own, official))
    return _print_findings(mine, compare(load_result(mine / RESULT), load_result(theirs / RESULT)))


def _print_findings(folder: Path, findings: Sequence[PartFinding]) -> ExitCode:
    wrong = any(finding.wrong for finding in findings)
    say(f"{folder}: {'something does not fit' if wrong else 'ok'}")
    for finding in sorted(findings, key=lambda finding: not finding.wrong):
        say(f"  {'x' if finding.wrong else '+'} {finding.about}: {line(finding.text, FINDING_CHARS)}")
    return ExitCode.BELOW_PASS_MARK if wrong else ExitCode.PASSED


def _export(run: Run, path: Path, *, everything: bool) -> None:
    count = export_bag(run, path, everything=everything)
    say(f"{path}: {count} messages")


NAMES_SHOWN = 5


def folders_in(folder: Path, batch: BatchFolder | None) -> list[Path]:
    """Return the submissions of a batch, or in any folder of results. Raises UsageError if there are none."""
    try:
        places = sorted(folder.iterdir()) if batch is None else map(batch.folder_of, batch.run.entries)
        found = [place for place in places if has_result(place)]
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}", hint="give a folder of results") from error
    if not found:
        hint = "give the --out of `grader batch`, or a submission's folder"
        raise UsageError(f"{folder} contains no results", hint=hint)
    return found


def rubric_of(given: str | None, folder: Path, batch: BatchFolder | None = None) -> LoadedRubric:
    """Return the rubric that is given, else the one of the batch, else the lab with the result's id."""
    if given is None and batch is None and (folder.absolute().parent / RUN).is_file():
        batch = open_batch(folder.absolute().parent)
    if given is None and batch is None:
        given = result_in(folder).rubric.id
        if not named_labs(given):
            message = f'{folder}: its rubric "{given}" is not one of the labs that are known here'
            raise UsageError(message, hint="name its file with --rubric")
    return load_rubric(given or (batch.run.rubric_source if batch else ""))


def write_reports(folders: Sequence[Path], rubric: LoadedRubric) -> ExitCode:
    """Write every report of these submissions. NOT_GRADED if a result cannot be read."""
    if len(folders) == 1:
        digest = write_one(folders[0], rubric).rubric.digest
        done = [WrittenReports(folder=folders[0], rubric_digest=digest)]
    else:
        done = list(write_all(folders, rubric, cores()))
    _say_others(
        [w.folder.absolute().name for w in done if not w.error and w.rubric_digest != rubric.digest], rubric
    )
    for failed in (w for w in done if w.error):
        report(EvidenceError(failed.error, hint=failed.hint))
    good = sum(not w.error for w in done)
    where = folders[0] if len(folders) == 1 else folders[0].parent
    say(f"{good} of {len(done)} written: {where}" if len(done) > 1 else str(where / "report.html"))
    return ExitCode.PASSED if good == len(done) else ExitCode.NOT_GRADED


def _say_others(names: Sequence[str], rubric: LoadedRubric) -> None:
    if names:
        shown = first_few(names, NAMES_SHOWN)
        say_beside(f"report: {shown}: judged by another version of {rubric.path}")


def write_class_pages(batch: BatchFolder, anonymous: Path | None) -> None:
    """Write the class's page, and one without names to `anonymous`."""
    targets = [(batch.path / INDEX, False), *([(anonymous, True)] if anonymous else [])]
    for target, nameless in targets:
        pairs = ((row.entry, row.result) for row in batch.rows())
        salt = salt_in(batch.path) if nameless else None
        write_class_page(batch.run, pairs, target, anonymous=nameless, salt=salt)
        say(str(target))


def write_form(
    folder: Path, rubric: LoadedRubric, form: str, out: str, prefix: str | None, *, student: bool
) -> ExitCode:
    """Write one form of a submission's report to the file `out`, or to stdout for `-`."""
    result = result_in(folder, rubric)
    if result.rubric.digest != rubric.digest:
        _say_others([folder.absolute().name], rubric)
    if form == "gradescope" and student:
        raise UsageError("Gradescope hides hidden criteria itself", hint="leave out --student")
    # GitHub Classroom shows it to the student
    shown = without_hidden(result, rubric.rubric) if student or form == "classroom" else result
    if form == "terminal" and out == STDOUT:
        hidden = missing_hidden(shown, rubric.rubric)
        Terminal(open_console(sys.stdout)).report(shown, rubric.rubric, hidden=hidden, full=True)
        return ExitCode.PASSED
    where = _prefix(result, prefix) if FORMS[form].cites_lines else ""
    about = ReportInput(
        result=shown,
        rubric=rubric.rubric,
        hidden=missing_hidden(shown, rubric.rubric),
        prefix=where,
        passed=shown.status != "error" and exit_code(shown.criteria, rubric.rubric) is ExitCode.PASSED,
        docs=rubric.docs,
        load_figures=lambda: figures_in(folder, shown, rubric.rubric),
    )
    data = FORMS[form].render(about)
    # bytes, since UTF-8 is what the form says, whatever the terminal has
    if out == STDOUT:
        sys.stdout.buffer.write(data)
    else:
        atomic_write(Path(out), data)
    return ExitCode.PASSED


def _prefix(result: GradingResult, given: str | None) -> str:
    found = package_prefix(result, Path.cwd()) if given is None else given
    cites = any(isinstance(cited, FileCitation) for c in result.criteria for cited in c.citations)
    if found is None and cites:
        package = result.submission.package
        missing = f"no package {package} with these files is here, so paths begin in it"
        say_beside(f"report: {missing}; give its folder with --prefix")
    return found or ""


def judge_evidence(evidence: Sequence[Path], loaded: LoadedRubric, out: str) -> ExitCode:
    """Judge one submission and write its criteria as JSON to the file `out`, or to stdout for `-`."""
    criteria = judge(loaded.rubric, load_evidence(evidence), loaded.checks, loaded.handed_out)
    write_document(out, lambda ascii_only: criteria_text(criteria, ascii_only=ascii_only))
    return exit_code(criteria, loaded.rubric)


def judge_submissions(folders: Sequence[Path], loaded: LoadedRubric, out: str, jobs: int) -> ExitCode:
    """Judge several submissions and write a list of them. One that cannot be judged is reported and does not affect the
    others. Return the exit code of the worst."""
    order = {folder: index for index, folder in enumerate(folders)}
    # workers end in any order
    judged = sorted(judge_all(folders, loaded, jobs), key=lambda one: order[one.folder])
    found = [(one.folder.name, one.error if one.criteria is None else one.criteria) for one in judged]
    write_document(out, lambda ascii_only: judged_text(loaded.rubric, found, ascii_only=ascii_only))
    for one in judged:
        if one.criteria is None:
            report(EvidenceError(one.error, hint=one.hint))
    return worst(
        ExitCode.NOT_GRADED if c is None else exit_code(c, loaded.rubric)
        for c in (j.criteria for j in judged)
    )
