"""What compiles in a student's C++ and is not meant, as far as the text shows it: callbacks that wait, angles in
degrees of which a sine is taken, and arguments that may not be there. Nothing is compiled."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from grader.model.file_fault import Fault
from grader.model.python_slip import PythonSlip
from grader.package.reading import SOURCE_LIMIT_BYTES, printable, read_markup
from grader.wording import join_words

SUFFIXES = frozenset({".cpp", ".cc", ".cxx"})
_OF_HEADERS = frozenset({".h", ".hh", ".hpp", ".hxx"})
HEADERS_MAX = 100
"""So many files are read for what they include, and so much of each counts."""
_DIRECTIVE = re.compile(
    r"^[ \t]*#[ \t]*(?:include[ \t]*[<\"](?P<header>[\w./-]{1,200})[>\"]"
    r"|(?P<off>if[ \t]+0\b)|(?P<on>else|elif|endif)\b)",
    re.MULTILINE,
)
FILES_MAX = 50
SHORT_S = 0.1
"""A callback may wait for less than this."""
_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)
_LISTENS = re.compile(r"\b(?:subscribe|advertiseService)\s*(?:<[^;()]*>)?\s*\(")
_MADE = re.compile(r"\b(?P<call>subscribe|advertise)\s*(?:<[^;()<>]*(?:<[^;()<>]*>)?[^;()<>]*>)?\s*\(")
_ONCE = re.compile(r"\b(?:static|if|else)\b[^;{}]*$|\?[^;{}]*$")
BEFORE_CHARS = 200
"""So many characters before a call may say that it is made once."""
_NAMED = re.compile(r"\s*&?\s*(?P<name>[A-Za-z_][\w:]*)\s*")
_BOUND = re.compile(r"\bbind\s*(?:<[^;()]*>)?\s*\(\s*&?\s*(?P<name>[A-Za-z_][\w:]*)\s*,")
_LAMBDA = re.compile(r"\[[^\[\];]*\]\s*\([^;{}]*?\)[^;{}()]*{")
_ENDLESS = re.compile(
    r"\bwhile\s*\(\s*(?:(?:ros::|\w+(?:\.|->))ok\s*\(\s*\)|true|1)\s*\)|\bfor\s*\(\s*;\s*;\s*\)"
)
_REPEATS = re.compile(r"\bwhile\s*\([^;{}]{0,200}\)\s*{|\bfor\s*\([^{}]{0,200}\)\s*{")
_REPEATS_ONE = re.compile(r"\bwhile\s*\([^;{}]{0,200}\)\s*(?:ros::)?")
_LEAVES = re.compile(r"\b(?:break|return|throw|goto|spinOnce)\b")
_SPIN = re.compile(r"\bros::spin\s*\(")
_SPIN_ONCE = re.compile(r"\bspinOnce\s*\(|\bcall(?:Available|One)\s*\(")
_SPINS = re.compile(r"spin(?!Once\s*;)|Spinner|call(?:Available|One)\b")
_MAIN = re.compile(r"\bmain\s*\(")
_DEFINES_MAIN = re.compile(r"\b(?:int|void)\s+main\s*\([^;{}()]*\)\s*{")
_LOOP = re.compile(r"\bwhile\s*\([^;{}]*\bok\s*\(\s*\)")
_OPENS = re.compile(r"\s*\)?\s*\{")
_SLEEP = re.compile(
    r"\b(?:ros::)?(?:Wall)?Duration\s*\(\s*(?:(?P<s>[\d.]+)|(?P<of>\w+))\s*\)\s*\.\s*sleep\s*\("
    r"|\bus?leep\s*\(\s*(?P<us>\d+)|\b(?P<name>\w+)\s*\.\s*sleep\s*\("
    r"|\bsleep_for\s*\(\s*(?:std::)?(?:chrono::)?milliseconds\s*\(\s*(?P<ms>\d+)|\bsleep(?:_for)?\s*\("
)
_NUMBER = r"(?:\d+\.?\d*|\.\d+)"
_PAUSE = re.compile(
    rf"\bDuration\s+(?P<name>\w+)\s*(?:=\s*[\w:]+\s*)?[({{]\s*(?P<s>{_NUMBER})\s*[)}}]"
    rf"|\b(?:double|float|define)\s+(?P<constant>\w+)\s*=?\s*(?P<value>{_NUMBER})\s*[;\n]"
)
"""Names of lengths in seconds: `Duration pause(0.01)`, `double DT = 0.01`."""
_DEGREES = r"\*\s*180(?:\.0*f?)?\s*/\s*(?:M_PI|3\.14\d*f?|PI|pi)\b"
_IN_DEGREES = re.compile(rf"\b(?P<name>[A-Za-z_]\w*)\s*=\s*[^;=]*{_DEGREES}")
_OF_ANGLE = re.compile(
    r"\b(?:std::)?(?P<call>sin|cos|tan)f?\s*\(\s*(?P<given>[^();]*(?:\([^()]*\)[^();]*)?)\)"
)
_DEAF = re.compile(r"\bwhile\s*\(\s*(?:(?P<ok>(?:ros::|\w+(?:\.|->))ok)|true|1)\s*\)|\bfor\s*\(\s*;\s*;\s*\)")
"""A loop that asks nothing; `ok` without brackets is a function, which is always true."""
_ENDS = re.compile(r"\b(?:break|return|throw|goto|exit)\b|\bok\s*\(")
_SPINNER = re.compile(r"\bAsyncSpinner\s*(?P<star>[*>]+)?\s*(?P<name>[A-Za-z_]\w*)\s*[({=]")
_CHANGES = (
    r"\s*(?:\.\s*(?:push_(?:back|front)|pop_(?:back|front)|push|pop|insert|erase|emplace\w*|clear|resize|append)\s*\("
    r"|[-+*/]=|=(?!=)|\+\+|--)"
)
_HANDLE = re.compile(r"\bNodeHandle\s*&?\s*(?P<name>[A-Za-z_]\w*)\s*[;,)({]")
_PRIVATE = re.compile(r"\b(?P<name>[A-Za-z_]\w*)\s*[({=]\s*(?:ros::NodeHandle\s*[({]\s*)?\"~\"\s*[)}]")
_PLAIN_HANDLE = re.compile(r"\bNodeHandle\s+(?P<name>[A-Za-z_]\w*)\s*;")
_PRIVATE_NAME = re.compile(
    r"p_?n(?:h|ode)?_?|(?:priv(?:ate)?|local)_?(?:nh|n|node|node_handle|handle)_?|(?:nh|node|n)_?(?:p|priv|private|local)_?"
)
_BY_HANDLE = re.compile(
    r"\b(?P<handle>[A-Za-z_]\w*)\s*(?:\.|->)\s*(?:advertise|subscribe|advertiseService)\s*(?:<[^;()]*?>)?\s*\(\s*\"(?P<topic>[A-Za-z]\w*)\""
)
_BY_VALUE = re.compile(r"(?!const\b)(?P<type>[\w:]+(?:<[\w:<>, ]*>)?)\s+(?P<name>[A-Za-z_]\w*)")
_SWITCH = re.compile(r"\bswitch\s*\([^;{}]{0,200}\)\s*{")
SWITCHES_MAX = 50
_LONG = re.compile(
    r"\bRate\s+\w+\s*[({]\s*(?P<hz>0?\.\d+)\s*[)}]|\bDuration\s*\(\s*(?P<s>\d+)(?:\.\d*)?\s*\)\s*\.\s*sleep\s*\("
    r"|(?<![.\w>])sleep\s*\(\s*(?P<n>\d+)\s*\)"
)
LONG_S = 2.0
"""A node that sleeps for longer at a time may be too late after Ctrl-C."""
_OF_FLOATS, _OF_WHOLES = (
    re.compile(r"\bstd_msgs::Float(?:32|64)\b"),
    re.compile(r"\bstd_msgs::U?Int\d+\b|<\s*int\s*>"),
)
_WHOLE_SUM = re.compile(r"\b(?:int|long)\s+(?P<name>\w+)\s*=\s*0\s*;|\baccumulate\s*\([^;{}]*,\s*0\s*\)")
_ARGUMENT = re.compile(r"\bargv\s*\[\s*(?P<n>[1-9])\s*\]")
_COUNTED = re.compile(
    r"\bargc\s*(?:<|!=|==|>(?!=|\s*0)|>=(?!\s*[01]\b))|[<>=]\s*argc\b|\bswitch\s*\(\s*argc\b"
)
"""A test whether there are arguments: there is always one, the program's name."""
_KEYBOARD = re.compile(
    r"\b(?:std::)?cin\s*>>|\bgetline\s*\(\s*(?:std::)?cin\b|\b(?:scanf|getchar|_?getch|_?kbhit)\s*\("
    r"|\b(?:::)?read\s*\(\s*(?:0|STDIN_FILENO)\s*,|\bfgets\s*\([^;()]*\bstdin\s*\)"
)
_DECLARES = re.compile(r"\b(?:int|char|void|bool)\s*$")
_TURNED = re.compile(r"180|rad|PI\b", re.IGNORECASE)
"""So an angle in degrees is made one in radians."""
_BRACE, _BRACKET = re.compile(r"[{}]"), re.compile(r"[][(){},]")
_PARAMETER = re.compile(
    r"\bstd_msgs::\w+(?P<arrow>[^(){};,]*Ptr\b)?[^(){};,]*\b(?P<name>\w+)\s*\)\s*(?:const\s*)?\{$"
)
_PRINTS = re.compile(
    r"\b(?:ROS_(?:INFO|WARN|ERROR|FATAL)\w*\s*\(|c(?:out|err)\s*<<|f?printf\s*\(|f?puts\s*\()(?P<what>[^;{}]*)"
)
_VARIABLE = re.compile(r"(?<![\w.>:])[A-Za-z_]\w*(?!\w|\s*::|\s*\()")
_IN_PLACE = r"(?:\w*sort|reverse|\w*shuffle|transform|rotate|swap|unique|fill)"
_NO_VALUES = frozenset({"endl", "stdout", "stderr", "cout", "flush"})
PRINTS_MAX = 5
"""A callback with more calls that print, or a call with more names, is not looked at."""
_WHOLE_TURN = 7
"""Of a number of radians, no one writes more."""


