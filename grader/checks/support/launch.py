"""The nodes of a launch file in a run: what roslaunch printed, and why a node is not there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import Check
from grader.checks.support.exit_causes import explain_code, explain_traceback, process_tracebacks, syntax_hint
from grader.checks.support.launch_slips import (
    PROGRAMS_OF,
    at_its_lines,
    namespace_meant,
    node_slip,
    own_script,
    owner_of,
    program_of_source,
    programs_hint,
)
from grader.checks.support.missing_packages import is_of_another_lab
from grader.checks.support.parameters import explain_yaml
from grader.checks.support.processes import early_end, first_interrupt_ns, lives, observed_until_ns
from grader.checks.support.scripts import (
    BUILD_FIRST_HINT,
    asks_for_wrapper,
    paths_by_name,
    programs,
    shebang_obstacles,
)
from grader.checks.support.text import INIT, near_names, shown
from grader.evidence.run import Run
from grader.installable import install_hint, known_packages
from grader.model.launch_file import SUBSTITUTION, LaunchFile, LaunchNode
from grader.model.package import PackageFacts, SourceFile
from grader.model.submission import chmod_hint
from grader.model.verdict import (
    FileCitation,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    joined,
    machine_lacks,
)
from grader.untrusted_text import without_colours
from grader.wording import join_words, on_lines

NOT_EXECUTED = (2, 126, 127)
"""Exit codes of `env` and of a shell that find no such program, or cannot read what it is given."""
# The first of these that is found is quoted, so the vaguer ones come later.
_ERRORS = (
    "ERROR: cannot launch", "RLException", "Invalid ", "ERROR:", "process has died", "roslaunch:",
    "Resource not found",
)  # fmt: skip
_SUBSTITUTION = re.compile(r"\\\$\\\(([^)]*)\\\)")
# Students print such lines too: between brackets is no other bracket, so that a line is looked through once.
_UNSET = re.compile(r"requires the '(\w+)' arg to be set")
_STARTED = re.compile(r"process\[([^\s\[\]]+)-\d+\]: started with pid")
_DIED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has died \[pid \d+, exit code (-?\d+)")
_FINISHED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has finished cleanly")
_REQUIRED = re.compile(r"REQUIRED process (\[[^\s\[\]]+-\d+\]) has died")
NO_PACKAGE = r"Resource not found: (?:The following package was not found in .*: )?(\S+)"
NO_FILE = r"file does not exist \[([^\[\]\n]+)\]"
BAD_FILE = r"error loading <rosparam> tag"
_NO_YAML = re.compile(r"file (\S+) contains invalid YAML")
NO_VALUE = r"cannot marshal None unless allow_none"
NOT_WELL_FORMED = r"Invalid roslaunch XML syntax"
IGNORE = "CATKIN_IGNORE"
YAML = {".yaml", ".yml"}
_NO_LAUNCH_FILE = "is neither a launch file in package"
NOT_STARTED = r"Unable to launch \[([^\s\[\]]+)-\d+\]"
# what roslaunch says when it starts nothing, what it means, and what to do ({0}: the pattern's group)
NOTHING_STARTS = "roslaunch starts nothing"
_REFUSALS = (
    (r"multiple nodes named \[([^\[\]\n]+)\]", "two nodes are named {0}", "give each <node> its own name"),
    (r"cannot contain a namespace", "a node's name has a slash in it",
     'write name="…" without a slash; a namespace goes into ns="…"'),
    (r"missing required attribute: '?(\w+)", "a tag has no {0}", "add the attribute"),
    (NO_FILE, "the file {0} that <rosparam> loads does not exist", "write $(find <package>)/config/{0}, and push it"),
    (NO_PACKAGE, "there is no package {0}",
     "$(find …) and pkg need a package's exact name, and a package of your own is handed in too"),
    (r"included file \[([^\[\]\n]+)\] requires the '(\w+)' arg to be set", "the <include> of {0} gives it no {1}",
     'in the <include> of {0}, write <arg name="{1}" value="…"/>, with its value in place of …'),
    (_UNSET.pattern, 'its <arg name="{0}"> has no default', 'write <arg name="{0}" default="…"/>'),
    (r"cannot override arg '(\w+)', which has already", '<arg name="{0}" value="…"/> takes no other value from outside',
     'write default="…" in place of value="…" there'),
    (r"'ns' attribute must be set in order to use 'clear_params'", "clear_params needs an ns", "remove clear_params"),
    (r"Dollar signs '\$' cannot be inside of substitution args", "a $(…) stands in another one",
     "write the name itself in place of the inner $(…)"),
    (r"unknown machine \[([^\[\]\n]+)\]", "there is no <machine> of the name {0}",
     'remove machine="{0}" from the <node>: it runs on this computer then'),
    (r"output must be one of", 'output is "screen" or "log", in lower case', 'write output="screen"'),
    (r"multiple files named", "the package has two launch files of that name",
     "delete one of them, even one in a folder of old files: find . -name '*.launch' lists them"),
    (NOT_STARTED, "the system cannot start the script of {0}",
     "its first line has to be #!/usr/bin/env python3, or #!/bin/bash for a shell script"),
    (r"Unknown substitution command \[(?:param|rosparam|var|args|Arg|argument) ([^\[\]\n]+)\]",
     "a launch file can read its <arg>s, and no parameters",
     'write $(arg {0}), with <arg name="{0}" default="…"/>'),
    (r"Unknown substitution command \[((?:a\w{1,4} |\w?rg |arg)([\w-]+))\]", "roslaunch does not know $({0})",
     "write $(arg {1})"),
    (r"Unknown substitution command \[((?!find)[\w-]+)\]", "roslaunch does not know $({0})",
     'write $(arg {0}), with <arg name="{0}" default="…"/> above it'),
    (r"Unknown substitution command \[([^\[\]\n]+)\]", "roslaunch does not know $({0})", "write $(find <package>)/…"),
    (r"'param' attribute must be set for .*\n+XML is <rosparam[^<>\n]*>\s*([\w/~]{1,64}):([^\s:<>]{1,64})\n",
     "the text in <rosparam> is one long word and no parameters: {0}:{1} has no space in it",
     "write a space behind each colon in <rosparam>: {0}: {1}"),
    (r"'param' attribute must be set for non-dictionary values(?!.*\n+XML is <rosparam[^<>\n]*file=)",
     "the text in <rosparam> names no parameters",
     "write each of them as name: value, on a line of its own, with a space behind the colon"),
    (BAD_FILE, "<rosparam> cannot load its file", "rosparam load <file> shows what is wrong with the file"),
    (r"Invalid roslaunch XML syntax: \[Errno 2\] No such file or directory: '([^'\n]+)'",
     "the file {0} that <include> names does not exist", "push {0}, or start its nodes here, with a <node> for each"),
    (r"invalid bool value for (\w+): (\S+?)\.?(?:\s|$)", '{0}="{1}" is neither true nor false',
     'write {0}="true" or {0}="false"'),
    (r"unused args \[([^\[\]\n]+)\] for include of \[([^\[\]\n]+)\]",
     "<include> gives {1} a value for {0}, and no <arg> of {1} has that name",
     'write <arg name="{0}"/> below <launch> in {1}, or delete that <arg> of the <include>'),
    (NO_VALUE, "a parameter has no value", "write a value behind each name, or names with values below it"),
    # Last, as the errors above may begin with these words.
    (NOT_WELL_FORMED, "it is not well-formed", "close every element"),
)  # fmt: skip


def not_run(run: Run) -> Verdict | None:
    """Nothing was started at all, or roslaunch was stopped before it had read anything: the machine stood still."""
    if not lives(run) and not run.graph:
        return grade_again("roslaunch was not run")
    pressed, said = first_interrupt_ns(run), [(t, c.line) for t, c in run.console]
    was_early = pressed is not None and all(t >= pressed for t, _ in said)
    if was_early and any(line == "KeyboardInterrupt" for _, line in said) and not run.student_nodes():
        return grade_again("roslaunch was still starting itself when it was stopped")
    return None


def node_slips(package: PackageFacts, file: LaunchFile, run: Run) -> Verdict | None:
    """Return what is wrong with the file's own nodes, with what roslaunch said in the run; of one fix for several
    nodes, with all their lines. None where nothing is."""
    said = "\n".join(console_lines(run))
    found = [
        slip
        for node in file.nodes
        if (slip := node_slip(package, node.model_copy(update={"file": file.path}), said))
    ]
    verdict = joined([at_its_lines(slip, found).verdict() for slip in found])
    if verdict is None:
        return None
    message = verdict.message.replace(f"; {file.path}, ", "; ")
    return verdict.model_copy(update={"message": f"{message}{quoted(run)}"})


class Absence(NamedTuple):
    """Why a node is not there. `of_script`: the reason lies in the script, not in the launch file."""

    why: str
    hint: str
    of_script: bool = False
    citations: tuple[FileCitation, ...] = ()
    of_machine: bool = False
    unbuilt: bool = False
    """Only the build makes it."""
    refused: str = ""
    """How roslaunch says that it starts nothing: a pattern of `_REFUSALS`."""
    about: str = ""
    """What the pattern's group names."""

    def verdict(self, message: str, *, judged: bool = False) -> Verdict:
        """Return the verdict: unjudged where the machine is at fault, or a script that is not `judged` too."""
        kind = (
            machine_lacks
            if self.of_machine
            else failed_or_blocked
            if self.of_script and not judged
            else failed
        )
        verdict = kind(message, hint=self.hint, citations=self.citations)
        verdict = verdict.based_on(unbuilt=self.unbuilt)
        return verdict.seeking("package", self.about) if self.refused == NO_PACKAGE else verdict


