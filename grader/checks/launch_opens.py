"""Whether a launch file runs a shell script that opens a web page."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.executable import ExecutableParams, executable
from grader.checks.launch_xml import missing_node
from grader.checks.registry import LaunchName, check
from grader.checks.support.launch import (
    died,
    node_slip,
    nodes_of_script,
    nodes_up,
    not_run,
    quoted,
    read_launch,
    refusal,
    refusals,
    why_died,
    why_not_up,
)
from grader.checks.support.scripts import RIGHT_SHEBANG, find_script
from grader.checks.support.text import bare, shown
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.model.package import LaunchFile, LaunchNode, PackageFacts, SourceFile
from grader.model.record import Record
from grader.model.verdict import FileCitation, Status, Verdict, failed, passed
from grader.wording import join_words

SHELL = "#!/bin/bash"
ASSIGNED = re.compile(
    r"(?P<file>[\w.-]+\.\w+): (?:line )?(?P<line>\d+): (?P<name>[A-Za-z_]\w*): (?:command )?not found$"
)
"""What bash and dash say of a name with a blank before its `=`."""


class OpensParams(Record):
    """A page that the launch file opens."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    program: str = "firefox"
    """The program that is asked to open the page."""
    urls: tuple[str, ...]
    """The addresses of which one has to be opened."""
    script: str
    """The script whose node has to run beside it."""


class Page(NamedTuple):
    """What a program was asked to open, and when."""

    at_ns: int
    program: str
    arguments: tuple[str, ...]


@check("opens", params=OpensParams)
def opens(package: PackageFacts, build: Run, run: Run, params: OpensParams) -> Verdict:
    """The launch file's shell script opens the page, and the node runs beside it.

    What it checks
        That a `<node>` of the launch file is a shell script of the package, whatever its name, which is
        executable and opens the page in the program; and that the node runs at the same time.

    Why it matters on a robot
        Launch files start more than nodes: drivers, cameras and tools have their own start scripts, and they
        need the executable bit and a first line as every node does.

    How it is measured
        The program's place is taken by one that notes what it is asked to open. The script's mode and first
        line are those of the file as handed in. A `/` at the end of the page's address does not matter.

    How to fix
        Begin the script with `#!/bin/bash`, `chmod +x` it, and write `<node pkg="<package>" type="<script>.sh"
        name="…" output="screen"/>`. `rosrun <package> <script>.sh` tries it alone.
    """
    expected = f"a shell script in {params.launch} opens {params.urls[0]} in {params.program}, beside a node"
    file = read_launch(package, params.launch)
    pages = _pages(run)
    measured = f"opened: {join_words(_shown(p) for p in pages)}" if pages else "nothing was opened"
    if isinstance(file, Verdict):
        return file.about(expected=expected)
    verdict = (
        not_run(run)
        or _script(package, build, file, params)
        or _page(package, file, run, params)
        or missing_node(package, file, params.script)
        or _beside(package, file, run, params)
        or passed(
            f"{join_words(n.type or '' for n in _shells(package, file))} opens "
            f"{_url(pages, params)} in {params.program}"
        )
    )
    citations = verdict.citations or (FileCitation(file=file.path, line=1), cite(run, "/grader/actor"))
    return verdict.about(expected=expected, measured=measured, citations=citations)


def _pages(run: Run) -> tuple[Page, ...]:
    asked = ((t, e) for t, e in run.actors if e.action == "open")
    return tuple(Page(t, e.actor, tuple(map(str, e.value or ()))) for t, e in asked)


def _shells(package: PackageFacts, file: LaunchFile) -> list[LaunchNode]:
    """Nodes of the package that are scripts, and not Python."""
    found = ((n, find_script(package, n.type or "")) for n in file.brings if n.pkg == package.name)
    return [n for n, source in found if source is not None and _is_shell(source)]


def _is_shell(source: SourceFile) -> bool:
    if source.path.endswith(".sh"):
        return not source.binary
    shell = source.shebang is not None and source.shebang.interpreter.endswith("sh")
    return not source.python and not source.binary and (shell or not source.path.endswith(".py"))


def _script(package: PackageFacts, build: Run, file: LaunchFile, params: OpensParams) -> Verdict | None:
    """The shell script is named by the launch file, and can be run as handed in."""
    shells = _shells(package, file)
    if not shells:
        return _no_shell(package, file, params)
    verdicts = []
    for node in shells:
        source = find_script(package, node.type or "")
        path = source.path if source else node.type or ""
        verdict = executable(package, build, ExecutableParams(path=path))
        verdicts.append(_of_shell(verdict))
    return None if any(v.status is Status.PASS for v in verdicts) else verdicts[0]


