"""Which lines of the student's files a verdict cites, and their text.

A verdict and the files that were recorded come in; the verdict goes out with the lines that it names words or calls of
(`Verdict.said`, `Verdict.sought`). No status changes; a check that knows a line itself has cited it already.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath

from grader.checks.cmake import NOT_CALLED, below_catkin_package
from grader.checks.support.launch_slips import find_launch
from grader.checks.support.rospy_calls import fields_of
from grader.checks.support.scripts import (
    SourceLine,
    commented_call,
    commented_calls,
    line_that_makes,
    lines_that_answer,
    lines_that_call,
    lines_that_publish,
    lines_that_say,
    lines_that_set,
    lines_that_transform,
)
from grader.evidence.run import Run
from grader.judging.facts import Facts, names_started, scripts_of, sources_of, starts_of
from grader.model.package import CMAKE, PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.repair import Repair
from grader.model.verdict import Citation, FileCitation, Status, Verdict
from grader.rubric.model import Criterion
from grader.wording import join_words, lines_text, on_lines

LINE_CHARS = 200
"""A longer line stays out of the result."""
# No script of a lab is so long, and each search goes through all of them.
LINES_READ = 2_000
LOOPS = re.compile(r"\s*while\b.*:")
SAYS = {
    "hears": r"\b(?:printf?|log\w+|write|ROS_\w+)\s*\(|\bc(?:out|err)\s*<<",
    "logs": r"\b(?:log\w+|ROS_\w+)\s*\(",
}
"""The checks of what a node says, and what a line of Python or C++ calls that says them."""


def cite_source(
    verdict: Verdict, criterion: Criterion, facts: Facts, build: Run, repairs: Iterable[Repair] = ()
) -> Verdict:
    """Return the verdict; one on what a node says, sends or asks with the line of the script that does so, if it is
    plain which one that is. `repairs` are those of the copy that was judged."""
    package = facts.package_of(criterion)
    lost = verdict.status in {Status.PARTIAL, Status.FAIL} and not verdict.basis.unjudged
    if _is_placed(verdict) or not lost or package is None or package is not facts.package:
        return verdict
    paths = scripts_of(criterion, facts.rubric, package) | sources_of(criterion, facts.rubric, package)
    started = names_started(criterion, facts.rubric)
    renamed = (one for one in repairs if one.kind == "file-name")
    paths |= {one.before for one in renamed if PurePosixPath(one.after).name in started}
    lines = [one for one in _read(build, paths) if not one.text.lstrip().startswith(("#", "//"))]
    found = _lines_to_blame(verdict, criterion, lines)
    is_sent = criterion.check == "message" or _field_of(verdict, criterion)
    if not found or (len(found) > 1 and not is_sent):
        return verdict
    made = line_that_makes(lines, found[0]) if is_sent and len(found) == 1 else None
    places = (FileCitation(file=one.file, line=one.number) for one in (made, *found) if one is not None)
    hint = verdict.hint + _second_call(criterion, found[0], lines)
    if criterion.check == "stamps" and (sent := _SENDS.search(found[0].text)):
        hint = hint.replace(": msg.", f": {sent[1]}.")
    return verdict.model_copy(update={"citations": (*places, *verdict.citations), "hint": hint})


_SENDS = re.compile(r"\bpublish\(\s*([\w.]+)\s*\)")


def _second_call(criterion: Criterion, first: SourceLine, lines: Iterable[SourceLine]) -> str:
    """Return where a program of C++ calls `ros::init` once more, which leaves its node's name as it is."""
    of_file = (one for one in lines if one.file == first.file and one.number > first.number)
    again = [one.number for one in of_file if "ros::init(" in one.text]
    if criterion.check != "node-name" or not again:
        return ""
    return f" on line {first.number}: the node keeps the name of its first call, and {on_lines(again)} changes nothing"


# More lines that give one field one value say nothing of which one was run.
SAME_MAX = 3


def _field_of(verdict: Verdict, criterion: Criterion) -> str:
    """Return the field of a message that has to have another value, if the criterion judges one."""
    return verdict.sought_name("field") or str(criterion.parameters.get("field", ""))