def name_pattern(node: LaunchNode) -> re.Pattern[str]:
    """Return the names that a node can come up under: `$(anon x)` becomes `x_<host>_<pid>_<digits>`.

    However many substitutions there are, a name is looked through once: each takes the least that it can, and what it
    took stands (a group in a lookahead is not tried again).
    """
    before, *others = _SUBSTITUTION.split(re.escape(node.full_name).replace(r"\ ", " "))
    literals, gaps = [before], list[str]()
    for inside, literal in zip(others[::2], others[1::2], strict=True):
        name, gap = _substitute_inside(inside)
        literals[-1] += name
        gaps.append(gap)
        literals.append(literal)
    steps = [
        f"(?=(?P<g{number}>{gap}?{literals[number]}))(?P=g{number})"
        for number, gap in enumerate(gaps[:-1], 1)
    ]
    return re.compile("".join([literals[0], *steps, *gaps[-1:], *literals[1:][-1:]]))


def is_exact(node: LaunchNode) -> bool:
    """Return whether the file alone says the node's name."""
    return "$(" not in node.full_name


def nodes_up(run: Run, node: LaunchNode) -> tuple[str, ...]:
    """Return the names in the graph under which it came up."""
    pattern = name_pattern(node)
    return tuple(name for name in run.student_nodes() if pattern.fullmatch(name))


