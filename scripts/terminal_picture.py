"""A program in a terminal, as an SVG that moves: what was on its screen, shown when it came."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape

import pexpect
import pyte
from pyte.screens import Char

COLUMNS, ROWS = 96, 32
CELL_W, CELL_H, MARGIN = 12, 25, 16
"""The size of a character and of the margin, in the SVG's units."""
KEY_S, PAUSE_S, APART_S, LAST_S = 0.07, 0.6, 0.7, 9.0
"""A key of the typed command; the pauses before and after it; changes that come closer are one; the last screen."""
COLOURS = {
    "default": "#d5d8dd",
    "red": "#ff7b72",
    "green": "#7ee787",
    "brown": "#f2cc60",
    "blue": "#79c0ff",
    "magenta": "#d2a8ff",
    "cyan": "#76e3ea",
}
STYLE = """
text {{ font: 20px ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; white-space: pre }}
.screen {{ visibility: hidden }} #s{last} {{ visibility: visible }}
@media (prefers-reduced-motion: no-preference) {{
{rules}
}}
"""


class Screen(NamedTuple):
    """What a terminal shows from a time on, in seconds: the `<text>` elements of its rows."""

    from_s: float
    rows: tuple[str, ...]


def draw_terminal(
    command: str, program: Sequence[str], *, folder: Path, environment: Mapping[str, str]
) -> str:
    """Return the SVG of `program`, run in `folder`, as if `command` had been typed.

    Where the reader wants no motion it shows the last screen.

    Raises:
        pexpect.TIMEOUT: Nothing comes for two minutes.

    """
    terminal = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.Stream(terminal)
    stream.feed("\x1b[32;1m$ \x1b[0m")
    screens = [Screen(0.0, _rows(terminal))]
    for number, key in enumerate(command):
        stream.feed(key)
        screens.append(Screen(PAUSE_S + KEY_S * number, _rows(terminal)))
    stream.feed("\r\n")
    started_s = screens[-1].from_s + PAUSE_S
    seen_s = _read(stream, program, folder, environment)
    return _svg([*screens, *(Screen(started_s + ran_s, _rows(terminal)) for ran_s in seen_s)])


def _read(
    stream: pyte.Stream, program: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> Iterator[float]:
    """Yield the seconds since the program's start when its screen is worth a look, at last at its end."""
    process = pexpect.spawn(
        program[0],
        list(program[1:]),
        cwd=str(folder),
        env={**os.environ, **environment, "TERM": "xterm-256color"},
        dimensions=(ROWS, COLUMNS),
        encoding="utf-8",
        timeout=120,
    )
    begin = seen = time.monotonic()
    while True:
        try:
            stream.feed(process.read_nonblocking(65536, timeout=120))
        except pexpect.EOF:
            break
        if time.monotonic() - seen >= APART_S:
            seen = time.monotonic()
            yield seen - begin
    process.close()
    yield max(time.monotonic(), seen + APART_S) - begin


def _rows(terminal: pyte.Screen) -> tuple[str, ...]:
    rows = []
    for number in range(terminal.lines):
        cells = [(column, terminal.buffer[number][column]) for column in range(terminal.columns)]
        runs = [list(run) for _, run in groupby(cells, key=lambda cell: (cell[1].fg, cell[1].bold))]
        spans = "".join(_span(run[0][0], [cell for _, cell in run]) for run in runs)
        if spans:
            rows.append(f'<text y="{(number + 1) * CELL_H}">{spans}</text>')
    return tuple(rows)


def _span(column: int, cells: Sequence[Char]) -> str:
    """Return the characters, as wide as their cells whatever the reader's font is."""
    text = "".join(cell.data for cell in cells).rstrip()
    if not text:
        return ""
    place = f'x="{column * CELL_W}" textLength="{len(text) * CELL_W}"'
    look = f'fill="{COLOURS[cells[0].fg]}" font-weight="{"bold" if cells[0].bold else "normal"}"'
    return f"<tspan {place} {look}>{escape(text)}</tspan>"


def _svg(screens: Sequence[Screen]) -> str:
    ends_s = [*(screen.from_s for screen in screens[1:]), screens[-1].from_s + LAST_S]
    groups, rules = [], []
    for number, (screen, end_s) in enumerate(zip(screens, ends_s, strict=True)):
        groups.append(f'<g class="screen" id="s{number}">{"".join(screen.rows)}</g>')
        begins, ends = 100 * screen.from_s / ends_s[-1], 100 * end_s / ends_s[-1]
        before = "visible" if number == 0 else "hidden"
        rules.append(
            f"@keyframes k{number} {{ 0% {{ visibility: {before} }} {begins:.2f}% {{ visibility: visible }}"
            f" {ends:.2f}% {{ visibility: hidden }} }}\n"
            f"#s{number} {{ animation: k{number} {ends_s[-1]:.1f}s step-end infinite }}"
        )
    width, height = COLUMNS * CELL_W + 2 * MARGIN, ROWS * CELL_H + 2 * MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">'
        f"<style>{STYLE.format(last=len(screens) - 1, rules=chr(10).join(rules))}</style>\n"
        f'<rect width="{width}" height="{height}" rx="10" fill="#16181d"/>\n'
        f'<g transform="translate({MARGIN} {MARGIN - 6})">\n{chr(10).join(groups)}\n</g></svg>\n'
    )