def _is_placed(verdict: Verdict) -> bool:
    """Return whether a line of a file is cited already."""
    return any(isinstance(one, FileCitation) for one in verdict.citations)


def _read(build: Run, paths: Iterable[str]) -> Iterator[SourceLine]:
    for path in sorted(paths):
        for number, text in enumerate(build.file_lines(path)[:LINES_READ], 1):
            if len(text) <= LINE_CHARS:
                yield SourceLine(path, number, text)


def _lines_to_blame(verdict: Verdict, criterion: Criterion, lines: list[SourceLine]) -> list[SourceLine]:
    """Return the lines that do what the criterion judges; none where a check is of something else."""
    if misfit := ADVERTISED.search(verdict.message):
        return _that_advertise(lines, misfit["topic"], misfit["type"])
    return _lines_that_do(verdict, criterion, lines)


def _lines_that_do(verdict: Verdict, criterion: Criterion, lines: list[SourceLine]) -> list[SourceLine]:
    given = criterion.parameters
    match criterion.check:
        case "calls":
            found = lines_that_call(lines, str(given["service"]))
        case "service-answers":
            found = lines_that_answer(lines, str(given["service"]))
        case "transform":
            found = lines_that_transform(lines)
        case "action-result" if (
            "is_preempt_requested" in verdict.hint
        ):  # which belongs into the loop that reports
            found = [one for one in lines if re.search(r"\bpublish_?feedback\(", one.text, re.IGNORECASE)]
        case "hears" | "logs":
            found = lines_that_say(lines, f"{verdict.measured} {verdict.basis.said}")
            found = found or _that_say(verdict, criterion, lines)
        case "prints" | "topic-type" | "node-name":
            named = criterion.check == "node-name"
            found = _that_name(verdict.measured if named else verdict.basis.said, criterion, lines)
        case "message":
            saying = lines_that_say(lines, verdict.basis.said or verdict.measured)
            found = _published_of(saying, lines, criterion)
            found = found if len(found) == 1 else _alike(saying)
        case "stamps":
            found = _published_of(lines_that_set(lines, "stamp"), lines, criterion)
        case _ if field := _field_of(verdict, criterion):
            found = lines_that_set(lines, field)
            values = _wrong_values(verdict.measured, given)
            found = (
                _that_give(found, values)
                or _that_hand(found, lines, values)
                or _one_published(found, lines, criterion)
            )
        case _:
            found = []
    return found


ADVERTISED = re.compile(r"(?P<topic>/[\w/]+) is advertised as \w+/(?P<type>\w+), and \S+ hears it")


def _that_advertise(lines: list[SourceLine], topic: str, kind: str) -> list[SourceLine]:
    """Return the lines that advertise a topic with this type."""
    name = re.escape(topic.rpartition("/")[2])
    call = re.compile(rf"""\b(?:advertise|Publisher)\b.*["'](?:/?\w+/)*/?{name}["']""")
    return [one for one in lines if call.search(one.text) and re.search(rf"\b{kind}\b", one.text)]


def _alike(saying: list[SourceLine]) -> list[SourceLine]:
    """Return a few lines of one file that say the same; none where they are more, or of several files."""
    return saying if len(saying) <= SAME_MAX and len({one.file for one in saying}) == 1 else []


def _that_say(verdict: Verdict, criterion: Criterion, lines: list[SourceLine]) -> list[SourceLine]:
    """Return the lines that say anything, if some of what is asked for is said."""
    partly = verdict.status is Status.PARTIAL
    return [one for one in lines if partly and re.search(SAYS[criterion.check], one.text)]


def _of_transform_or_action(
    verdict: Verdict, criterion: Criterion, lines: list[SourceLine]
) -> list[SourceLine]:
    """Return the lines that send a transform, or report in the loop that never asks whether its goal is cancelled."""
    if criterion.check == "transform":
        return lines_that_transform(lines)
    deaf = "is_preempt_requested" in verdict.hint
    return [one for one in lines if deaf and re.search(r"\bpublish_?feedback\(", one.text, re.IGNORECASE)]