def refusal(run: Run, package: PackageFacts) -> Absence | None:
    """Return why roslaunch started nothing, or broke off. `package` has the file's own lines."""
    text = "\n".join(console_lines(run))
    if unset := _unset_args(text, package):
        return unset
    if package.file(IGNORE) is not None and _NO_LAUNCH_FILE in text:
        why = f"{IGNORE} hides the package from catkin and roslaunch"
        return Absence(why, f"git rm {IGNORE}", citations=(FileCitation(file=IGNORE),))
    for pattern, why, hint in _REFUSALS:
        if match := re.search(pattern, text):
            words = [shown(PurePosixPath(g).name if "/" in g.strip("/") else g) for g in match.groups()]
            fix = hint.format(*words).replace("<package>", package.name)
            if pattern == NO_FILE and (meant := _file_meant(package, words[0])):
                fix = f"write $(find {package.name})/{meant}"
            if "multiple nodes" in pattern:
                fix = namespace_meant(*(node for file in package.launch_files for node in file.brings)) or fix
            said = f"{NOTHING_STARTS}: {why.format(*words)}"
            noted = _substituted(package) if pattern == NO_PACKAGE or "substitution" in pattern else ()
            if special := _known_refusal(pattern, match, said, text, package):
                return special._replace(citations=special.citations or noted)
            cited = _declared(words[-1], package) if "arg to be set" in pattern else _node_told(text, package)
            return Absence(said, fix, citations=cited or noted, refused=pattern, about="".join(words[:1]))
    return None