class _Body(NamedTuple):
    """A function's name, and where the text between its braces begins and ends."""

    name: str
    start: int
    end: int


def cpp_slips(folder: Path, paths: Iterable[str]) -> tuple[PythonSlip, ...]:
    """Return the slips of the C++ sources among the paths."""
    sources = [path for path in paths if PurePosixPath(path).suffix in SUFFIXES][:FILES_MAX]
    found: list[PythonSlip] = []
    for path in sources:
        data = read_markup(folder, path, SOURCE_LIMIT_BYTES)
        if not isinstance(data, Fault):
            found += slips_of(printable(path), data.decode("utf-8", "replace"))
    return tuple(found)


def slips_of(path: str, text: str) -> Iterator[PythonSlip]:
    """Yield the slips of one source, in the order of their kinds."""
    # blanks of the same length, so that each place is that of the source
    code = _TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    yield from _waiting(path, code)
    yield from _unspun(path, code)
    yield from _unstarted_spinner(path, code)
    yield from _copied_values(path, code)
    yield from _private_handles(path, code, without_comments(text))
    yield from _made_again(path, code)
    yield from _prints_another(path, code)
    yield from _without_main(path, text, code)
    yield from _degrees(path, code)
    if _MAIN.search(code):
        yield from _endless(path, code)
        yield from _asleep(path, code)
        yield from _typed(path, code)
    yield from _unasked_argument(path, code)
    yield from _whole_numbers(path, text, code)


