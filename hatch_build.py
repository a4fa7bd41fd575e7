"""Adds to the wheel the faulty packages, and what the parser writes: the man page, the completion of three shells."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MAN_PAGE = "share/man/man1/grader.1"
COMPLETIONS = {
    "bash": "share/bash-completion/completions/grader",
    "zsh": "share/zsh/site-functions/_grader",
    "fish": "share/fish/vendor_completions.d/grader.fish",
}
"""Where the shells look of themselves, below the folder that a wheel is installed into."""


class CustomBuildHook(BuildHookInterface):
    """Asks the grader of this very folder. Its parser needs the standard library only, the completion argcomplete."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the faulty packages to the builder, write the other files into a temporary folder, and name them too."""
        del version  # of the kind of wheel, not of the grader
        for path in Path(self.root, "fixtures").glob("*.yaml"):
            build_data["force_include"][str(path)] = f"grader/_data/fixtures/{path.name}"
        sys.path.insert(0, self.root)
        from grader.cli.completion import script  # noqa: PLC0415 - found only now
        from scripts.man_page import man_page  # noqa: PLC0415 - as above

        self.folder = tempfile.TemporaryDirectory()
        texts = {MAN_PAGE: man_page()} | {path: script(shell) for shell, path in COMPLETIONS.items()}
        for number, (target, text) in enumerate(texts.items()):
            source = Path(self.folder.name, str(number))
            source.write_text(text, encoding="utf-8")
            build_data["shared_data"][str(source)] = target

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary folder."""
        del version, build_data, artifact_path
        self.folder.cleanup()