def _of_shell(verdict: Verdict) -> Verdict:
    """Return the executable check's words with the shell's first line."""
    words = {name: getattr(verdict, name).replace(RIGHT_SHEBANG, SHELL) for name in ("message", "hint")}
    return verdict.model_copy(update=words)


def _no_shell(package: PackageFacts, file: LaunchFile, params: OpensParams) -> Verdict:
    others = (n for n in file.brings if n not in nodes_of_script(package, file, params.script))
    slips = [slip for node in others if (slip := node_slip(package, node))]
    if slips:
        return slips[0].verdict()
    lying = [f.path for f in package.files if f.path.endswith(".sh")]
    seen = f"; there is {join_words(lying)} in the package" if lying else ""
    name = PurePosixPath(lying[0]).name if lying else "<script>.sh"
    hint = f'add <node pkg="{package.name}" type="{name}" name="…" output="screen"/>'
    return failed(f"{file.path} has no <node> that is a shell script{seen}", hint=hint)


def _page(package: PackageFacts, file: LaunchFile, run: Run, params: OpensParams) -> Verdict | None:
    """The page was opened, in the program that was asked for."""
    pages = _pages(run)
    mine = [p for p in pages if _is_program(p.program, params)]
    if _url(mine, params):
        return None
    cited = tuple(cite(run, "/grader/actor", p.at_ns) for p in pages[:1])
    hint = f"write {params.program} {params.urls[0]} in the script"
    if not mine and _url(pages, params):
        message = f"the page is opened in {join_words(p.program for p in pages)}, not in {params.program}"
        return failed(message, hint=hint, citations=cited)
    if mine:
        message = (
            f"{params.program} is asked to open {join_words(map(_arguments, mine))}, not {params.urls[0]}"
        )
        if blank := _blanks(run, mine):
            where = f"{PurePosixPath(blank['file']).name}, line {blank['line']}"
            message += (
                f": in {where}, the shell takes {blank['name']} for a command, because a space follows it"
            )
            hint = f"write {blank['name']}=… in {where}, without spaces around the `=`"
        return failed(message, hint=hint, citations=cited)
    if slip := next(refusals(package, file), None):
        return slip.verdict(quoted(run))
    if absence := refusal(run):
        return failed(absence.why, hint=absence.hint)
    return failed(f"the script opens nothing in {params.program}{_words(package, file, run)}", hint=hint)


def _blanks(run: Run, pages: list[Page]) -> re.Match[str] | None:
    """Return what the shell said of `URL = …`, where no address came to the program because of that."""
    if any(re.search(r"[./]", argument) for page in pages for argument in page.arguments):
        return None
    return next(filter(None, (ASSIGNED.search(bare(c.line)) for _, c in run.console)), None)


def _words(package: PackageFacts, file: LaunchFile, run: Run) -> str:
    """Return what the script or roslaunch said instead."""
    lines = [bare(c.line) for _, c in run.console]
    shell = re.compile(
        r"command not found|No such file|[Ss]yntax error|not found$|bad interpreter|cannot launch node"
    )
    if found := next((line for line in lines if shell.search(line)), ""):
        return f": {shown(found)}"
    code = next((code for node in _shells(package, file) if (code := died(run, node)) is not None), None)
    return f": it died with exit code {code}" if code is not None else quoted(run)


def _beside(package: PackageFacts, file: LaunchFile, run: Run, params: OpensParams) -> Verdict | None:
    node = nodes_of_script(package, file, params.script)[0]
    ended = why_died(package, run, node)
    if nodes_up(run, node) and ended is None:
        return None
    absence = ended or why_not_up(package, run, node)
    return absence.verdict(f"the page is opened, but {node.type} does not run beside it: {absence.why}")


def _is_program(name: str, params: OpensParams) -> bool:
    """`firefox-esr` is Firefox, as Debian calls it."""
    return name == params.program or name.startswith(f"{params.program}-")


def _url(pages: list[Page] | tuple[Page, ...], params: OpensParams) -> str:
    """The first argument that is one of the addresses."""
    wanted = {_plain(url) for url in params.urls}
    return next((a for p in pages for a in p.arguments if _plain(a) in wanted), "")


def _plain(url: str) -> str:
    """Host and scheme in small letters, no slash at the end."""
    scheme, mark, rest = url.strip("'\" ").rpartition("://")
    host, slash, path = rest.partition("/")
    return f"{scheme.lower()}{mark}{host.lower()}{slash}{path}".rstrip("/")


def _shown(page: Page) -> str:
    return shown(f"{page.program} {' '.join(page.arguments)}")


def _arguments(page: Page) -> str:
    return shown(" ".join(page.arguments)) or "nothing"