def _that_name(said: str, criterion: Criterion, lines: list[SourceLine]) -> list[SourceLine]:
    """Return the lines that print a text, or those of C++ that advertise a topic or name the node."""
    if criterion.check == "prints":
        return lines_that_say(lines, said)
    if criterion.check == "node-name":
        inits = [one for one in lines if "ros::init(" in one.text]
        seen = [one for one in inits if any(f'"{name}"' in one.text for name in re.findall(r"/(\w+)", said))]
        return seen or inits
    names = [one.strip("/") for one in (said, str(criterion.parameters["topic"]))]
    calls = [re.compile(rf'''\badvertise\b[^"]*"/?{re.escape(name)}"''') for name in names if name]
    return next((found for call in calls if (found := [one for one in lines if call.search(one.text)])), [])


def _wrong_values(measured: str, given: Mapping[str, object]) -> list[str]:
    """Return the numbers that were sent and are wrong, as a line may write them: all, or those outside the bounds."""
    number = r"-?\d+(?:\.\d+)?"
    found = re.fullmatch(rf"({number})(?: to ({number}))?", measured)
    sent = [one for one in found.groups() if one is not None] if found else []
    low, high = (float(str(given[key])) if given.get(key) is not None else None for key in ("min", "max"))
    if low is not None or high is not None:
        sent = [
            n for n in sent if (low is not None and float(n) < low) or (high is not None and float(n) > high)
        ]
    return [one.removesuffix(".0") for one in sent] if len(sent) == 1 else []


def _that_give(found: list[SourceLine], values: Sequence[str]) -> list[SourceLine]:
    """Return those that set a field to this very number, where several set it, to others too."""
    either = "|".join(map(re.escape, values))
    given = re.compile(rf"=\s*(?:{either})(?:\.0*)?\s*;?\s*(?:(?:#|//).*)?$")
    right = [one for one in found if values and given.search(one.text)]
    one_file = len({one.file for one in right}) == 1
    return right if len(found) > 1 and one_file and len(right) <= SAME_MAX else []


def _that_hand(found: list[SourceLine], lines: list[SourceLine], values: Sequence[str]) -> list[SourceLine]:
    """Return the calls that hand this very number on to a function of Python that sets a field to it: `move(3, 2)`."""
    calls: dict[SourceLine, None] = {}
    for one in found if values else ():
        name = re.search(r"=\s*-?\s*(?:abs\()?\s*([A-Za-z_]\w*)\s*\)?\s*(?:#.*)?$", one.text)
        above = [a for a in lines if a.file == one.file and a.number < one.number]
        head = next(
            (h for a in reversed(above) if (h := re.match(r"\s*def (\w+)\(([^()]*)\)", a.text))), None
        )
        names = [part.partition("=")[0].strip() for part in head[2].split(",")] if head else []
        if name is None or head is None or name[1] not in names:
            continue
        at = names.index(name[1]) - (names[:1] == ["self"])
        call = re.compile(
            rf"(?<!def )\b{head[1]}\((?:[^(),]*,){{{at}}}\s*(?:{name[1]}\s*=\s*)?(?:{'|'.join(values)})(?:\.0*)?\s*[,)]"
        )
        calls |= dict.fromkeys(a for a in lines if a.file == one.file and call.search(a.text))
    return list(calls) if len(calls) <= SAME_MAX else []


def _one_published(
    found: list[SourceLine], lines: list[SourceLine], criterion: Criterion
) -> list[SourceLine]:
    published = _published_of(found, lines, criterion)
    return published if len(published) == 1 else []


def _published_of(found: list[SourceLine], lines: list[SourceLine], criterion: Criterion) -> list[SourceLine]:
    """Return of several lines the one that is published; of none, what is published has nothing of it."""
    given = criterion.parameters
    topic = given.get("topic") or given.get("effect", {}).get("topic", "")
    published = lines_that_publish(lines, str(topic))
    return found if len(found) == 1 else [one for one in published if one in found] or published