def _known_refusal(
    pattern: str, match: re.Match[str], said: str, text: str, package: PackageFacts
) -> Absence | None:
    """Return what more is known of a file that is no YAML or is not there, or of a package that is not there."""
    if pattern == BAD_FILE:
        return _unread_yaml(text, package)
    faults = [file.fault for file in package.launch_files if file.fault is not None]
    if pattern == NOT_WELL_FORMED and len(faults) == 1:
        why = f"{NOTHING_STARTS}: {faults[0].file} is not well-formed: {faults[0].explanation}"
        return Absence(why, faults[0].advice, citations=(faults[0].place,), refused=pattern)
    if pattern == NO_VALUE:
        loads = [load for file in package.launch_files for load in file.loads if load.source]
        files = join_words(
            dict.fromkeys(re.sub(r"^\$\([^)]*\)/*", "", load.source or "") for load in loads), "or"
        )
        why = f"{NOTHING_STARTS}: a name in {files or 'a <rosparam>'} has no value"
        hint = (
            f"{'in ' if files else ''}{files}, write a value behind each name, or names with values below it"
        )
        return Absence(why, hint.lstrip(", "), citations=tuple(dict.fromkeys(load.place for load in loads)))
    if pattern == NO_PACKAGE:
        return _lacks_package(shown(match[1]), said, text, package)
    slip = _OTHER_SUBSTITUTION.search(match[1]) if pattern == NO_FILE else None
    if slip is None:
        return None
    why = f"{NOTHING_STARTS}: {slip[0]} is no substitution of roslaunch"
    return Absence(why, f"write $({slip[1]} {slip[2]}) in place of {slip[0]}", refused=pattern)


def _lacks_package(name: str, said: str, text: str, package: PackageFacts) -> Absence | None:
    """Return what is known of a package that roslaunch does not find: a slip of this one's name, or ROS's own."""
    if near_names(name, [package.name]) and not is_of_another_lab(name, package):
        return Absence(f"{said}: this one is called {package.name}", f"write $(find {package.name})")
    if name not in known_packages():
        return None
    why = f"{NOTHING_STARTS}: it needs the package {name}, which this grading machine lacks"
    hint = install_hint(name, text.splitlines())
    return Absence(why, hint, of_machine=True, refused=NO_PACKAGE, about=name)


def _unread_yaml(text: str, package: PackageFacts) -> Absence | None:
    """Return why a file that <rosparam> loads is not YAML, with its line."""
    found, words = _NO_YAML.search(text), explain_yaml(text.splitlines())
    if found is None or words is None:
        return None
    path = paths_by_name(package).get(PurePosixPath(found[1]).name, "")
    cited = (FileCitation(file=path, line=words.line),) if path else ()
    said = f"{NOTHING_STARTS}: {shown(path or PurePosixPath(found[1]).name)} does not load: {words.why}"
    return Absence(said, words.hint, citations=cited, refused=BAD_FILE)


_OTHER_SUBSTITUTION = re.compile(r"\$(?:(?=\w+\()|\{\s*)(find|arg|env|optenv|anon)[\s(]+([\w-]+)\s*[)}]")
"""`$find(lab)` and `${find lab}`, which roslaunch leaves as they are."""
_NODE_TOLD = re.compile(r"Node xml is <node\b[^\n>]*?\sname=[\"']([^\"'\n]+)")


def _node_told(text: str, package: PackageFacts) -> tuple[FileCitation, ...]:
    """Return the line of the node that roslaunch shows with its error."""
    found = _NODE_TOLD.search(text)
    nodes = [n for file in package.launch_files for n in file.brings if found and n.name == found[1]]
    places = dict.fromkeys(FileCitation(file=node.file, line=node.line) for node in nodes)
    return tuple(places) if len(places) == 1 else ()


def _substituted(package: PackageFacts) -> tuple[FileCitation, ...]:
    """Return the first `$(…)` that roslaunch refuses."""
    faults = (fault for file in package.launch_files for fault in file.include_faults)
    return tuple(fault.place for fault in faults if fault.kind == SUBSTITUTION)[:1]


def _declared(name: str, package: PackageFacts) -> tuple[FileCitation, ...]:
    """Return where an argument without a default is declared."""
    args = (arg for file in package.launch_files for arg in file.unset_args if arg.declared)
    return tuple(arg.place for arg in args if arg.name == name)[:1]


