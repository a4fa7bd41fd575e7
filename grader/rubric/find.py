"""Where rubrics are: those that come with the grader, its examples, and folders of the user's own.

`rubrics/` of a checkout, or what travels inside the wheel; then the folders of `$GRADER_RUBRICS`, then those that
`grader labs --add` has written down. Nothing is looked for where a submission lies: all of these are absolute paths.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yaml

from grader.errors import RubricError, UsageError
from grader.files import atomic_write, user_folder
from grader.rubric.yaml_lines import RUBRIC, read_bytes
from grader.wording import did_you_mean

PACKAGE = Path(__file__).resolve().parent.parent
SUFFIXES = (".yaml", ".yml")
VARIABLE = "GRADER_RUBRICS"
SCHEMA = "grader.rubric/"
BUILT_IN = "the grader"
EXAMPLE = "the grader's examples"


class LabFile(NamedTuple):
    """A rubric by its id; `packages` is empty where the file cannot be read. `source` says where it was found: a folder
    of the user's, `the grader` or `the grader's examples`."""

    id: str
    path: Path
    packages: tuple[str, ...]
    source: str = BUILT_IN

    @property
    def package(self) -> str:
        """The main one of its packages, "" where there is none."""
        return next(iter(self.packages), "")


def checkout() -> Path | None:
    """Return the clone that the grader runs from, or None if it is installed."""
    root = PACKAGE.parent
    # In site-packages lies no pyproject.toml, whatever else is called rubrics there.
    return root if (root / "pyproject.toml").is_file() and (root / "rubrics").is_dir() else None


def rubrics_folder() -> Path:
    """Return the folder of the rubrics that come with the grader."""
    return (checkout() or PACKAGE / "_data") / "rubrics"


def rubric_ids() -> tuple[str, ...]:
    """Return the ids of the rubrics that come with the grader, in order."""
    return tuple(sorted(p.stem for p in rubrics_folder().glob("*.yaml")))


def own_folders() -> tuple[Path, ...]:
    """Return the folders in which the user's own labs are. Raises UsageError for a path that is not absolute."""
    named = [Path(entry) for entry in os.environ.get(VARIABLE, "").split(os.pathsep) if entry]
    relative = next((path for path in named if not path.is_absolute()), None)
    if relative is not None:
        raise UsageError(
            f"${VARIABLE} names {relative}, which is not an absolute path",
            hint="what is found must not depend on the folder that the grader is started in",
        )
    return tuple(dict.fromkeys([*named, *_written_down()]))


def add_folder(folder: Path) -> Path:
    """Write a folder down, and return its absolute path. Raises UsageError where there is no rubric in it."""
    absolute = folder.expanduser().resolve()
    if not any(_rubrics_in(absolute)):
        what = (
            "has no rubric in it"
            if absolute.is_dir()
            else "is a file"
            if absolute.exists()
            else "is not there"
        )
        raise UsageError(f"{folder} {what}", hint="give the folder in which your rubrics' files are")
    _write_down([*(path for path in _written_down() if path != absolute), absolute])
    return absolute


def remove_folder(folder: Path) -> Path:
    """Take a folder out again, and return its absolute path. Raises UsageError where it was not written down."""
    absolute = folder.expanduser().resolve()
    there = _written_down()
    if absolute not in there:
        raise UsageError(f"{absolute} is not among your folders of labs", hint="grader labs lists them")
    _write_down([path for path in there if path != absolute])
    return absolute


def config_file() -> Path:
    """Return the file that holds these folders, one a line."""
    return user_folder("config") / "rubrics"


def known_labs() -> tuple[LabFile, ...]:
    """Return all labs: those that come with the grader in order of their ids, then the user's own."""
    return (*_built_in(rubrics_folder()), *(lab for place in own_folders() for lab in _rubrics_in(place)))


def example_labs() -> tuple[LabFile, ...]:
    """Return the examples of rubrics that come with the grader, in order of their ids."""
    return _built_in(rubrics_folder() / "examples", EXAMPLE)


def named_labs(name: str) -> list[LabFile]:
    """Return the labs with that id: the known ones, else the example."""
    known = [lab for lab in known_labs() if lab.id == name]
    return known or [lab for lab in example_labs() if lab.id == name]


# The grader's own files do not change while it runs; a user's may.
@cache
def _built_in(folder: Path, source: str = BUILT_IN) -> tuple[LabFile, ...]:
    paths = sorted(folder.glob("*.yaml"))
    return tuple(LabFile(path.stem, path, _texts(path, "package"), source) for path in paths)


def locate(name_or_path: str) -> tuple[Path, str]:
    """Return the rubric's file, and the name that messages give it. Raises RubricError, and UsageError where several
    labs have that id."""
    path = Path(name_or_path)
    if path.suffix in SUFFIXES or "/" in name_or_path:
        return path, name_or_path
    found = [lab.path for lab in named_labs(name_or_path)]
    if len(found) > 1:
        paths = ", ".join(short_path(path) for path in found)
        raise UsageError(
            f"{len(found)} labs are called {name_or_path}: {paths}",
            hint="give the file, or another id to one of them",
        )
    if found:
        return found[0], short_path(found[0])
    if path.is_file():
        return path, name_or_path
    known = [lab.id for lab in (*known_labs(), *example_labs())]
    raise RubricError(
        [f'there is no rubric "{name_or_path}"{did_you_mean(name_or_path, known)}'],
        hint="grader labs lists the rubrics; a rubric of your own is given by its file name",
    )


def _rubrics_in(folder: Path) -> Iterator[LabFile]:
    """Yield the rubrics in a folder, and one level below it. Other YAML files are left out."""
    try:
        paths = sorted(
            p for p in (*folder.glob("*"), *folder.glob("*/*")) if p.suffix in SUFFIXES and p.is_file()
        )
    except OSError:
        return
    for path in paths:
        schema, packages = _text(path, "schema"), _texts(path, "package")
        if schema.startswith(SCHEMA) or (not schema and packages):
            yield LabFile(_text(path, "id") or path.stem, path, packages, str(folder))


def _text(path: Path, key: str) -> str:
    return next(iter(_texts(path, key)), "")


def _texts(path: Path, key: str) -> tuple[str, ...]:
    try:
        return texts_at(path, path.name, key)
    except RubricError:  # named where the rubric is loaded
        return ()


def texts_at(path: Path, name: str, key: str) -> tuple[str, ...]:
    """Return the text, or the list of texts, that a file has at one key of its first level, read no further; none where
    it has nothing there.

    Raises RubricError where the file cannot be read up to there.
    """
    found, is_key, depth = "", False, 0
    texts: list[str] | None = None
    try:
        # Events and not the whole: this is asked of every lab on the machine, also of files with faults further down.
        for event in yaml.parse(read_bytes(path, name, RUBRIC), Loader=yaml.SafeLoader):
            begins = isinstance(event, yaml.CollectionStartEvent)
            if depth == 0 and isinstance(event, yaml.SequenceStartEvent):
                break
            if depth == 1 and isinstance(event, yaml.NodeEvent):
                is_key = not is_key
                value = str(event.value) if isinstance(event, yaml.ScalarEvent) else ""
                if found == key and not is_key:
                    if not isinstance(event, yaml.SequenceStartEvent):
                        return (value,) if value else ()
                    texts = []
                found = value
            elif texts is not None and isinstance(event, yaml.ScalarEvent):
                texts.append(str(event.value))
            depth += begins - isinstance(event, yaml.CollectionEndEvent)
            if texts is not None and depth == 1:
                break
    except yaml.YAMLError as error:
        raise RubricError([f"{name}: is not YAML"]) from error
    return tuple(texts or ())


def _written_down() -> tuple[Path, ...]:
    try:
        lines = config_file().read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return ()
    # A relative path in the file would depend on where the grader is started.
    return tuple(Path(line) for line in lines if line.startswith("/"))


def _write_down(folders: list[Path]) -> None:
    atomic_write(config_file(), "".join(f"{folder}\n" for folder in folders).encode())


def short_path(path: Path) -> str:
    """Return the path relative to where the user is, where that is shorter."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
