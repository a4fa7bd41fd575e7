"""Runs a page's console blocks as somebody would who types them, one after the other, and compares what is printed.

In a block, a line that begins with `$ ` is a command, one that begins with `> ` goes on with it, and the others are
what it prints: `...` stands for any number of lines, and within a line for any text. `^C` on a line of its own is
Ctrl-C, pressed when all lines before it have come. A command has to end with 0, unless the page asks for its code next
(`$ echo $?`). A block of another language with a title is a file of that name, written before what follows it.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

LIMIT_S = 200
TITLE = re.compile(r'title="([^"]+)"')
KEEP = '\n__code=$?\n{ export -p; printf \'cd %q\\n\' "$PWD"; } >"$__STATE"\nexit $__code\n'


@dataclass(frozen=True, kw_only=True)
class Command:
    """What is typed, and the lines that the page shows after it."""

    text: str
    shown: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class File:
    """A file that the page has the reader write."""

    name: str
    content: str


def fences(page: str) -> Iterator[tuple[str, str]]:
    """The info string and the content of each fenced block."""
    for token in MarkdownIt("commonmark").parse(page):
        if token.type == "fence":
            yield token.info.strip(), token.content


def steps(page: str) -> list[Command | File]:
    """What the page has its reader do, in order. Raises ValueError for a block that begins with no command."""
    found: list[Command | File] = []
    for info, content in fences(page):
        title = TITLE.search(info)
        if info.split(" ")[0] == "console":
            found += _commands(content)
        elif title:
            found.append(File(name=title[1], content=content))
    return found


def _commands(block: str) -> list[Command]:
    found: list[Command] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append(Command(text=line[2:]))
        elif not found:
            raise ValueError(f"a console block begins with {line!r}, which is no command")
        elif line.startswith("> ") and not found[-1].shown:
            found[-1] = Command(text=f"{found[-1].text}\n{line[2:]}")
        else:
            found[-1] = Command(text=found[-1].text, shown=(*found[-1].shown, line))
    return found


def pattern(shown: tuple[str, ...]) -> re.Pattern[str]:
    """What a command's output has to match as a whole. Blank lines and the ends of lines do not count."""
    parts = []
    for line in shown:
        if line.strip() == "...":
            parts.append(r"(?:[^\n]*\n)*?")
        elif line.strip():
            parts.append(r"[^\n]*".join(map(re.escape, line.rstrip().split("..."))) + r"\n")
    return re.compile("".join(parts))


def plain(output: str) -> str:
    """The output as `pattern` compares it."""
    return "".join(f"{line.rstrip()}\n" for line in output.splitlines() if line.strip())


class Session:
    """One shell in one folder: what a command changes of the folder and of exported variables stays."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._folder = folder
        self._state = folder.parent / f"{folder.name}.state"
        self._environment = {**environment, "__STATE": str(self._state)}
        self._code = 0

    def run_page(self, page: str) -> int:
        """Run all of it; gives the number of commands. Raises AssertionError for what is not as printed."""
        todo = steps(page)
        for step, following in zip(todo, [*todo[1:], None], strict=True):
            if isinstance(step, File):
                (self._here() / step.name).parent.mkdir(parents=True, exist_ok=True)
                (self._here() / step.name).write_text(step.content, encoding="utf-8")
                continue
            asked = isinstance(following, Command) and following.text == "echo $?"
            self._run(step, any_code=asked)
        return sum(isinstance(step, Command) for step in todo)

    def _here(self) -> Path:
        if not self._state.is_file():
            return self._folder
        done = self._bash(f'. "{self._state}"\npwd')
        return Path(done.communicate(timeout=LIMIT_S)[0].strip())

    def _bash(self, script: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["/bin/bash", "-c", script],
            cwd=self._folder,
            env=dict(self._environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=_hears_interrupts,  # noqa: PLW1509 - it starts no thread and takes no lock
        )

    def _run(self, command: Command, *, any_code: bool) -> None:
        before = f'. "{self._state}"\n' if self._state.is_file() else ""
        process = self._bash(f"{before}(exit {self._code})\n{command.text}{KEEP}")
        shown = command.shown
        if "^C" in shown:
            place = shown.index("^C")
            output, errors = _interrupted(process, pattern((*shown[:place], "...")))
            shown = (*shown[:place], *shown[place + 1 :])
        else:
            output, errors = process.communicate(timeout=LIMIT_S)
        self._code = process.returncode
        told = f"$ {command.text}\n{output}\nstderr:\n{errors[-2000:]}\nended with {self._code}"
        assert any_code or self._code == 0, told
        assert pattern(shown).fullmatch(plain(output)), "not as printed:\n" + "\n".join(shown) + f"\n\n{told}"


def _hears_interrupts() -> None:
    """A shell's background job ignores Ctrl-C, and so would all that the tests start in one."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupted(process: subprocess.Popen[str], until: re.Pattern[str]) -> tuple[str, str]:
    """Ctrl-C when the output so far matches; gives all of the output."""
    lines: list[str] = []
    late = threading.Timer(LIMIT_S, lambda: os.killpg(process.pid, signal.SIGKILL))
    late.start()
    try:
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            if until.fullmatch(plain("".join(lines))):
                os.killpg(process.pid, signal.SIGINT)
                break
        rest, errors = process.communicate()
    finally:
        late.cancel()
    return "".join(lines) + rest, errors
