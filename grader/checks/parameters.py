"""Whether a file's parameters can be loaded."""

from __future__ import annotations

from pathlib import PurePosixPath

from grader.checks.executable import find_script
from grader.checks.registry import check
from grader.checks.support.param_tree import absolute, instead, own, tree
from grader.checks.support.process import Life, life
from grader.checks.support.text import near_names, shown
from grader.checks.support.yaml_words import explain_yaml
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    Citation,
    EvidenceCitation,
    FileCitation,
    Verdict,
    failed,
    inconclusive,
    passed,
)
from grader.wording import join_words


class ParamsLoadedParams(Record):
    """`process` runs `rosparam load` on `file`; `names` have to be on the server afterwards, maps taken apart."""

    process: str
    file: str
    names: tuple[str, ...]


@check("params-loaded", params=ParamsLoadedParams)
def params_loaded(package: PackageFacts, run: Run, params: ParamsLoadedParams) -> Verdict:
    """The parameter file loads, and holds what the lab asks for.

    What it checks
        That `rosparam load` takes the YAML file, and that all names of the lab are on the parameter server
        afterwards, each with a value.

    Why it matters on a robot
        What differs from robot to robot is kept in such files. A file that does not load stops the robot as it
        starts, and a value under another name is one that nobody reads.

    How it is measured
        `rosparam load` loads the file as it was handed in; what it sets is compared by name. Values are free.

    How to fix
        Indent with spaces, two for each level, and write `name: value` with a space behind the colon.
        `rosparam load <file>`, then `rosparam list` shows the names.
    """
    wanted = [absolute(name) for name in params.names]
    expected = f"rosparam load {params.file} sets {join_words(wanted)}"
    source = find_script(package, params.file)
    found = own(tree(run))
    one = life(run, params.process)
    if source is None:
        verdict = _no_file(package, params.file)
    elif one is None or one.end is None:
        verdict = inconclusive(f"rosparam load {source.path} was not run to its end", hint="grade again")
    else:
        missing = [name for name in wanted if _is_empty(found, name)]
        error = _error(run, one, source.path)
        verdict = error or (
            _missing(found, missing, source.path)
            if missing
            else passed(
                f"{source.path} loads and sets {join_words(wanted)}",
                hint=_place_hint(source.path, params.file),
            )
        )
    measured = f"on the server: {join_words(found)}" if found else "nothing on the server"
    cited: tuple[Citation, ...] = (EvidenceCitation(evidence=run.evidence, topic="/grader/param"),)
    place = (FileCitation(file=source.path),) if source and not verdict.citations else ()
    update = {"expected": expected, "measured": measured, "citations": (*verdict.citations, *place, *cited)}
    return verdict.model_copy(update=update)


def _no_file(package: PackageFacts, path: str) -> Verdict:
    name = PurePosixPath(path).name
    names = {PurePosixPath(f.path).name: f.path for f in package.files}
    yaml = [p for n, p in names.items() if n.endswith((".yaml", ".yml"))]
    near = [names[n] for n in near_names(name, names)] or yaml
    seen = f"; there is {join_words(near)}" if near else ""
    hint = f"git mv {near[0]} {path}" if near else f"write {path}, then git add, commit and push it"
    return failed(f"{path} is not in the package{seen}", hint=hint)


def _error(run: Run, one: Life, path: str) -> Verdict | None:
    """What rosparam said where it failed."""
    code = one.end.exit_code if one.end else None
    if code == 0:
        return None
    lines = [line.line for _, line in run.lines(one.name) if line.line.strip()]
    words = explain_yaml(lines)
    if words is not None:
        cited = (FileCitation(file=path, line=words.line),)
        return failed(f"{path} does not load: {words.why}", hint=words.hint, citations=cited)
    said = f": {shown(lines[-1])}" if lines else ""
    return failed(
        f"{path} does not load{said}", hint=f"rosparam load {PurePosixPath(path).name} shows the line"
    )


def _missing(found: dict[str, object], missing: list[str], path: str) -> Verdict:
    if not found:
        return failed(f"{path} sets nothing at all", hint="write `details:` and its values below it")
    name = missing[0]
    if name in found:
        return failed(f"{name} has no value", hint=f"write a value behind `{name.rpartition('/')[2]}:`")
    if slip := _in_its_place(found, name, path):
        return slip
    more = f", and {len(missing) - 1} more names are missing" if len(missing) > 1 else ""
    above, _, last = name.rpartition("/")
    shallow = f"{above.rpartition('/')[0]}/{last}"
    moved = f"indent {last} by two spaces more, so that it is below {above.rpartition('/')[2]}"
    hint = moved if shallow in found else f"write it so that rosparam list shows {name}, letter by letter"
    return failed(f"{path} loads, but {instead(found, name)}{more}", hint=hint)


def _in_its_place(found: dict[str, object], name: str, path: str) -> Verdict | None:
    """A list, or a text that has the name in it, where the name's map belongs."""
    last = name.rpartition("/")[2]
    for above in (one for one in found if name.startswith(f"{one}/")):
        value = found[above]
        if isinstance(value, list):
            why = f"{above} is a list, so there is no {name}"
            return failed(f"{path} loads, but {why}", hint="take the `-` away: write names below each other")
        if isinstance(value, str) and f"{last}:" in value:
            why = f"{above} is the text {shown(value)!r}, so there is no {name}"
            return failed(f"{path} loads, but {why}", hint=f"write a space behind each colon: `{last}: …`")
    return None


def _is_empty(found: dict[str, object], name: str) -> bool:
    return found.get(name) in (None, {})


def _place_hint(path: str, wanted: str) -> str:
    return "" if path == wanted else f"the handout puts it at {wanted}; move it there"
