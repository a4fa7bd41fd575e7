"""Whether a file of parameters can be loaded, and holds what it has to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from grader.checks.registry import ProcessName, check
from grader.checks.support.parameters import (
    INDENT,
    Key,
    Words,
    absolute_name,
    describe_missing,
    duplicate_advice,
    explain_yaml,
    explain_yaml_column,
    explain_yaml_line,
    keys_of,
    lines_of,
    params_on_server,
    text_of,
    without_system_params,
)
from grader.checks.support.processes import Life, life
from grader.checks.support.scripts import add_hint, can_be_moved, find_script, move_hint, paths_by_name
from grader.checks.support.text import near_names, shown
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.line_slips.python_habits import LFS_BEGINS, LFS_POINTER
from grader.line_slips.yaml import levels_of
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Citation, FileCitation, Verdict, failed, grade_again, passed
from grader.wording import join_words, plural, there_is


class ParamsLoadedParams(Record):
    """A parameter file and what it has to hold."""

    process: ProcessName
    """The process that runs `rosparam load` on the file."""
    file: str
    """The parameter file, as YAML."""
    names: tuple[str, ...]
    """Names that have to be on the server afterwards, with maps written as paths: `/robot/speed`."""


@check("params-loaded", params=ParamsLoadedParams)
def params_loaded(package: PackageFacts, build: Run, run: Run, params: ParamsLoadedParams) -> Verdict:
    """The parameter file loads, and holds what the lab asks for.

    What it checks
        That `rosparam load` accepts the YAML file, and that all names of the lab are on the parameter
        server afterwards, each with a value.

    Why it matters on a robot
        Settings that differ from robot to robot are kept in such files. If a file does not load, the robot
        does not start, or no node finds the value whose name is wrong.

    How it is measured
        `rosparam load` loads the file as it was handed in; what it sets is compared by name. Values are free. Each
        name earns its share.

    How to fix
        Indent with spaces, two for each level, and write `name: value` with a space after the colon.
        `rosparam load <file>`, then `rosparam list` shows the names.
    """
    wanted = [absolute_name(name) for name in params.names]
    expected = f"rosparam load {params.file} sets {join_words(wanted)}"
    source = find_script(package, params.file)
    found = without_system_params(params_on_server(run))
    one = life(run, params.process)
    if source is None:
        verdict = _no_file(package, build, params.file, wanted)
    elif one is None or one.end is None:
        verdict = grade_again(f"rosparam load {source.path} was not run to its end")
    else:
        lost = _error(run, one, source.path, build)
        lost = lost or _names_missing(found, wanted, source.path, package, build)
        verdict = lost or _loaded(wanted, params.file, source.path, build)
    measured = f"on the server: {join_words(found)}" if found else "nothing on the server"
    cited: tuple[Citation, ...] = (cite(run, "/grader/param"),)
    place = (FileCitation(file=source.path),) if source and not verdict.citations else ()
    return verdict.about(expected=expected, measured=measured, citations=(*place, *cited))


def _names_missing(
    found: dict[str, object], wanted: list[str], path: str, package: PackageFacts, build: Run
) -> Verdict | None:
    missing = [name for name in wanted if found.get(name) in (None, {})]
    there = [name for name in wanted if name not in missing]
    if not missing:
        return None
    return _missing(found, missing, path, package, build).in_part(len(there) / len(wanted), join_words(there))


def _loaded(wanted: list[str], asked: str, path: str, build: Run) -> Verdict:
    moved = f"the handout puts it at {asked}; move it there" if path != asked else ""
    advice = "; ".join(filter(None, (moved, duplicate_advice(path, keys_of(build, path)))))
    return passed(f"{path} loads and sets {join_words(wanted)}", hint=advice)


def _no_file(package: PackageFacts, build: Run, path: str, wanted: list[str]) -> Verdict:
    """Return the loss. A file under another name is what was meant if it has one of the names that are `wanted`."""
    name = PurePosixPath(path).name
    names = paths_by_name(package)
    yaml = [p for n, p in names.items() if n.endswith((".yaml", ".yml"))]
    asked = {part for one in wanted for part in one.split("/") if part}
    near = [names[n] for n in near_names(name, names)]
    near = [p for p in near if not (keys := keys_of(build, p)) or asked & _parts(keys)]
    there = near or yaml
    seen = f"; {there_is(there)}" if there else ""
    movable = [p for p in near if can_be_moved(p, path)]
    hint = move_hint(package, movable[0], path) if movable else add_hint(package, path)
    verdict = failed(f"{path} is not in the package{seen}", hint=hint)
    return verdict.lost_by("file-elsewhere" if movable else "file-missing", path)


def _error(run: Run, one: Life, path: str, build: Run) -> Verdict | None:
    code = one.end.exit_code if one.end else None
    if code == 0:
        return None
    lines = [line.line for _, line in run.lines(one.name) if line.line.strip()]
    words = explain_yaml(lines)
    # What YAML says of a pointer of Git LFS would not help.
    if text_of(build, path).startswith(LFS_BEGINS):
        words = Words(*LFS_POINTER, 1)
    if words is not None and words.line is not None:
        text = text_of(build, path)
        column = explain_yaml_column(text, words.line) if words.hint == INDENT else None
        words = explain_yaml_line(text, words.line) or column or words
    if words is not None:
        cited = (FileCitation(file=path, line=words.line),)
        return failed(f"{path} does not load: {words.why}", hint=words.hint, citations=cited)
    said = f": {shown(lines[-1])}" if lines else ""
    return failed(f"{path} does not load{said}", hint=f"rosparam load {path} shows the line")


def _parts(keys: tuple[Key, ...]) -> set[str]:
    return {part for key in keys for part in key.path.split("/")}


def _missing(
    found: dict[str, object], missing: list[str], path: str, package: PackageFacts, build: Run
) -> Verdict:
    keys = keys_of(build, path)
    if not found:
        return failed(f"{path} sets nothing at all", hint="write `details:` and its values below it")
    name = missing[0]
    if twice := _given_twice(name, path, keys):
        return twice
    if name in found:
        return failed(f"{name} has no value", hint=f"write a value after `{name.rpartition('/')[2]}:`")
    if slip := _in_its_place(found, name, path):
        return slip
    is_or_are = "is" if len(missing) == 2 else "are"
    more = f", and {join_words(missing[1:])} {is_or_are} missing, too" if len(missing) > 1 else ""
    above, _, last = name.rpartition("/")
    shallow = f"{above.rpartition('/')[0]}/{last}"
    moved = _column(name, shallow, keys, missing)
    hint = f"write it so that rosparam list shows exactly {name}"
    root = name.split("/")[1]
    if all(one.removeprefix(f"/{root}") in found for one in missing):
        hint = f"write `{root}:` above them, and indent them all by two more spaces"
    elif nested := _levels(missing, found):
        flat = ["_".join(one.split("/")[1:]) for one in missing]
        sources = [text_of(build, file.path) for file in package.files if file.python]
        is_read = any(f"{quote}{one}" in text for text in sources for one in flat for quote in "'\"/")
        hint = f"{nested}; then read them there in the script too" if is_read else nested
    elif shallow in found:
        readers = join_words(_readers(package, build, shallow, above))
        hint = f"{moved}; then change {readers}, to read it there" if readers else moved
    return failed(f"{path} loads, but {describe_missing(found, name)}{more}", hint=hint)


def _levels(missing: list[str], found: dict[str, object]) -> str:
    """Return how to nest keys that the file has flat, as `details_name_first` or `first`; "" where it is one block, or
    the lab asks for other levels than three."""
    for name in missing:
        _, *parts = name.split("/")
        flat = {sign.join(parts[first:]) for sign in "_.-" for first in range(len(parts))}
        root = {f"{parts[0]}/{parts[-1]}"}
        if not any(f"/{one}" in found for one in flat | root):
            return ""
    return levels_of(missing)


def _readers(package: PackageFacts, build: Run, name: str, not_below: str) -> Iterator[str]:
    """Yield the lines of scripts that read a parameter where the file has it now: by its path, or by its key alone."""
    last, beside = name.rpartition("/")[2], not_below.rpartition("/")[2]
    key = re.compile(
        rf"""(?<!['"]{re.escape(beside)}['"]\])\[\s*['"]{re.escape(last)}['"]\s*\]|{re.escape(name.lstrip("/"))}\b"""
    )
    for file in package.files:
        lines = text_of(build, file.path).splitlines() if file.python else []
        yield from (f"{file.path}, line {n}" for n, line in enumerate(lines, start=1) if key.search(line))


def _given_twice(name: str, path: str, keys: tuple[Key, ...]) -> Verdict | None:
    """A map that is begun a second time: YAML keeps only the last."""
    lines = lines_of(keys)
    above = next((k for k, at in lines.items() if len(at) > 1 and f"{name}/".startswith(f"{k}/")), None)
    if above is None:
        return None
    first, *_, second = lines[above]
    last = above.rpartition("/")[2]
    where = f"on line {first} and again on line {second}"
    message = f"{path} has `{last}:` {where}, and only the last one counts: there is no {name}"
    hint = f"delete line {second}, and put what stands below it under the `{last}:` on line {first}"
    return failed(message, hint=hint, citations=(FileCitation(file=path, line=second),))


def _column(name: str, shallow: str, keys: tuple[Key, ...], missing: list[str]) -> str:
    """How far to indent a name that stands one level too high: as far as its neighbours are."""
    above, _, last = name.rpartition("/")
    beside = next((key for key in keys if key.path.rpartition("/")[0] == above), None)
    own = next((key for key in keys if key.path == shallow), None)
    parent = above.rpartition("/")[2]
    if own is not None and all(key.path != above for key in keys):
        lasts = [one.rpartition("/")[2] for one in missing if one.rpartition("/")[0] == above]
        return f"write `{parent}:` above line {own.line}, as far in, and indent {join_words(lasts)} by two more spaces"
    if beside is None:
        return f"indent {last} by two spaces more than {parent}, below it"
    where = f"line {own.line}" if own else f"the line of {last}"
    neighbour = f"line {beside.line} (`{beside.path.rpartition('/')[2]}:`)"
    told = f"begin {where} with {plural(beside.indent, 'space')}, as {neighbour}"
    return f"{told}, so that `{last}:` is below `{parent}:`"


def _in_its_place(found: dict[str, object], name: str, path: str) -> Verdict | None:
    """A list, or a text that has the name in it, where the name's map belongs."""
    last = name.rpartition("/")[2]
    for above in (one for one in found if name.startswith(f"{one}/")):
        value = found[above]
        if isinstance(value, list):
            why = f"{above} is a list, so there is no {name}"
            return failed(f"{path} loads, but {why}", hint="remove the `-`: write each name on its own line")
        if isinstance(value, str) and f"{last}:" in value:
            why = f"{above} is the text {shown(value)!r}, so there is no {name}"
            return failed(f"{path} loads, but {why}", hint=f"write a space after each colon: `{last}: …`")
    return None