def without_comments(text: str) -> str:
    """Return a source with blanks in place of its comments."""
    return _TEXT.sub(lambda match: match[0] if match[0][0] == '"' else re.sub(r"[^\n]", " ", match[0]), text)


def _whole_numbers(path: str, text: str, code: str) -> Iterator[PythonSlip]:
    """Yield the sums in a source with messages of floats, and of no whole numbers, that drop what is behind the decimal
    point."""
    if not _OF_FLOATS.search(text) or _OF_WHOLES.search(text):
        return
    for match in _WHOLE_SUM.finditer(code):
        line, name = code.count("\n", 0, match.start()) + 1, match["name"]
        added = rf"\b{name}\s*(?:\+=|=\s*{name}\s*\+)(?!\s*\d+\s*;)"
        if name and not (re.search(added, code) and re.search(rf"=[^;=]*\b{name}\s*/", code)):
            continue
        message, fix = f"`{name}` is an int", f"write `double {name}` on line {line}"
        if not name:
            message, fix = (
                "`accumulate` begins with an int",
                f"write `0.0` in place of the `0` on line {line}",
            )
        message += ", which drops what is behind the decimal point"
        yield PythonSlip(file=path, line=line, kind="wrong-value", message=message, fix=fix, name="bounds")


def _waiting(path: str, code: str) -> Iterator[PythonSlip]:
    made = _PAUSE.finditer(code)
    pauses_s = {one["name"] or one["constant"]: float(one["s"] or one["value"]) for one in made}
    for body in dict.fromkeys(_callbacks(code)):
        found = next(_waits_in(body, code, pauses_s), None)
        if found is not None:
            at, message, fix = found
            line, begins = _line(code, at), f"line {_line(code, body.start)}"
            called = f"`{body.name}`" if body.name else f"on {begins}"
            words = {"message": message.format(name=called, line=line), "fix": fix.format(line=line)}
            name = body.name or begins
            yield PythonSlip(file=path, line=line, kind="callback-waits", name=name, **words)


