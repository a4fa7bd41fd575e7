"""Files that are missing, misplaced or of the wrong mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import PurePosixPath

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, Site, Solution

OTHER_FOLDER = {"src": "scripts", "scripts": "src"}
TELLING = (".py", ".sh", ".launch", ".yaml", ".yml")


@operator("bit-removed")
def bit_removed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Never makes the script executable.

    Fits every executable file with a shebang.
    """
    for path in solution.programs:
        entry = solution.entry(path)
        if entry.executable:
            tree = solution.with_entry(path, replace(entry, executable=False))
            yield Site(at={"script": path}, tree=tree)


@operator("file-missing")
def file_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to hand in the file.

    Fits every script, launch file and YAML file.
    """
    for path in solution.files:
        if path.endswith(TELLING) or path in solution.programs:
            yield Site(at={"file": path}, tree=solution.without(path))


@operator("file-misnamed")
def file_misnamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the file another name than the handout.

    Fits every script, launch file and YAML file.
    """
    for path in solution.files:
        if path.endswith(TELLING):
            name = PurePosixPath(path)
            yield Site(at={"file": path}, tree=solution.moved(path, str(name.with_stem(f"my_{name.stem}"))))


@operator("script-elsewhere")
def script_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Puts the script into another folder than the handout says.

    Fits every script under src/ or scripts/.
    """
    for path in solution.programs:
        first, _, rest = path.partition("/")
        if rest and first in OTHER_FOLDER:
            yield Site(at={"script": path}, tree=solution.moved(path, f"{OTHER_FOLDER[first]}/{rest}"))


@operator("launch-elsewhere")
def launch_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Keeps the launch file beside package.xml, not in its folder.

    Fits every launch file that lies in a folder.
    """
    for path in solution.files:
        if path.endswith(".launch") and "/" in path:
            yield Site(at={"file": path}, tree=solution.moved(path, PurePosixPath(path).name))


@operator("build-file-missing")
def build_file_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to hand in CMakeLists.txt.

    Fits a package with a CMakeLists.txt and a package.xml.
    """
    if {CMAKE, MANIFEST} <= set(solution.files):
        yield Site(at={"file": CMAKE}, tree=solution.without(CMAKE))