def cite_quoted(verdict: Verdict, criterion: Criterion, facts: Facts, build: Run) -> Verdict:
    """Return the verdict; one on a name that a script has in quotes in place of another one cites its lines."""
    package, names = facts.package_of(criterion), verdict.sought_names("quoted")
    lost = verdict.status.is_lost and not _is_placed(verdict)
    if package is None or package is not facts.package or not names or not lost:
        return verdict
    quoted = re.compile(rf"""(["'])(?:{"|".join(map(re.escape, names))})\1""")
    paths = scripts_of(criterion, facts.rubric, package) | sources_of(criterion, facts.rubric, package)
    lines = [one for one in _read(build, paths) if quoted.search(one.text)]
    places = [FileCitation(file=one.file, line=one.number) for one in lines]
    if not 0 < len(places) <= QUOTED_MAX:
        return verdict
    where = join_words(f"line {one.line} of {one.file}" for one in places)
    update = {"hint": f"on {where}: {verdict.hint}", "citations": (*places, *verdict.citations)}
    return verdict.model_copy(update=update)


# More places say nothing of which one is wrong.
QUOTED_MAX = 3


def cite_commented_call(verdict: Verdict, package: PackageFacts | None, build: Run) -> Verdict:
    """Return the verdict; one on a call that is missing in CMakeLists.txt cites the line below which it goes, or those
    in which it is commented out."""
    if not verdict.status.is_lost or package is None or package.cmake is None:
        return verdict
    if verdict.status is Status.BLOCKED:
        return verdict  # the criterion that blocks it tells it
    if called := verdict.sought_name("call"):
        return _cite_install(verdict, package, build, called)
    found = commented_calls(package, build.file_lines(CMAKE)[:LINES_READ], verdict.sought_names("uncalled"))
    if not found:
        return verdict
    told = "; ".join(f"{name}(…) is commented out on {lines_text(*place)}" for name, place in found.items())
    update = {
        "message": f"{verdict.message}; {told}",
        "hint": _without_comment_signs(verdict.hint, found),
        "citations": (
            *(FileCitation(file=CMAKE, line=first + 1) for first, _ in found.values()),
            *verdict.citations,
        ),
    }
    return verdict.model_copy(update=update)


def _without_comment_signs(hint: str, found: Mapping[str, tuple[int, int]]) -> str:
    """Return the hint with the lines of these calls; the template's catkin_package(…) goes as a whole."""
    rest = dict(found)
    if CATKIN_PACKAGE_ADDED.search(hint) and len(set(rest.get("catkin_package", ()))) > 1:
        where = lines_text(*rest.pop("catkin_package"))
        hint = CATKIN_PACKAGE_ADDED.sub(f"write catkin_package() in place of {where} of {CMAKE}", hint)
    places = join_words(lines_text(*place) for place in rest.values())
    return f"remove the # from {places} of {CMAKE}: {hint}" if places else hint


CATKIN_PACKAGE_ADDED = re.compile(r"add catkin_package\(\)( below the [^;]*)?")


def cite_word_of_call(verdict: Verdict, build: Run) -> Verdict:
    """Return the verdict; one on a script that a call names and that does not exist, with the line of its name, which
    is often below the one on which the call begins."""
    found = WORD_OF_CALL.search(verdict.message) if verdict.status.is_lost else None
    begin = int(found["line"]) if found else 0
    of_call = [one for one in verdict.citations if isinstance(one, FileCitation) and one.line == begin]
    if found is None or not of_call:
        return verdict
    written = re.compile(rf"(?<![\w./-]){re.escape(found['path'])}(?![\w./-])")
    for number, text in enumerate(build.file_lines(of_call[0].file)[begin - 1 : LINES_READ], begin):
        code = text.partition("#")[0]
        if written.search(code):
            place = of_call[0].model_copy(update={"line": number})
            cited = (place if one is of_call[0] else one for one in verdict.citations)
            update = {
                "message": f"{verdict.message[: found.start('line')]}{number}{verdict.message[found.end('line') :]}",
                "citations": tuple(dict.fromkeys(cited)),  # a repair may have cited the line
            }
            return verdict.model_copy(update=update)
        if ")" in code:
            break
    return verdict