def _unspun(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the loop of a node that subscribes, or offers a service, and never lets ROS call anything."""
    loop, spin, main = _LOOP.search(code), _SPINS.search(code), _DEFINES_MAIN.search(code)
    if loop is None or not _LISTENS.search(code) or not _MAIN.search(code):
        return  # of a class, the file with its main() may spin
    opened = _OPENS.match(code, loop.end())
    below = end_of_block(code, opened.end()) if opened else loop.end()
    # what stands below the loop of `main` comes when the node ends
    inside = main is not None and main.end() <= loop.start() and end_of_block(code, main.end())
    if spin is not None and not (opened and inside and below < spin.start() < inside):
        return
    line = _line(code, loop.start())
    message = f"the loop on line {line} never calls ros::spinOnce(), so that no callback is ever called"
    fix = f"write `ros::spinOnce();` in the loop on line {line}"
    yield PythonSlip(file=path, line=line, kind="callback-waits", message=message, fix=fix)


def _unstarted_spinner(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the `AsyncSpinner` that nothing starts, where nothing else lets ROS call anything."""
    made = _SPINNER.search(code)
    if made is None or re.search(rf"\b{made['name']}\s*(?:\.|->)\s*start\s*\(", code):
        return
    others = _SPINS.sub("", code[: made.start()]) + code[made.end() :]
    if not re.search(r"\bspin(?:Once)?\s*\(", others):
        line, name = _line(code, made.start()), made["name"]
        dot = "->" if made["star"] else "."
        message = f"the spinner of line {line} is never started, so that no callback is ever called"
        fix = f"below line {line}, write `{name}{dot}start();`"
        yield PythonSlip(file=path, line=line, kind="callback-waits", message=message, fix=fix)


def _copied_values(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield what a function that `bind` is given changes of a value of which each call gets a copy."""
    for bound in islice(_BOUND.finditer(code), SWITCHES_MAX):
        body = _body(bound["name"].rpartition("::")[2], code)
        head = code.rfind("(", 0, body.start) if body else -1
        given = [
            code[start:end].strip() for start, end in _arguments(code, code.index("(", bound.start()) + 1)
        ]
        for place, (start, end) in enumerate(_arguments(code, head + 1)) if body and head >= 0 else ():
            parameter = _BY_VALUE.fullmatch(code[start:end].strip())
            value = given[place + 1] if place + 1 < len(given) else ""
            if body is None or parameter is None or not value or value.startswith("_") or "ref(" in value:
                continue
            name, kind = parameter["name"], parameter["type"]
            if found := re.compile(rf"(?<![\w.>]){name}{_CHANGES}").search(code, body.start, body.end):
                line = _line(code, end - len(code[start:end].lstrip()))
                message = f"each call of `{body.name}` gets a copy of its own of `{name}`, so that what line "
                message += f"{_line(code, found.start())} changes is lost"
                fix = f"on line {line}, write `{kind}& {name}`, and on line {_line(code, bound.start())}, "
                fix += f"`boost::ref({value})` in place of `{value}`"
                yield PythonSlip(
                    file=path, line=line, kind="wrong-value", message=message, fix=fix, name="copied"
                )


def _private_handles(path: str, code: str, text: str) -> Iterator[PythonSlip]:
    """Yield the topics and services that are made with a private NodeHandle; `name` is `private` and the topic's
    name. Whether they should be, a run shows."""
    private = {match["name"] for match in _PRIVATE.finditer(text)}
    plain = {match["name"] for match in _PLAIN_HANDLE.finditer(text)}
    others = [match["name"] for match in _HANDLE.finditer(code)]
    others = [one for one in others if one not in private and not _PRIVATE_NAME.fullmatch(one)]
    found: dict[str, list[re.Match[str]]] = {}
    for match in _BY_HANDLE.finditer(text):
        handle = match["handle"]
        if handle in private or (handle not in plain and _PRIVATE_NAME.fullmatch(handle)):
            found.setdefault(handle, []).append(match)
    for handle, every in found.items():
        lines, topics = [_line(text, match.start()) for match in every], [match["topic"] for match in every]
        where = f"line {lines[0]}" if len(lines) == 1 else f"lines {join_words(map(str, lines))}"
        message = (
            f"`{handle}` is a private NodeHandle: `{topics[0]}` of it is a name in the node's own namespace"
        )
        right = f"`{others[0]}` in place of `{handle}`" if others else f'`"/{topics[0]}"`, with the slash'
        fix, name = f"on {where}, write {right}", " ".join(("private", *topics))
        yield PythonSlip(file=path, line=lines[0], kind="wrong-value", message=message, fix=fix, name=name)


def _endless(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the loops that keep a program from ending on Ctrl-C, of which roscpp only makes a note."""
    leaving = _without_switches(code)
    for match in _DEAF.finditer(code):
        opened = _OPENS.match(code, match.end())
        end = end_of_block(code, opened.end()) if opened else match.end()
        line = _line(code, match.start())
        if match["ok"] or not _ENDS.search(leaving, match.end(), end):
            message = (
                f"`{match['ok']}` has no brackets on line {line} of {path}"
                if match["ok"]
                else f"nothing in the loop on line {line} of {path} asks whether the node should end"
            )
            fix = f"write `while ({match['ok'] or 'ros::ok'}())` on line {line}"
            yield PythonSlip(file=path, line=line, kind="deaf", message=message, fix=fix)


def _without_switches(code: str) -> str:
    """Return the code with blanks in place of each `break` of a `switch`, which leaves nothing else."""
    for match in islice(_SWITCH.finditer(code), SWITCHES_MAX):
        end = end_of_block(code, match.end())
        code = code[: match.end()] + code[match.end() : end].replace("break", "     ") + code[end:]
    return code


def _asleep(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the long sleeps, which Ctrl-C does not end; `name` is the length in seconds."""
    for match in _LONG.finditer(code):
        hz = float(match["hz"] or 0)
        pause_s = 1 / hz if hz else float(match["s"] or match["n"] or 0)
        if pause_s > LONG_S:
            line, pause = _line(code, match.start()), f"{pause_s:g}"
            message = f"line {line} of {path} lets it sleep for {pause} s at a time"
            yield PythonSlip(file=path, line=line, kind="deaf", message=message, name=pause)


def included_headers(folder: Path, paths: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return of each C++ source among the paths which headers of the form `lab1/Num.h` it includes that are no files of
    the package: by itself, or by the package's own headers."""
    own = [path for path in paths if PurePosixPath(path).suffix in SUFFIXES | _OF_HEADERS][:HEADERS_MAX]
    named = {printable(path): _includes(folder, path) for path in own}
    ends: dict[str, list[str]] = {}
    for path in named:
        ends.setdefault(PurePosixPath(path).name, []).append(path)
    found: dict[str, tuple[str, ...]] = {}
    for source in (path for path in named if PurePosixPath(path).suffix in SUFFIXES):
        others: dict[str, None] = {}
        read, queue = {source}, [source]
        for path in queue:
            for header in named[path]:
                alike = [
                    p for p in ends.get(PurePosixPath(header).name, ()) if f"/{p}".endswith(f"/{header}")
                ]
                queue += [p for p in dict.fromkeys(alike) if p not in read]
                read.update(alike)
                if not alike and re.fullmatch(r"\w+/\w+\.h", header):
                    others[header] = None
        found[source] = tuple(others)
    return found


def _includes(folder: Path, path: str) -> tuple[str, ...]:
    """Return what a file includes, but for comments and what stands behind `#if 0`."""
    data = read_markup(folder, path, SOURCE_LIMIT_BYTES)
    text = "" if isinstance(data, Fault) else data.decode("utf-8", "replace")
    code = _TEXT.sub(lambda found: found[0] if found[0].startswith('"') else " ", text)
    found, is_off = list[str](), False
    for match in _DIRECTIVE.finditer(code):
        is_off = match["off"] is not None or (is_off and match["on"] is None)
        if match["header"] and not is_off:
            found.append(match["header"].removeprefix("../"))
    return tuple(found[:HEADERS_MAX])


def _typed(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the first line that reads what is typed."""
    calls = (m.start() for m in _KEYBOARD.finditer(code))
    at = next((at for at in calls if not _DECLARES.search(code, max(0, at - BEFORE_CHARS), at)), None)
    if at is not None:
        line = _line(code, at)
        message = f"line {line} of {path} reads what is typed, and a graded node gets no input"
        fix = f"write a value in the code in place of what line {line} of {path} reads"
        yield PythonSlip(file=path, line=line, kind="input", message=message, fix=fix)


def _unasked_argument(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the first argument of the command line that is read although nothing asks whether it is there."""
    read = next(_ARGUMENT.finditer(code), None)
    if read is not None and _COUNTED.search(code) is None:
        line, given = _line(code, read.start()), f"argv[{read['n']}]"
        message = f"it reads {given} on line {line} of {path}"
        fix = f'write `argc > {read["n"]} ? {given} : "…"` there, with what it should be without an argument'
        yield PythonSlip(file=path, line=line, kind="no-argument", message=message, fix=fix, name=read["n"])


def _made_again(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield the publisher that a callback makes each time it is called, and what a loop makes in each of its turns."""
    once = "make the publisher once, in `main` or in the constructor, and keep it in a variable that stays"
    for body in dict.fromkeys(_callbacks(code)):
        what = f"callback `{body.name}`" if body.name else "callback"
        if (made := _made_in(body, code)) and made["call"] == "advertise":
            line = _line(code, made.start("call"))
            message = f"the {what} makes another publisher each time (line {line}), and nothing is connected to it yet"
            fix = f"{once}: a global one, or a member"
            yield PythonSlip(file=path, line=line, kind="callback-waits", message=message, fix=fix)
    for loop in _LOOP.finditer(code):
        begin = _OPENS.match(code, loop.end())
        if begin and (made := _made_in(_Body("", begin.end(), end_of_block(code, begin.end())), code)):
            line = _line(code, made.start("call"))
            what = (
                f"makes another publisher each time (line {line}), and nothing is connected to it yet"
                if made["call"] == "advertise"
                else f"subscribes again in each turn, on line {line}, and misses what comes in between"
            )
            message = f"the loop on line {_line(code, loop.start())} {what}"
            fix = f"move line {line} above the loop"
            yield PythonSlip(file=path, line=line, kind="callback-waits", message=message, fix=fix)


def _prints_another(path: str, code: str) -> Iterator[PythonSlip]:
    """Yield what a callback prints in place of what it hears: another variable, or one that it has changed."""
    for body in dict.fromkeys(_callbacks(code)):
        prints = [*_PRINTS.finditer(code, body.start, body.end)]
        head = _PARAMETER.search(code[max(0, body.start - BEFORE_CHARS) : body.start])
        if not 0 < len(prints) <= PRINTS_MAX or head is None:
            continue
        value = f"{head['name']}{'->' if head['arrow'] else '.'}data"
        is_whole = re.search(rf"\b{head['name']}\b(?!\s*(?:->|\.))", code[body.start : body.end])
        if is_whole or any(head["name"] in one["what"] for one in prints):
            continue  # it prints it, or another function does
        told = {_printed_instead(one, code[body.start : one.start()], head["name"]) for one in prints}
        if len(told) == 1 and (what := told.pop()):
            line = _line(code, prints[0].start())
            fix = f"on line {line}, print `{value}` itself"
            yield PythonSlip(
                file=path, line=line, kind="not-printed", message=f"line {line} prints {what}", fix=fix
            )


def _printed_instead(call: re.Match[str], before: str, own: str) -> str:
    """Return what a call prints that is not the value of the message `own`, "" where it may be that value."""
    names = [name for name in dict.fromkeys(_VARIABLE.findall(call["what"])) if name not in _NO_VALUES]
    for name in names[:PRINTS_MAX]:
        words = [re.compile(rf"\b{word}\b") for word in (name, own)]
        given = [one for one in before.split(";") if all(word.search(one) for word in words)]
        if any(len(one) > BEFORE_CHARS for one in given):
            return ""
        whole = rf"{own}\s*(?:->|\.)\s*data\b(?:\s*\.\s*c_str\(\))?"
        made = rf"\b{name}\s*[=({{]\s*{whole}\s*(?P<more>[^)}}\s].*)?[)}}]?\s*$"
        found = [re.search(made, one) for one in given]
        changes = rf"\b{name}\s*(?:\[[^];]{{0,80}}\]\s*)?[-+*/%]=|\b{_IN_PLACE}\s*\([^;]{{0,80}}\b{name}\b"
        is_other = any(one and one["more"] for one in found) or re.search(changes, before)
        if given and (not is_other or not all(found)):
            return ""
        if given:
            return f"`{name}`, which is made of the message's value, and not the value itself"
    if not names:
        return "nothing of the message"
    return f"`{names[0]}`, and not the message's value" if len(names) == 1 else ""


def _made_in(body: _Body, code: str) -> re.Match[str] | None:
    """Return the first `advertise(…)` or `subscribe(…)` of a body that runs each time, and in no inner block."""
    for made in _MADE.finditer(code, body.start, body.end):
        if not _ONCE.search(code, max(body.start, made.start() - BEFORE_CHARS), made.start()):
            before = code[body.start : made.start()]
            return made if before.count("{") == before.count("}") else None
    return None


def _callbacks(code: str) -> Iterator[_Body]:
    """Yield the bodies of what messages and requests call: functions, methods, what `bind` is given, lambdas."""
    for call in _LISTENS.finditer(code):
        # the name of the topic and the length of the queue come first; what comes behind the callback is its object
        for start, end in [*_arguments(code, call.end())][1:]:
            given = code[start:end]
            named = _NAMED.fullmatch(given) or _BOUND.search(given)
            if found := _LAMBDA.search(given):
                at = start + found.end()
                yield _Body("", at, end_of_block(code, at))
            elif named and (body := _body(named["name"].rpartition("::")[2], code)):
                yield body
            else:
                continue
            break


def _arguments(code: str, start: int) -> Iterator[tuple[int, int]]:
    """Yield where each argument of a call begins and ends, whose bracket is the one before `start`."""
    depth, begin = 0, start
    for match in _BRACKET.finditer(code, start):
        if match[0] == "," and not depth:
            yield begin, match.start()
            begin = match.end()
        elif match[0] in "([{":
            depth += 1
        elif match[0] in ")]}":
            depth -= 1
        if depth < 0:
            yield begin, match.start()
            return


def _body(name: str, code: str) -> _Body | None:
    """Return the body of the function, or of the lambda, of that name; None where the source has none."""
    word = re.escape(name)
    head = re.search(rf"\b(?:\w+::)*{word}\s*\([^;{{}}]*\)\s*(?:const\s*)?{{", code)
    head = head or re.search(rf"\b{word}\s*=\s*{_LAMBDA.pattern}", code)
    return _Body(name, head.end(), end_of_block(code, head.end())) if head else None


def end_of_block(code: str, at: int) -> int:
    """Return where the block ends in which a place is: its closing brace, or the end of the code."""
    depth = 0
    for brace in _BRACE.finditer(code, at):
        depth += 1 if brace[0] == "{" else -1
        if depth < 0:
            return brace.start()
    return len(code)


def _line(text: str, at: int) -> int:
    """Return the number of the line, from 1, in which a place is."""
    return text.count("\n", 0, at) + 1


def _waits_in(body: _Body, code: str, pauses_s: dict[str, float]) -> Iterator[tuple[int, str, str]]:
    """Yield where the function does not come to its end, or late, with what to say and to do."""
    for match in _ENDLESS.finditer(code, body.start, body.end):
        brace = code.find("{", match.end(), body.end)
        end = end_of_block(code, brace + 1) if brace >= 0 else body.end
        if not _LEAVES.search(code, match.end(), end):
            yield (
                match.start(),
                "the loop in the callback {name}, line {line}, never ends",
                "take the loop out of it",
            )
    for match in _SPIN.finditer(code, body.start, body.end):
        yield match.start(), "the callback {name} calls spin() on line {line}", "move line {line} out of it"
    for match in _SLEEP.finditer(code, body.start, body.end):
        if _seconds(match, pauses_s) < SHORT_S:
            continue
        loop = _loop_around(match.start(), body, code)
        if loop is None:
            yield match.start(), "the callback {name} sleeps on line {line}", "delete line {line}"
            continue
        fix = "keep in it only what came, and go through the loop of line {line} in the main program"
        yield loop.start(), "the loop in the callback {name}, line {line}, sleeps in each turn", fix
    for match in _SPIN_ONCE.finditer(code, body.start, body.end):
        message = "the callback {name} calls spinOnce() on line {line}, and so is called again before it ends"
        fix = "delete line {line}"
        if loop := _loop_around(match.start(), body, code):
            fix = f"take the loop of line {_line(code, loop.start())} out of it, and keep in variables what has to last"
        yield match.start(), message, fix


def _loop_around(at: int, body: _Body, code: str) -> re.Match[str] | None:
    """Return the outermost loop of a body in whose braces, or in whose one statement, a place is."""
    for loop in _REPEATS.finditer(code, body.start, at):
        if at < end_of_block(code, loop.end()):
            return loop
    return next((one for one in _REPEATS_ONE.finditer(code, body.start, at) if one.end() == at), None)


def _seconds(match: re.Match[str], pauses_s: dict[str, float]) -> float:
    """Return how long a call sleeps; of one that does not say it, that it is long."""
    if (name := match["name"] or match["of"]) in pauses_s:
        return pauses_s[name]
    for unit, factor in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if match[unit] and re.fullmatch(r"\d+\.?\d*|\.\d+", match[unit]):
            return float(match[unit]) * factor
    return 1.0


def _without_main(path: str, text: str, code: str) -> Iterator[PythonSlip]:
    """A `main` that stands in a comment, where the file has no other."""
    begins = next(_DEFINES_MAIN.finditer(text), None) if not _DEFINES_MAIN.search(code) else None
    if begins is not None:
        line = _line(text, begins.start())
        message, fix = (
            f"`main` is a comment (line {line})",
            "take `main` out of the comment, down to its last `}`",
        )
        yield PythonSlip(file=path, line=line, kind="commented-out", message=message, fix=fix, name="main")


def _degrees(path: str, code: str) -> Iterator[PythonSlip]:
    names = {match["name"] for match in _IN_DEGREES.finditer(code)}
    for match in _OF_ANGLE.finditer(code):
        given = match["given"].strip()
        number = float(given.rstrip("f")) if re.fullmatch(r"\d+(?:\.\d*)?f?", given) else 0.0
        in_degrees = not names.isdisjoint(re.findall(r"[A-Za-z_]\w*", given)) and not _TURNED.search(given)
        if in_degrees or re.search(_DEGREES, given):
            fix = "leave out `* 180 / M_PI`: the angle is already in radians"
        elif number >= _WHOLE_TURN or re.fullmatch(r"\w*(?:deg|degrees)\w*", given, re.IGNORECASE):
            fix = f"write `{match['call']}({given} * M_PI / 180)`"
        else:
            continue
        line = _line(code, match.start())
        message = f"`{match['call']}` takes radians, and gets degrees"
        yield PythonSlip(file=path, line=line, kind="wrong-value", message=message, fix=fix, name="degrees")