def explain_by_refused_launch(_check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with why roslaunch started nothing, where it ended and that is all that is said."""
    ended = early_end(run)
    refused = refusal(run, package) if ended is not None and ended.start.argv[:1] == ("roslaunch",) else None
    if refused is None or not verdict.basis.cause or NOTHING_STARTS in verdict.message:
        return verdict
    if refused.why in verdict.message or (refused.hint and refused.hint in verdict.hint):
        return verdict
    update = {"message": f"{verdict.message_without_cause}: {refused.why}", "hint": refused.hint}
    citations = tuple(dict.fromkeys((*refused.citations, *verdict.citations)))
    return verdict.model_copy(update={**update, "citations": citations}).based_on(cause=refused.why)


def _file_meant(package: PackageFacts, name: str) -> str:
    # `.yaml` and `.yml` are one kind of file.
    """Return the path of the only file of that kind, or of the one that is spelt alike; "" for none."""
    kinds = {PurePosixPath(name).suffix}
    kinds |= YAML if kinds <= YAML else set()
    names = {n: p for n, p in paths_by_name(package).items() if PurePosixPath(n).suffix in kinds}
    near = near_names(name, names) or (tuple(names) if len(names) == 1 else ())
    return names[near[0]] if near else ""


def _unset_args(text: str, package: PackageFacts) -> Absence | None:
    """Return all the arguments that the launch file asks for and that no `<arg>` declares: roslaunch names only one."""
    asked = _UNSET.search(text)
    if asked is None:
        return None
    lacking = [
        [arg for arg in file.unset_args if not arg.declared]
        for file in package.launch_files
        if any(arg.name == asked[1] for arg in file.unset_args)
    ]
    if len(lacking) != 1 or asked[1] not in {arg.name for arg in lacking[0]}:
        return None
    args = lacking[0]
    lines = sorted({arg.line for arg in args})
    names = join_words(dict.fromkeys(f"$(arg {arg.name})" for arg in args))
    where = f"{on_lines(lines)} of {args[0].file}"
    declares = join_words(f'<arg name="{arg.name}" default="…"/>' for arg in args)
    verb = "uses" if len(lines) == 1 else "use"
    why = f"{NOTHING_STARTS}: {where} {verb} {names}, which no <arg> declares"
    hint = f"below <launch>, add {declares}, with {'its value' if len(args) == 1 else 'their values'} in place of …"
    if all(arg.meant for arg in args):
        hint = join_words(
            f"on line {arg.line}, write $(arg {arg.meant}), not $(arg {arg.name})" for arg in args
        )
    return Absence(why, hint, citations=tuple(dict.fromkeys(tuple(arg.place for arg in args))))


def died(run: Run, node: LaunchNode) -> int | None:
    """Return the exit code with which roslaunch saw it die before Ctrl-C; None where it did not."""
    # After Ctrl-C, all nodes end.
    until_ns = observed_until_ns(run) or run.end_ns
    lines = _join_required(without_colours(c.line) for t, c in run.console if t <= until_ns)
    codes = [int(m[2]) for line in lines if (m := _DIED.search(line)) and _is(node, m[1])]
    return codes[-1] if codes else None


def finished(run: Run, node: LaunchNode) -> bool:
    """Return whether it ran to its own end without an error."""
    return any(
        (m := _FINISHED.search(line)) and _is(node, m[1]) for line in _join_required(console_lines(run))
    )


def why_not_up(package: PackageFacts, run: Run, node: LaunchNode) -> Absence:
    """Return why a node of the launch file did not come up."""
    # What roslaunch says of this very node goes before what it says of the whole file.
    return (
        _not_found(package, run, node)
        or why_died(package, run, node)
        or refusal(run, package)
        or _silent(run, node)
        or _left_out(run, node)
        or Absence(f"roslaunch did not start it{quoted(run)}", "run roslaunch by hand and read its output")
    )


def not_executable(*scripts: SourceFile) -> Absence:
    """Return the absence of nodes whose scripts are not executable."""
    paths = tuple(dict.fromkeys(script.path for script in scripts))
    are, them = ("is", "it") if len(paths) == 1 else ("are", "them")
    why = f"{join_words(paths)} {are} not executable, so roslaunch does not find {them}"
    hint = chmod_hint(scripts[0].mode_source, *paths)
    return Absence(why, hint, True, tuple(FileCitation(file=path) for path in paths))


def _unmade(script: SourceFile) -> Absence:
    why = f"catkin_install_python makes a program of {script.path}, but the build did not make it"
    return Absence(why, BUILD_FIRST_HINT, of_script=True, unbuilt=True)


def not_started(*scripts: SourceFile) -> Absence:
    """Return the absence of nodes whose scripts the system cannot start by their first line."""
    obstacles = {script.path: next(shebang_obstacles(script)) for script in scripts}
    why = "; ".join(f"{path} {one.why}" for path, one in obstacles.items())
    fix = "; ".join(dict.fromkeys(one.fix for one in obstacles.values()))
    return Absence(f"it died: {why}", fix, True, tuple(FileCitation(file=path, line=1) for path in obstacles))


TAKE_A_VALUE = re.compile(
    r"(?:-[OoblxN]|--(?:output-\w+|buffsize|chunksize|limit|duration|size|exclude|tcpnodelay))\s+\S+"
)

BAG_VERB = re.compile(r"\s*(record|play)\b")
"""As on the command line: `rosbag record …`."""
NOT_OPENED = re.compile(r"Error opening file: (.+?)(?:\.active)?$")
BAG_NAME = re.compile(r"(?:-[oO]|--output-\w+)[= ]\s*((?:\$\([^)]*\)|\S)+)")


def bag_not_made(package: PackageFacts, run: Run) -> Absence | None:
    """Return why a launch file's `rosbag` never recorded: it was not found, or could not open its bag."""
    nodes = [node for file in package.launch_files for node in file.nodes if node.pkg == "rosbag"]
    absences = (_not_found(package, run, node) for node in nodes)
    return next(filter(None, absences), None) or _bag_not_opened(package, run)


def _bag_not_opened(package: PackageFacts, run: Run) -> Absence | None:
    lines = (without_colours(one.line) for _, one in run.console)
    path = next((found[1] for line in lines if (found := NOT_OPENED.search(line))), None)
    if path is None:
        return None
    name = PurePosixPath(path).name
    why = f"rosbag record cannot open {shown(path)}: there is no such folder, or it may not write there"
    for place, node in recorders(package):
        given = BAG_NAME.search(node.args or "")
        if given is not None and name.startswith(PurePosixPath(given[1]).stem):
            hint = f"in args, write `{shown(PurePosixPath(given[1]).name)}` in place of `{shown(given[1])}`"
            return Absence(why, hint, of_script=True, citations=(place,))
    return Absence(why, f"record to {shown(name)}, without a folder before it", of_script=True)


def recorders(package: PackageFacts) -> list[tuple[FileCitation, LaunchNode]]:
    """Return each `<node>` of `rosbag record` in its launch files, with its place."""
    nodes = ((file.path, node) for file in package.launch_files for node in file.nodes)
    return [
        (FileCitation(file=path, line=node.line), node)
        for path, node in nodes
        if (node.pkg, node.type) == ("rosbag", "record")
    ]


CHOOSES = re.compile(r"[^-]|-\w*[ae]|--(?:all|regex|node)\b")
"""A topic, or a flag that stands for several (`-a`, or `-ao` of two in one)."""


def _names_no_topic(args: str) -> bool:
    """Return whether a call of `rosbag record` names no topic, and no other way to choose them."""
    rest = TAKE_A_VALUE.sub("", args).split()
    return not any(map(CHOOSES.match, rest))


def why_died(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """Return its traceback where it was printed, or what roslaunch says of its end."""
    code = died(run, node)
    if code is None:
        return None
    script = own_script(package, node)
    found = [
        t
        for one in lives(run)
        for t in process_tracebacks(run, one.name, after_ns=one.start_ns, before_ns=one.interrupt_ns)
        if script is None
        or any(PurePosixPath(f.file).name == PurePosixPath(script.path).name for f in t.frames)
    ]
    if found:
        owner = owner_of(package, node) or package
        end = explain_traceback(found[-1], owner)
        cited = tuple(one.below(package.way_to(owner)) for one in end.citations)
        return Absence(f"it died: {end.cause}", end.hint, True, cited, end.of_machine, end.unbuilt)
    if script is not None and (fault := script.python_fault) is not None:
        why = f"it died: {fault.kind}: {fault.explanation}"
        return Absence(why, syntax_hint(fault), of_script=True, citations=(fault.place,))
    if script is not None and code in NOT_EXECUTED and any(shebang_obstacles(script)):
        return not_started(script)
    why, hint = explain_code(code, console_lines(run), shown_by_roslaunch=node.output == "screen")
    recorder = _recorder_died(package, run, node) if node.pkg == "rosbag" else None
    return recorder or Absence(why, hint, of_script=True)


def _recorder_died(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    unmade = _bag_not_opened(package, run) if node.type == "record" else None
    if unmade is not None or node.type != "record" or not _names_no_topic(node.args or ""):
        return unmade
    topics = sorted({c.topic for c in run.student_channels() if not c.topic.startswith("/rosout")})
    hint = f'write args="{shown(node.args or "")} {" ".join(topics) or "/…"}" in this <node>'
    return Absence("rosbag record is told no topic to record", hint, of_script=True, citations=(node.place,))


def quoted(run: Run) -> str:
    """Return the first line in which roslaunch says what is wrong, as the end of a sentence."""
    said = roslaunch_error(run)
    return f"; roslaunch says: {said}" if said else ""


def roslaunch_error(run: Run) -> str:
    """Return the first line in which roslaunch, or a node that it started, says what is wrong."""
    lines = console_lines(run)
    found = (line for mark in _ERRORS for line in lines if mark in line)
    return shown(next(found, ""))


def _not_found(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """roslaunch did not find the program, or none that may be executed."""
    mark = f"cannot launch node of type [{node.pkg}/{node.type}]"
    line = next((text for text in console_lines(run) if mark in text), None)
    if line is None:
        return None
    owner, script = owner_of(package, node), own_script(package, node)
    if script is not None and script.executable is False:
        return _unmade(script) if asks_for_wrapper(owner or package, script.path) else not_executable(script)
    if owner is not None and any(one.is_called(str(node.type)) for one in programs(owner)):
        why = f"CMakeLists.txt makes the program {node.type}, but the build did not make it"
        return Absence(why, BUILD_FIRST_HINT, of_script=True, unbuilt=True)
    # Without these words, it is the package that was not found.
    if "Cannot locate" not in line:
        return Absence(f"there is no package {node.pkg}", "check how pkg is spelt, and that it is installed")
    why = f"roslaunch finds no program {node.type} in the package {node.pkg}"
    hint = "type is the file's name, with .py for a script, and the file needs chmod +x"
    if near := near_names(str(node.type), PROGRAMS_OF.get(str(node.pkg), ())):
        why, hint = f"{why}; it has {near[0]}", f'write type="{near[0]}"'
    elif node.pkg == "rosbag" and (verb := BAG_VERB.match(node.args or "")):
        hint = f'write type="{verb[1]}", and take the word {verb[1]} out of args'
    elif owner is None:
        hint = programs_hint(str(node.pkg))
    elif made := program_of_source(owner, str(node.type)):
        why, hint = (
            f"{why}: {node.type} is its source",
            f'write type="{made}", as in `add_executable({made} …)`',
        )
    return Absence(why, hint)


def _silent(run: Run, node: LaunchNode) -> Absence | None:
    """Started, and never registered."""
    hint = f"call {INIT} before anything that waits"
    others = [n for n in run.student_nodes() if re.fullmatch(r"/.+_\d+_\d{9,}", n)]
    if finished(run, node):
        return Absence("its script ended without ever becoming a node", hint, of_script=True)
    started = any((m := _STARTED.search(line)) and _is(node, m[1]) for line in console_lines(run))
    if not started:
        return None
    if others:
        why = f"{join_words(others)} came up instead: the script takes another name than roslaunch gives it"
        return Absence(why, "start the script itself, and leave sys.argv alone", of_script=True)
    return Absence("its script runs, but never registers as a node", hint, of_script=True)


def _left_out(run: Run, node: LaunchNode) -> Absence | None:
    """Left out by a condition that only roslaunch works out."""
    at = node.condition
    if at is None or quoted(run):
        return None
    where = f"line {at.line}{f' of {at.file}' * (at.file != node.file)}"
    fix = f"remove {at.value} from {where}, or give its <arg> another default"
    return Absence(f"{at.value} on {where} leaves it out", fix, citations=(at.place,))


def _is(node: LaunchNode, process: str) -> bool:
    return name_pattern(node).fullmatch(f"/{process}") is not None


def _substitute_inside(inside: str) -> tuple[str, str]:
    """Return what stands for `$(inside)` in a pattern: the name that is known, and what follows it."""
    words = re.sub(r"\\(.)", r"\1", inside).split()
    return (f"{re.escape(words[1])}_", ".+") if len(words) == 2 and words[0] == "anon" else ("", ".*")


def _join_required(lines: Iterable[str]) -> Iterator[str]:
    """Of a node with required="true", roslaunch says on one line that it "died", and in the next one how it ended."""
    name = ""
    for line in lines:
        if match := _REQUIRED.search(line):
            name = match[1]
        elif name and line.startswith("process has "):
            yield f"{name} {line}"
            name = ""
        else:
            yield line


def console_lines(run: Run) -> list[str]:
    """Return what the run printed, as plain text."""
    return [without_colours(c.line) for _, c in run.console]
