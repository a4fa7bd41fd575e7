"""`grader inspect FILE`: what is in an evidence file or a bag."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from grader.cli.output import say_json
from grader.errors import ExitCode
from grader.evidence.inspect import ChannelSummary, Inspection, ProcessSummary, inspect_file
from grader.report.terminal import emit, open_console
from grader.report.text import line
from grader.wording import number

CHANNELS_MAX = 500


def run(*, file: Path, as_json: bool = False) -> ExitCode:
    """Print rates, gaps, nodes and how the run went. Raises EvidenceError."""
    inspection = inspect_file(file)
    if as_json:
        say_json(inspection.model_dump(mode="json"))
    else:
        lines = [Text(line(text, 500)) for text in _head(inspection)]
        table: list[RenderableType] = [Text(), _channels(inspection)] if inspection.channels else []
        left = len(inspection.channels) - CHANNELS_MAX
        more = [Text(f"and {left} more channels (--json has them all)")] if left > 0 else []
        emit(open_console(sys.stdout), [*lines, *table, *more])
    return ExitCode.PASSED


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