WORD_OF_CALL = re.compile(r"\bline (?P<line>\d+): (?P<path>\S+) is named, but does not exist")


def _cite_install(verdict: Verdict, package: PackageFacts, build: Run, called: str) -> Verdict:
    file = next((one.file for one in verdict.citations if isinstance(one, FileCitation)), CMAKE)
    place = commented_call(build.file_lines(file)[:LINES_READ], called)
    if place is None:
        return verdict
    where = lines_text(*place)
    update = {
        "message": verdict.message.replace(NOT_CALLED, f"{NOT_CALLED}: it is commented out on {where}", 1),
        "hint": f"in place of {where} {verdict.hint.removesuffix(below_catkin_package(package))}, without # before it",
        "citations": (FileCitation(file=file, line=place[0] + 1),),
    }
    return verdict.model_copy(update=update)


def cite_find(verdict: Verdict, criterion: Criterion, package: PackageFacts | None, build: Run) -> Verdict:
    """Return the verdict; one on a package that roslaunch does not find cites the launch file's lines that name it."""
    absent = verdict.sought_name("package")
    if package is None or not absent or not verdict.status.is_lost:
        return verdict
    asked = find_launch(package, str(criterion.parameters.get("launch", "")))
    name = re.compile(rf"""\$\(find\s+{re.escape(absent)}\)|pkg\s*=\s*["']{re.escape(absent)}["']""")
    for file in (
        (asked,) if asked is not None else package.launch_files
    ):  # one by another name was judged on a copy
        lines = [n for n, text in enumerate(build.file_lines(file.path)[:LINES_READ], 1) if name.search(text)]
        if lines:
            of_file = "" if asked is not None else f" of {file.path}"
            where = f"{on_lines(lines)}{of_file}"
            hint = f"write the package's exact name on {where}, push {absent} if it is your own, or remove it"
            cited = tuple(FileCitation(file=file.path, line=n) for n in lines)
            return verdict.model_copy(update={"hint": hint, "citations": cited})
    return verdict


def cite_unused_argument(verdict: Verdict, criterion: Criterion, facts: Facts, build: Run) -> Verdict:
    """Return the verdict; one of a run that gives a launch file an argument cites the `<arg>` that nothing uses."""
    package = facts.package_of(criterion)
    if not verdict.status.is_lost or verdict.basis.unjudged or _is_placed(verdict) or package is None:
        return verdict
    for start in starts_of(criterion, facts.rubric):
        file = find_launch(package, start.launch or "")
        if file is None:
            continue
        for name in (arg.partition(":=")[0] for arg in start.args):
            line = _unused_argument(name, build.file_lines(file.path)[:LINES_READ])
            if line is not None:
                message = f"{verdict.message}; nothing in {file.path} uses its argument {name}"
                fix = f"write `$(arg {name})` where its value belongs"
                hint = f"{fix}; {verdict.hint}" if verdict.hint else fix
                cited = (FileCitation(file=file.path, line=line), *verdict.citations)
                return verdict.model_copy(update={"message": message, "hint": hint, "citations": cited})
    return verdict


def _unused_argument(name: str, lines: Sequence[str]) -> int | None:
    """Return the line of an `<arg>` of that name that no other line uses."""
    word = re.escape(name)
    used = re.compile(rf"\$\((arg|eval)\b.*\b{word}\b|pass_all_args")
    given = re.compile(rf"""<arg\b[^>]*\bname\s*=\s*["']{word}["']""")
    declared = (number for number, text in enumerate(lines, 1) if given.search(text))
    return None if any(used.search(text) for text in lines) else next(declared, None)


