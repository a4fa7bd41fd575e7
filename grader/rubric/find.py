"""Where rubrics are: `rubrics/` of a checkout, or what travels inside the wheel."""

from __future__ import annotations

from pathlib import Path

from grader.errors import RubricError
from grader.wording import did_you_mean

PACKAGE = Path(__file__).resolve().parent.parent
SUFFIXES = (".yaml", ".yml")


def rubrics_folder() -> Path:
    """Return the folder of the rubrics that come with the grader."""
    checkout = PACKAGE.parent
    if (checkout / "pyproject.toml").is_file() and (checkout / "rubrics").is_dir():
        return checkout / "rubrics"
    return PACKAGE / "_data" / "rubrics"


def rubric_ids() -> tuple[str, ...]:
    """Return the ids of the rubrics that come with the grader, in order."""
    return tuple(sorted(p.stem for p in rubrics_folder().glob("*.yaml")))


def locate(name_or_path: str) -> tuple[Path, str]:
    """Return the rubric's file, and the name that messages give it. Raises RubricError."""
    if name_or_path in rubric_ids():
        path = rubrics_folder() / f"{name_or_path}.yaml"
        return path, _short(path)
    path = Path(name_or_path)
    if path.suffix in SUFFIXES or "/" in name_or_path or path.is_file():
        return path, name_or_path
    raise RubricError(
        [f'there is no rubric "{name_or_path}"{did_you_mean(name_or_path, rubric_ids())}'],
        hint="grader labs lists the rubrics; a rubric of your own is given by its file name",
    )


def _short(path: Path) -> str:
    """Relative to where the user is, where that is shorter."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
