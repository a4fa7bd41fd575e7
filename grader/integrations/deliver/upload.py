"""What a student handed in on a platform that takes uploads: a folder of files, or one archive in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.source import Source, parse_source
from grader.integrations.deliver.settings import Modes

ARCHIVES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tar.xz", ".txz", ".bag", ".mcap")
LEFT_BEHIND = ("__MACOSX", ".DS_Store", "Thumbs.db")
"""What systems put beside files that they pack."""


def upload(folder: Path, modes: Modes) -> Source:
    """The folder, or the archive or recording in it where there is one and no folder beside it.

    A folder has lost its file modes on the way, as far as anybody can tell; an archive in it kept them, if it carries
    any. Raises SubmissionError where nothing was handed in.
    """
    entries = _entries(folder)
    if not entries:
        raise SubmissionError(
            "nothing was handed in", hint="hand in the folder of your package, as a .zip or .tar.gz"
        )
    files = [path for path in entries if path.is_file() and not path.is_symlink()]
    archives = [path for path in files if path.name.lower().endswith(ARCHIVES)]
    folders = [path for path in entries if path.is_dir()]
    single = len(archives) == 1 and not folders and not (folder / "package.xml").exists()
    chosen = archives[0] if single else folder
    source = parse_source(str(chosen))
    return replace(source, given=chosen.name if single else "what was handed in", modes=modes)


def _entries(folder: Path) -> list[Path]:
    try:
        found = sorted(folder.iterdir())
    except OSError as error:
        raise SubmissionError(
            f"{folder} cannot be read: {error.strerror}", hint="hand it in again"
        ) from error
    return [path for path in found if path.name not in LEFT_BEHIND]