def cite_name(verdict: Verdict, build: Run) -> Verdict:
    """Return the verdict; one on a dependency cites the line that has its name: a tag that is commented out, or that of
    a `find_package(…)` over several lines."""
    place = next((one for one in verdict.citations if isinstance(one, FileCitation) and one.line), None)
    undeclared, lacked = verdict.sought_name("dependency"), verdict.sought_name("component")
    if place is None or place.line is None or not (undeclared or lacked):
        return verdict
    message, hint = verdict.message, verdict.hint
    lines = [text[:LINE_CHARS] for text in build.file_lines(place.file)[:LINES_READ]]
    if undeclared:
        name = re.escape(undeclared)
        tag = re.compile(rf"\s*<!--\s*<(depend|exec_depend|run_depend)>\s*{name}\s*</\1>\s*-->")
        line = next((number for number, text in enumerate(lines, 1) if tag.match(text)), None)
        message = f"{message}: line {line} has it in a comment"
        hint = f"remove `<!--` and `-->` from line {line}"
    else:
        word = re.compile(rf"[^#]*\b{re.escape(lacked)}\b")
        inside = enumerate(lines[place.line - 1 :], place.line)
        line = next((number for number, text in inside if word.match(text)), None)
    if line is None:
        return verdict
    cited = tuple(
        FileCitation(file=place.file, line=line) if one is place else one for one in verdict.citations
    )
    return verdict.model_copy(update={"message": message, "hint": hint, "citations": cited})


def show_lines(verdict: Verdict, build: Run) -> Verdict:
    """Return a verdict whose cited lines have their text; one that loses nothing, or cites none, stays as it is."""
    if not verdict.status.is_lost or not _is_placed(verdict):
        return verdict
    cited = tuple(_with_text(citation, build) for citation in verdict.citations)
    return verdict.model_copy(update={"citations": cited})


def _with_text(citation: Citation, build: Run) -> Citation:
    if not isinstance(citation, FileCitation) or citation.line is None:
        return citation
    if citation.line == 1 and citation.column is None:
        return citation  # it stands for the whole file
    lines = build.file_lines(citation.file)
    text = lines[citation.line - 1].rstrip() if 0 < citation.line <= len(lines) else ""
    if not text.strip() or len(text) > LINE_CHARS:
        return citation
    if not citation.source:
        return citation.model_copy(update={"source": text})
    if citation.end_column is None or text.strip() != citation.source:
        return citation
    # Python prints a line without its indentation, and its carets stand below that
    indent = len(text) - len(text.lstrip())
    begin, end = (citation.column or 1) + indent, citation.end_column + indent
    return citation.model_copy(update={"source": text, "column": begin, "end_column": end})


def loop_spins(lines: Iterable[str]) -> Iterator[int]:
    """Yield the numbers of the lines on which a loop waits until its node ends."""
    loop = None
    for number, line in enumerate(lines, 1):
        depth = len(line) - len(line.lstrip())
        if LOOPS.match(line):
            loop = depth
        elif line.strip() and loop is not None and depth <= loop:
            loop = None
        elif loop is not None and line.strip().startswith("rospy.spin()"):
            yield number


OF_DATA = re.compile(r"String|Bool|Byte|Char|U?Int\d+|Float\d+")
"""Types of std_msgs with one plain value, `data`."""
PLACES = re.compile(r"%[-+0-9.]*[dioxXeEfFgG]\b")
"""A number's place in a text: no text can be put there."""
FIELDS_SHOWN, MESSAGES_READ = 3, 5


