"""What a shell loads to complete `grader`."""

from __future__ import annotations

from argcomplete.shell_integration import shellcode


def script(shell: str) -> str:
    """The script for `bash`, `zsh` or `fish`. It asks the installed grader at each key, so it never grows old."""
    return shellcode(["grader"], shell=shell).strip() + "\n"
