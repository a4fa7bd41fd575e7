"""`grader inspect FILE`: what is in an evidence file or a bag."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from grader.cli.inspection import Inspection, TopicSummary, summarise
from grader.errors import ExitCode
from grader.evidence.reader import load_run
from grader.report.terminal import open_console
from grader.report.text import clip, number, visible

SOURCES = ("publisher", "type")


def run(*, file: Path, as_json: bool = False) -> ExitCode:
    """Print rates, gaps, nodes and how the run went. Raises EvidenceError."""
    inspection = summarise(load_run(file))
    if as_json:
        print(inspection.model_dump_json(indent=2))
        return ExitCode.PASSED
    console = open_console(sys.stdout)
    for text in _head(inspection):
        console.print(Text(visible(text)))
    if inspection.topics:
        console.print()
        _print_topics(inspection.topics, console)
    return ExitCode.PASSED


def _head(inspection: Inspection) -> list[str]:
    warp = f", {inspection.warp:g} times as fast" if inspection.clock == "warped" else ""
    counts = f"{inspection.messages} messages, {len(inspection.topics)} channels"
    lines = [
        f"{inspection.evidence}: scenario {inspection.scenario}, clock {inspection.clock}{warp}",
        f"{number(inspection.duration_s)} s, {counts}",
    ]
    if inspection.outcome:
        lines.append(f"ended: {inspection.outcome}")
    if inspection.nodes:
        lines.append(f"nodes: {' '.join(inspection.nodes)}")
    lines += [f"process {process.name}: {process.end}" for process in inspection.processes]
    if inspection.console_lines:
        lines.append(f"console: {inspection.console_lines} lines")
    return lines


def _print_topics(topics: tuple[TopicSummary, ...], console: Console) -> None:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    table.add_column("topic", overflow="fold")
    for heading in SOURCES:
        table.add_column(heading, overflow="fold")
    for heading in ("count", "Hz", "gaps ms min/median/max"):
        table.add_column(heading, justify="right")
    for topic in topics:
        cells = (topic.topic, topic.publisher, topic.type, str(topic.messages), _rate(topic), _gaps(topic))
        table.add_row(*(Text(visible(clip(cell, 200))) for cell in cells))
    console.print(table)


def _rate(topic: TopicSummary) -> str:
    return "" if topic.rate_hz is None else f"{topic.rate_hz:.2f}"


def _gaps(topic: TopicSummary) -> str:
    gaps = (topic.gap_min_ms, topic.gap_median_ms, topic.gap_max_ms)
    return "/".join(f"{gap:.1f}" for gap in gaps if gap is not None)
