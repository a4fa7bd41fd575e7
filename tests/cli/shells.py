"""Real shells, in which a key is pressed as a user presses it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pexpect
import pytest

BIN = Path(sys.executable).parent
PROMPT = "ready> "
TAB, CLEAR = "\t", "\x15"
CONTROLS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|[\r\x07]")
SECONDS = 120
START = {
    "bash": (
        ["--norc", "--noprofile", "-i"],
        "bind 'set show-all-if-ambiguous on'",
        "bind 'set completion-query-items 0'",
        "bind 'set page-completions off'",
        "source <(grader completion bash)",
    ),
    "zsh": (
        ["-f", "-i"],
        "bindkey -e; LISTMAX=9999; unsetopt beep list_ambiguous prompt_sp prompt_cr",
        "autoload -U compinit && compinit -D -u",
        "source <(grader completion zsh)",
    ),
}


def environment() -> dict[str, str]:
    """In which `grader` is the one under test."""
    return {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}", "TERM": "dumb", "PS1": PROMPT}


class Typed:
    """bash or zsh at a terminal, in a folder."""

    def __init__(self, shell: str, folder: Path) -> None:
        program = need(shell)
        argv, *commands = START[shell]
        self.child = pexpect.spawn(
            program,
            argv,
            cwd=str(folder),
            env=environment(),
            encoding="utf-8",
            timeout=SECONDS,
            dimensions=(400, 160),
        )
        for command in commands:
            self.child.expect_exact(PROMPT)
            self.child.sendline(command)
        self.child.expect_exact(PROMPT)

    def missing(self, line: str, *words: str) -> list[str]:
        """Type the line and TAB; return the words that do not appear behind it."""
        self.child.send(line + TAB)
        text = ""
        with suppress(pexpect.TIMEOUT, pexpect.EOF):
            while any(word not in text for word in words):
                text += CONTROLS.sub("", self.child.read_nonblocking(4096, timeout=SECONDS))
        self.child.sendline(CLEAR)
        self.child.expect_exact(PROMPT)
        return [word for word in words if word not in text]

    def close(self) -> None:
        """End it."""
        self.child.close(force=True)


class Asked:
    """fish, which tells without a terminal what TAB would offer."""

    def __init__(self, folder: Path) -> None:
        self.program = need("fish")
        self.folder = folder

    def missing(self, line: str, *words: str) -> list[str]:
        """Return the words that are no offer."""
        script = "grader completion fish | source; complete --do-complete $argv[1]"
        done = subprocess.run(
            [self.program, "--no-config", "-c", script, line],
            cwd=self.folder,
            env=environment(),
            capture_output=True,
            text=True,
            check=True,
            timeout=SECONDS,
        )
        offers = [offer.partition("\t")[0] for offer in done.stdout.splitlines()]
        return [word for word in words if word.strip() not in offers]

    def close(self) -> None:
        """There is nothing to end."""


def need(shell: str) -> str:
    """Where that shell is. Skips the test where it is not."""
    found = shutil.which(shell)
    if found is None:
        pytest.skip(f"no {shell} here: apt-get install {shell}")
    return found