def lost_fields(
    lines: Sequence[str], slip: PythonSlip, wanted: str, package: PackageFacts | None = None
) -> str:
    """Return what to write in place of the fields that a script uses and that only the slip's type has: fields of the
    messages that it makes, or of the one that its callback gets. "" where it uses none. `package` has the definitions
    of its own types."""
    texts = [line[:LINE_CHARS].partition("#")[0] for line in lines[:LINES_READ]]
    made = re.compile(rf"\s*([\w.]+) *= *(?:[\w.]+\.)?{re.escape(slip.message)}\(")
    names, first, last = [found[1] for text in texts if (found := made.match(text))], 0, len(texts)
    if slip.kind == "subscriber-type":
        call = texts[slip.line - 1] if slip.line <= len(texts) else ""
        given = re.search(r"Subscriber\([^,]*,[^,]*, *(?:callback *= *)?(?:self\.)?(\w+)", call)
        head = re.compile(rf"(\s*)def {given[1] if given else '-'}\((?:self, *)?(\w+)")
        heads = [(at, found) for at, text in enumerate(texts) if (found := head.match(text))]
        names = [found[2] for _, found in heads[:1]]
        for at, found in heads[:1]:
            within = re.compile(rf"{found[1]}\s|\s*$")
            first, last = at + 1, next((n for n in range(at + 1, last) if not within.match(texts[n])), last)
    either = "|".join(map(re.escape, list(dict.fromkeys(names))[:MESSAGES_READ]))
    field = re.compile(rf"(?<![\w.])(?:{either})\.(?!data\b)([A-Za-z]\w*)\b(?! *\()")
    taken = [(at + 1, field.findall(texts[at])) for at in range(first, last)]
    fields = list(dict.fromkeys(one for _, found in taken for one in found))
    if not OF_DATA.fullmatch(wanted):
        there = fields_of(package, wanted) if package is not None and either else ()
        return _own_fields(there, taken, wanted, slip)
    if slip.kind == "publisher-type" and slip.message == "String" and wanted != "Bool":
        return "put a number into its `data`, no text"
    alone = slip.kind == "publisher-type" and sum("Publisher(" in text for text in texts) == 1
    sent = [n for n, text in enumerate(texts, 1) if alone and _sends_several(text)]
    sent_on = f"{on_lines(sent)} of {slip.file}"
    single = f"publish one value on {sent_on}, as {wanted} has only `data`" if sent else ""
    if not either or not fields:
        return single
    numbers = [number for number, found in taken if found]
    where = f"{on_lines(numbers)} of {slip.file}"
    value = {"String": "a text", "Bool": "True or False"}.get(wanted, "a number")
    use = "use `data`" if slip.kind == "subscriber-type" else f"put {value} into `data`"
    own = texts[first:last] if wanted == "String" else []
    shown = (PLACES.search(texts[number - 1]) for number in numbers if own)
    text = next((f", and %s in place of {found[0]}" for found in shown if found), "")
    with_number = re.compile(
        rf"\b(?:{either})\.\w+ *(?:[-+*/]=|[-*/<>]|\+ *\d|[!=]=)|[-*/<>] *(?:{either})\."
    )
    if sums := [n for n, line in enumerate(own, first + 1) if with_number.search(line)]:
        text += f"; leave out the calculation with it on {on_lines(sums)}"
    fields = [f"`{one}`" for one in fields]
    named = join_words(fields, most=FIELDS_SHOWN)
    return f"{use}, the only field of {wanted}, in place of {named} on {where}{text}{single and f', and {single}'}"


def _own_fields(
    own: Sequence[str], taken: Iterable[tuple[int, list[str]]], wanted: str, slip: PythonSlip
) -> str:
    """Return that a type of several fields has others than those that are taken on these lines; "" where it has them,
    or is not known."""
    lost = {number: other for number, found in taken if (other := [one for one in found if one not in own])}
    if not own or not lost:
        return ""
    others = dict.fromkeys(f"`{one}`" for found in lost.values() for one in found)
    absent = join_words(others, most=FIELDS_SHOWN)
    given = join_words((f"`{one}`" for one in own), most=FIELDS_SHOWN)
    use = "use" if slip.kind == "subscriber-type" else "set"
    return f"{use} the fields of {wanted}, {given}, in place of {absent} on {on_lines(lost)} of {slip.file}"


def _sends_several(line: str) -> bool:
    """Return whether a line gives `publish(…)` several values."""
    depth, behind = 1, re.sub(r"'[^']*'|\"[^\"]*\"", "''", line).partition(".publish(")[2]
    for letter in behind:
        depth += (letter in "([{") - (letter in ")]}")
        if not depth or (depth == 1 and letter == ","):
            return depth == 1
    return False
