"""What a node or a launch file would be marked down for next, once the mistake that hides it is fixed.

The verdicts of a submission come in; in those that could not judge a node, the hint goes on with what its sources show.
Only plain values in sources count, no status changes, and what a check says of what it saw is none of this file's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.support.console_output import probes_on
from grader.checks.support.exit_causes import MAIN, syntax_hint
from grader.checks.support.missing_names import name_slip
from grader.checks.support.parameters import absolute_name
from grader.checks.support.scripts import CPP_SUFFIXES, SYNTAX, cmake_calls, lines_making
from grader.checks.support.text import (
    IN_OWN_WORDS,
    MAKE_RATE,
    SAID_DATA,
    SAID_VALUE,
    SECONDS,
    VALUE,
    code_of,
    could_say,
    in_language,
    in_source,
    in_words,
    near_names,
    says,
    texts_in,
    texts_of_cpp,
)
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.run import Run
from grader.installable import PYTHON_2
from grader.judging.cited_lines import LINE_CHARS, LINES_READ, LOOPS, OF_DATA, PLACES, loop_spins, lost_fields
from grader.judging.facts import Facts, misspelt_sleeps, names_started, scripts_of, sources_of, wrong_rates
from grader.judging.later_launch_faults import OF_LAUNCHES, later_launch_faults
from grader.judging.repeats_and_repairs import text_as_handed_in
from grader.model.package import CMAKE, PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.repair import Repair
from grader.model.verdict import Verdict, cited_lines
from grader.rubric.model import Criterion, Rubric
from grader.wording import NOTHING_TO_DO, join_words, on_lines, significant

NAMES_SHOWN = 3
ASKS = re.compile(r"[^#'\"]*\b(?:raw_)?input\s*\(")
"""A line that calls `input()`."""
SLEEPS_FOR = re.compile(r"[^#'\"]*\brospy\.sleep\(\s*\)")
PLAIN_NUMBER = re.compile(r"\s*(\w+)\s*=\s*[\d.]+\s*(?:#|$)")
RATE_ASKED = re.compile(r"\brospy\.Rate\(\s*(\d+(?:\.\d+)?)\s*\)")
MAKES_RATE = re.compile(r"\s*([\w.]+)\s*=\s*rospy\.Rate\(")
OF_CALLBACKS = ("callback-called", "callback-values")
OF_COUNTERS = {
    "counter-start": (),
    "counter-step": ("step-number", "set-in-loop", "no-effect"),
    "counter-wrap": ("compared", "reset-early"),
}
"""Slips by which a counter is not as each of these checks asks."""
OF_TOPICS = ("hears", "topic-type")
"""Checks that say by themselves that a node is on another topic, and not of which type."""
INTERFACES = {"add_message_files": "msg/", "add_service_files": "srv/", "add_action_files": "action/"}
CALL_LINES = 2
"""How many more lines a call that prints may have."""
CALL_CHARS = 200
"""How long a call of `Subscriber(…)` is up to its callback: a search without an end takes ages on a hostile line."""


class Fix(NamedTuple):
    """How a fault is fixed. A hint that has all of `said`, or this very `text`, has it already; in place of `general`,
    the same advice without its line, comes the text. `types` are the one that the lab wants, and the script's."""

    text: str
    said: tuple[str, ...] = ()
    general: str = ""
    types: tuple[str, str] | None = None

    def as_handed_in(self, repairs: Sequence[Repair]) -> Fix:
        """Return it with the lines that the package had before these repairs."""
        text, *said = (text_as_handed_in(one, repairs) for one in (self.text, *self.said))
        return self._replace(text=text, said=tuple(said))

    def is_in(self, hint: str) -> bool:
        """Return whether the hint has it."""
        return self.text in hint or (self.said != () and all(one in hint for one in self.said))


def add_later_faults(
    verdicts: Mapping[str, Verdict],
    rubric: Rubric,
    facts: Facts,
    *,
    handed_in: PackageFacts | None = None,
    repairs: Sequence[Repair] = (),
) -> dict[str, Verdict]:
    """Return the verdicts; where there was nothing to judge of a node, the hint goes on with what its source shows of
    the criteria that were not reached. `facts` may be those of a copy with these `repairs` of `handed_in`."""
    later: dict[str, list[Fix]] = {}
    missing = [(v.basis.meant, v.mistake) for v in verdicts.values()]
    moved = {meant: of.name for meant, of in missing if of and meant.endswith(".py")}
    for criterion in rubric.criteria:
        verdict = verdicts[criterion.id]
        package = facts.package_of(criterion)
        is_lost = verdict.status.is_lost or verdict.basis.of_machine
        if package is None or criterion.visibility != "visible" or not is_lost:
            continue
        told = later.setdefault(verdict.blocked_by or criterion.id, [])
        if criterion.check in OF_LAUNCHES:
            for teller, text in later_launch_faults(criterion, verdicts, package, facts):
                later.setdefault(teller, []).append(Fix(text))
        elif verdict.basis.unjudged or verdict.basis.of_machine or criterion.check in OF_TOPICS:
            own_later = Later(criterion, verdict, package, facts, moved)
            told += own_later.syntax(handed_in or package)
            told += [one.as_handed_in(repairs) for one in own_later.faults()]
    return {name: _with_later(verdict, later.get(name, ())) for name, verdict in verdicts.items()}


def _with_later(verdict: Verdict, later: Iterable[Fix]) -> Verdict:
    hint, said = verdict.hint, in_language(verdict.hint, "python")
    told = [one for one in dict.fromkeys(later) if not one.is_in(said)]
    if not told or not hint:
        return verdict
    for one in list(told):
        if one.general and one.general in hint:
            told.remove(one)
            hint = hint.replace(one.general, one.text)
    # what is not wanted is not imported first
    for one, (wanted, other) in [(one, one.types) for one in told if one.types]:
        package, _, name = wanted.partition("/")
        undefined = rf"above (line \d+), define {other} or import it \([^)]*\)"
        imported = f"from {package}.msg import {name}"
        if re.search(undefined, hint):
            told.remove(one)
            hint = re.sub(
                undefined, rf"on \1, write {name} instead of {other}, with `{imported}` at the top", hint
            )
        hint = re.sub(rf"from \w+\.msg import {other}\b", imported, hint)
    if not told:
        return verdict.model_copy(update={"hint": hint})
    texts = [one.text for one in told]
    if verdict.basis.of_machine:
        hint = hint.replace(NOTHING_TO_DO, "For the rest, ", 1)
        hint = f"{join_words(texts)}. {hint[:1].upper()}{hint[1:]}"
        return verdict.model_copy(update={"hint": hint})
    return verdict.model_copy(update={"hint": f"{hint}; then {join_words(texts, most=len(texts))}"})


class Later:
    """What a criterion that was not reached would be lost by next, as far as the sources say so in plain values."""

    def __init__(
        self,
        criterion: Criterion,
        verdict: Verdict,
        package: PackageFacts,
        facts: Facts,
        moved: Mapping[str, str],
    ) -> None:
        self._criterion, self._verdict, self._package = criterion, verdict, package
        self._rubric, self._run = facts.rubric, facts.runs.get(criterion.scenario or "")
        self._build = facts.runs.get(PACKAGE_RUN)
        self._wanted = criterion.parameters
        self._topic = str(self._wanted.get("topic", ""))
        scripts = scripts_of(criterion, facts.rubric, package)
        self._slips = [slip for slip in package.slips if slip.file in scripts]
        names = names_started(criterion, facts.rubric) - {PurePosixPath(path).name for path in scripts}
        later = {old for old, new in moved.items() if PurePosixPath(new).name in names}
        self._slips += [slip for slip in package.slips if slip.file in later]
        self._paths = scripts | later | sources_of(criterion, facts.rubric, package)
        self._slips += self._texts_of_cpp()
        self._moved = later
        self._ran = not verdict.basis.cause and not later
        """Names are told already then, and only what is behind them is not."""

    def faults(self) -> Iterator[Fix]:
        """Yield how each is repaired."""
        by_check = {
            "rate": self._rate, "node-name": self._node_name, "hears": self._heard, "topic-type": self._published,
            "build": self._built, "build-and-run": self._built, "message": self._message, "logs": self._logged,
            "copies": self._copied, "params-set": self._set, **dict.fromkeys(OF_COUNTERS, self._counted),
        }  # fmt: skip
        if not self._ran:
            yield from self._names()
        readable = not any(f.is_no_script for f in map(self._package.file, self._paths) if f is not None)
        yield from by_check[self._criterion.check]() if self._criterion.check in by_check and readable else ()

    def _of(self, *kinds: str) -> list[PythonSlip]:
        return [slip for slip in self._slips if slip.kind in kinds]

    def _lines(self, path: str) -> Sequence[str]:
        return self._build.file_lines(path) if self._build is not None else ()

    def _texts_of_cpp(self) -> Iterator[PythonSlip]:
        for path in sorted(path for path in self._paths if PurePosixPath(path).suffix in CPP_SUFFIXES):
            lines = self._lines(path)[:LINES_READ]
            for kind, line, text in texts_of_cpp(text[:LINE_CHARS] for text in lines):
                yield PythonSlip(file=path, line=line, kind=kind, message=text)

    def syntax(self, package: PackageFacts) -> Iterator[Fix]:
        """Yield what keeps a script from running that has to be moved first."""
        for file in package.files if not self._ran else ():
            fault = file.python_fault if file.path in self._moved else None
            if fault is not None and fault.kind in SYNTAX:
                yield Fix(f"in {file.path}, {syntax_hint(fault)}")

    def _names(self) -> Iterator[Fix]:
        """Names that are not there, of which an `except` is not reached, and functions that nothing calls."""
        told: set[tuple[str, int]] = set()
        given: set[tuple[str, str, int]] = set()
        fixes = ((s.file, s.fix) for s in self._of("callback-values"))
        passed = {(file, name) for file, fix in fixes for name in re.findall(r"\w+(?=[,)])", fix)}
        for slip in self._of("misspelt", "undefined"):
            one, is_caught = name_slip(slip, self._package), self._text_of(slip).lstrip().startswith("except")
            if one is not None and not is_caught and (slip.file, one.name) not in passed:
                told.add((slip.file, slip.line))
                place = (slip.file, one.name, self._function_at(slip))
                if place not in given:
                    yield Fix(one.fix, tuple(f"`{line}`" for line in one.imports))
                given |= {place} if one.fix.startswith("above line ") else set()
        asked = self._asked() - told
        for file in sorted({path for path, _ in asked}):
            lines = sorted(number for path, number in asked if path == file)
            asks = "asks" if len(lines) == 1 else "ask"
            yield Fix(f"write a value in the code where {on_lines(lines)} of {file} {asks} for input")
        yield from self._left_over()

    def _left_over(self) -> Iterator[Fix]:
        """Modules of Python 2 behind one that the machine lacks, and slips that are told as they are."""
        for slip in self._of("lacking-import"):
            if slip.message in PYTHON_2 and slip.message not in self._verdict.message:
                yield Fix(f"write {PYTHON_2[slip.message]} instead of {slip.message} on {_line(slip)}")
        meant = {one.fix.partition(" instead of ")[0] for one in self._of("misspelt")}
        renamed = {(slip.file, slip.line): slip.fix for slip in self._of("object")}
        for slip in self._of("never-called"):
            if f"write {slip.name}" not in meant:  # else what calls it has its name wrong
                whole = slip.fix or f"call `{slip.name}()`, which nothing in {slip.file} calls"
                yield Fix(renamed.get((slip.file, slip.line), whole))
        for slip in self._of("float-index"):
            if (slip.file, slip.line) not in cited_lines(self._verdict.citations):
                yield Fix(f"{slip.fix} ({slip.file})", (slip.fix,))
        for slip in self._of("main-guard"):
            yield Fix(f"write {MAIN} on {_line(slip)}", (f"on {_line(slip)}, write {MAIN}",))
        for slip in self._of("never-begun"):
            yield Fix(f"{slip.fix} ({slip.file})", (slip.fix,))

    def _built(self) -> Iterator[Fix]:
        """Sources of C++, and messages, that are not there: CMake asks for them only once it has found all packages."""
        calls = cmake_calls(self._package, "add_executable", "add_library", *INTERFACES)
        words = (
            INTERFACES.get(c.name, "") + word
            for c in calls
            if "DIRECTORY" not in c.args
            for word in c.args[c.name not in INTERFACES :]  # a target may be called talker.cpp
        )
        kinds = (*CPP_SUFFIXES, ".msg", ".srv", ".action")
        named = dict.fromkeys(word for word in words if PurePosixPath(word).suffix in kinds)
        beside = f"{self._package.folder_beside}/"  # what lies there is right once the build files do
        there = [one.path.removeprefix(beside) for one in self._package.files if one.path.endswith(kinds)]
        for path in (one for one in named if not ("$" in one or one in there)):
            near = next(iter(near_names(path, there)), "")
            moved = PurePosixPath(near).name == PurePosixPath(path).name and path.endswith(kinds[-3:])
            absent = f"add {path}, which is not there, and push it, since {CMAKE} names it"
            fix = f"move {near} to {path}" if moved else f"write {near} instead of {path}" if near else absent
            if path not in self._verdict.message and f"move {near} into" not in self._verdict.hint:
                yield Fix(fix)

    def _function_at(self, slip: PythonSlip) -> int:
        """Return the line of the last `def` above the slip: what gives a name its value there is of use below it."""
        lines = self._lines(slip.file)[: slip.line]
        return max((n for n, text in enumerate(lines, 1) if text.lstrip().startswith("def ")), default=0)

    def _has_no_field(self, slip: PythonSlip) -> bool:
        """Return whether a topic's callback prints its argument, and takes no field of it up to there."""
        lines = self._lines(slip.file)
        body = "\n".join(lines[max(self._function_at(slip) - 1, 0) : slip.line + CALL_LINES])
        named = re.match(r"\s*def (\w+)\((?:self, *)?(\w+)\)", body)
        is_callback = named is not None and self._is_given(named[1])
        takes = rf"\b{named[2]}\.|= *{named[2]}\b|\.data\b" if named is not None else ""
        return is_callback and not re.search(takes, body)

    def _is_given(self, callback: str) -> bool:
        """Return whether a line gives a Subscriber this callback, if perhaps called."""
        call = re.compile(
            rf"[^#]*Subscriber\([^#]{{0,{CALL_CHARS}}}[ ,.='\"]{re.escape(callback)}['\"]? *[(,)]"
        )
        lines = [one for path in self._paths for one in self._lines(path)[:LINES_READ]]
        return any(call.match(line[:LINE_CHARS]) for line in lines)

    def _text_of(self, slip: PythonSlip) -> str:
        return next(iter(self._lines(slip.file)[slip.line - 1 : slip.line]), "")

    def _asked(self) -> set[tuple[str, int]]:
        """Return where scripts ask for input; nothing where the verdict is about it, or the grader types the answer."""
        scenario = self._rubric.scenarios.get(self._criterion.scenario or "")
        if scenario is not None and scenario.typed_to:
            return set()
        files = [one for one in map(self._package.file, self._paths) if one is not None and one.python_fault]
        asked = {(s.file, s.line) for s in self._of("input") if not s.file.endswith(CPP_SUFFIXES)} | {
            (one.path, number)
            for one in files
            for number, line in enumerate(self._lines(one.path), 1)
            if ASKS.match(line[:LINE_CHARS])
        }
        # A line that does not parse is cited for that, and not for its question.
        unread = {
            (f.path, f.python_fault.line) for f in files if f.python_fault and f.python_fault.kind in SYNTAX
        }
        return set() if asked & (cited_lines(self._verdict.citations) - unread) else asked

    def _rate(self) -> Iterator[Fix]:
        hz, numbers = float(str(self._wanted["rate_hz"])), self._of("rate-number")
        pauses = [one for one in numbers if one.name]
        if len(pauses) == 1 and self._lacks_words(".sleep()"):  # no Rate is ever slept by
            numbers = pauses
        # A rate that changes within the run is not the one that its loop is made with.
        of_loop = [] if self._wanted.get("cause") is not None else numbers
        if wrong := wrong_rates(of_loop, hz, [self._text_of(one) for one in of_loop]):
            ask = "ask" if len(wrong) > 1 else "asks"
            where = f"{on_lines(sorted(one.line for one in wrong))} of {wrong[0].file}"
            yield Fix(f"make it {significant(hz)} Hz on {where}, which {ask} for {wrong[0].message} Hz")
        of_self = {(s.file, s.line) for s in self._of("misspelt", "undefined") if "self." in s.fix}
        for slip in self._of("not-called"):
            if "sleep" in slip.name:
                owner = "self." if (slip.file, slip.line) in of_self else ""
                yield Fix(f"on {_line(slip)}, {slip.fix.replace(slip.name, owner + slip.name, 1)}")
        for slip in self._of("loop-left") if not self._ran else ():
            yield Fix(f"{slip.fix}, since {slip.message}", (slip.fix,))
        for path in sorted(self._paths) if not self._ran else ():
            lines = [line[:LINE_CHARS] for line in self._lines(path)]
            yield from self._rate_of_lines(path, lines, significant(hz))

    def _rate_of_lines(self, path: str, lines: Sequence[str], hz: str) -> Iterator[Fix]:
        """Yield what keeps the loop of a script that never ran from sleeping."""
        rate = next((found[1] for line in lines if (found := MAKES_RATE.match(line))), "")
        for word, numbers in misspelt_sleeps(lines, rate).items():
            yield Fix(f"write `sleep` instead of `{word}` on {on_lines(numbers)} of {path}")
        for number, line in enumerate(lines, 1):
            if rate and SLEEPS_FOR.match(line):
                yield Fix(f"write `{rate}.sleep()` on line {number} of {path}: rospy.sleep() needs a time")
            plain = PLAIN_NUMBER.match(line)
            if plain and any(re.search(rf"\b{plain[1]}\.sleep\(", one) for one in lines):
                text = (
                    f"write `{plain[1]} = rospy.Rate({hz})` on line {number} of {path}: only a Rate can sleep"
                )
                yield Fix(text, general=MAKE_RATE)
        for number in loop_spins(lines):
            yield Fix(f"delete `rospy.spin()` on line {number} of {path}, at which the loop stands still")
        if not self._lacks_words("sleep") or not any(LOOPS.match(line) for line in lines):
            return
        if rate:
            asked = (RATE_ASKED.search(line) for line in lines)
            slow = next((n for n, found in enumerate(asked, 1) if found and float(found[1]) != float(hz)), 0)
            first = f"write `{rate} = rospy.Rate({hz})` on line {slow} of {path}, and " if slow else ""
            yield Fix(
                f"{first}call `{rate}.sleep()` each time around the loop{'' if slow else f' of {path}'}"
            )
        elif self._lacks_words("Timer(") and self._lacks_words(".wait("):
            made = f"`rate = rospy.Rate({hz})`"
            yield Fix(
                f"let the loop of {path} wait: {made} above it, `rate.sleep()` in it",
                (made, "`rate.sleep()`"),
            )

    def _node_name(self) -> Iterator[Fix]:
        own, names = self._of_process(self._of("node-name")), list(texts_in(self._wanted.get("names")))
        plain = self._wanted.get("anonymous") == "forbidden"
        for slip in self._of("commented-out") if plain and not own and not self._ran else ():
            if slip.name == "init_node" and "anonymous=True" in self._text_of(slip).replace(" ", ""):
                yield Fix(f"remove anonymous=True from {_line(slip)}")
        if self._ran or len(own) != 1 or not names or f"init_node('{names[0]}'" in self._verdict.hint:
            return
        if own[0].message.lstrip("/") not in names:
            yield Fix(f"name the node {names[0]} on {_line(own[0])}, not {own[0].message}")
        if own[0].name == "anonymous" and plain and not own[0].fix:
            yield Fix(f"remove anonymous=True from {_line(own[0])}")

    def _of_process(self, slips: list[PythonSlip]) -> list[PythonSlip]:
        """Return those of the script that the criterion's own process runs, where it names one of several."""
        started = self._rubric.scenarios[self._criterion.scenario or ""].start
        own = next((one.script for one in started if one.name == self._wanted.get("process")), None)
        names = {PurePosixPath(own).name} if own else None
        return [
            s for s in slips if names is None or s.file in self._moved or PurePosixPath(s.file).name in names
        ]

    def _copied(self) -> Iterator[Fix]:
        started = [one.script for one in self._rubric.scenarios[self._criterion.scenario or ""].start]
        twice = {PurePosixPath(one).name for one in started if one and started.count(one) > 1}
        for slip in self._of("node-name"):
            if PurePosixPath(slip.file).name in twice and not slip.name and not slip.fix:
                yield Fix(f"write anonymous=True on {_line(slip)}, since two of it run at once")

    def _topics_of_others(self) -> set[str]:
        """Topics of the same run that other criteria ask for."""
        of_run = (c for c in self._rubric.criteria if c.scenario == self._criterion.scenario)
        return {str(c.parameters["topic"]) for c in of_run if "topic" in c.parameters} - {self._topic}

    def _in_comment(self) -> bool:
        """Return whether the topic's publisher is in a comment: those that the script has are not for it."""
        own = any(f"/{one.message.lstrip('/')}" == self._topic for one in self._of("publisher"))
        return not own and any(one.name.endswith("Publisher") for one in self._of("commented-out"))

    def _published(self) -> Iterator[Fix]:
        published, kind = self._of("publisher"), str(self._wanted.get("type", ""))
        lines = [one.line for one in published if f"/{one.message.lstrip('/')}" == self._topic]
        if self._in_comment() or "of its base class" in self._verdict.message:  # which may have the publisher
            return
        other = published[0] if len(published) == 1 and not lines else None
        if other is not None and f"/{other.message.lstrip('/')}" in self._topics_of_others():
            has = f"{other.file} has only the one of {other.message}"
            yield from [] if self._ran else [Fix(f"add a publisher of {kind} on {self._topic}: {has}")]
            return
        if other is not None and not self._ran:
            yield Fix(f"publish on {self._topic} on {_line(other)}, not on {other.message}")
        own = [one for one in self._of("publisher-type") if one.message == kind.rpartition("/")[2]]
        named = self._ran and {one.line for one in own} & {one.line for one in published}
        if len(published) > 1 and not lines and not named:
            names = join_words(f"{one.message} (line {one.line})" for one in published[:NAMES_SHOWN])
            yield Fix(f"publish {kind} on {self._topic}: {published[0].file} publishes on {names}")
        types = [one for one in self._of("publisher-type") if one.line in lines or len(published) <= 1]
        if self._ran and lines:
            yield from self._made_elsewhere(kind, types)
        elif len(types) == 1 and types[0].message != kind.rpartition("/")[2]:
            yield from self._retype("publish", kind, types[0])

    def _heard(self) -> Iterator[Fix]:
        scenario = self._rubric.scenarios.get(self._criterion.scenario or "")
        probes = scenario.probes if scenario is not None else ()
        sent = [probe.type for probe in probes if probe.topic == self._topic]
        heard, types = self._of("subscriber"), self._of("subscriber-type")
        if len(heard) == 1 and f"/{heard[0].message.lstrip('/')}" in self._topics_of_others():
            heard, types = [], []
        own = sent[0].rpartition("/")[2] if sent else ""
        elsewhere = len(heard) == 1 and f"/{heard[0].message.lstrip('/')}" != self._topic
        if elsewhere and not self._ran:
            yield Fix(f"subscribe to {self._topic} on {_line(heard[0])}, not to {heard[0].message}")
        others = [one for one in heard if f"/{one.message.lstrip('/')}" != self._topic]
        if sent and len(others) == len(heard) > 1 and not self._ran:
            names = join_words(f"{one.message} (line {one.line})" for one in heard[:NAMES_SHOWN])
            yield Fix(f"subscribe to {self._topic} with {sent[0]}: {heard[0].file} subscribes to {names}")
        other = sent and len(types) == 1 and types[0].message != own
        told = heard and self._ran  # of a node on its topic, what ROS refused says it
        if other and (elsewhere or (not told and f"/{types[0].message}" not in self._verdict.message)):
            yield from self._retype("subscribe with", sent[0], types[0])
        elif other and told:
            yield from self._fields(own, types[0])
        unheard = elsewhere or other or not self._ran  # else ROS has called it, and the verdict says it
        for slip in self._of(*OF_CALLBACKS) if unheard and len(heard) <= 1 else ():
            if self._is_given(slip.name):
                at = "" if slip.fix.startswith("on line ") else f"on {_line(slip)}, "
                yield Fix(f"{at}{slip.fix}", (slip.fix,))
        other_type = types[0].message if other else ""
        yield from self._printed(heard, other_type, of_text=own == "String")
        for slip in self._of("takes-number") if other and own == "String" else ():
            yield Fix(f"{slip.fix} of {slip.file}, which needs a number")

    def _printed(self, heard: Sequence[PythonSlip], other_type: str, *, of_text: bool) -> Iterator[Fix]:
        """Yield what is wrong in what is printed of what these subscribe to, with what other type if there is one."""
        template, said = str(self._wanted.get("template", VALUE)), self._of("prints")
        wanted = f"print '{in_words(template)}'"
        if len(heard) > 1 and ", callback)" in self._verdict.hint and self._lacks_words("def callback("):
            yield Fix(f"write `def callback(msg):` above it, which prints '{in_words(template)}'")
            return
        said = [one for one in said if SAID_DATA in one.message]
        right = [one for one in said if says(one.message, template)]
        if right and other_type and of_text and (place := PLACES.search(self._text_of(right[0]))):
            yield Fix(f"write %s instead of {place[0]} on {_line(right[0])}")
        unheard = not self._ran or not (isinstance(self._run, Run) and probes_on(self._run, self._topic))
        if not unheard or template == VALUE:
            # of several topics, those of this name: another may be a slip of it
            yield from self._unprinted(heard if len(heard) <= 1 else ()) if unheard else ()
            return
        if right and len(heard) == 1 and self._has_no_field(right[0]) and ".data`" not in self._verdict.hint:
            yield Fix(f"print the `data` of the message on {_line(right[0])}")
        if right:
            return
        # what else the callback does with a message may fail with the right type, if its fields are others
        own_fields = other_type and not OF_DATA.fullmatch(other_type)
        if not own_fields and len(said) == 1 >= len({one.line for one in heard}):  # else of another callback
            there = f"on {_line(said[0])}, not '{in_source(said[0].message)}'"
            yield Fix(f"{wanted} {there}", general=f"{wanted}, {IN_OWN_WORDS}")
        elif self._lacks_words(template.partition(VALUE)[0]):
            yield Fix(f"{wanted}{' first in the callback' if other_type else ''}")
        elif other_type and not said and len(prints := self._of("prints")) == 1:  # of a field it lacks
            says_it = " ".join(template.partition(VALUE)[0].split()) in " ".join(prints[0].message.split())
            what, at = "the `data` of the message" if says_it else f"'{in_words(template)}'", _line(prints[0])
            types = self._of("subscriber-type") if says_it else ()
            if not any(at in fix.text for one in types for fix in self._fields("String", one)):
                yield Fix(f"print {what} on {at}", general=f"print {what}, {IN_OWN_WORDS}")

    def _made_elsewhere(self, wanted: str, types: Iterable[PythonSlip]) -> Iterator[Fix]:
        """Yield the other lines that make messages of the wrong type, and the fields that only these have."""
        name = wanted.rpartition("/")[2]
        for slip in types:
            told = f"/{slip.message} on" in self._verdict.message and OF_DATA.fullmatch(name)
            others = self._making(slip) if told else ()
            if others:
                yield Fix(f"write {name} instead of {slip.message} on {on_lines(others)} of {slip.file}")
                yield from self._fields(name, slip)

    def _making(self, slip: PythonSlip) -> list[int]:
        """Return the other lines that make a message of the slip's type, and none for another publisher."""
        return lines_making(self._lines(slip.file)[:LINES_READ], slip, self._of("publisher"))

    def _unprinted(self, heard: Sequence[PythonSlip]) -> Iterator[Fix]:
        topics = {self._topic.strip("/"), *(one.message.strip("/") for one in heard)}
        for slip in self._of("not-printed", "printed-in-part"):
            if slip.name.strip("/") in topics:
                yield Fix(f"{slip.fix}: {slip.message}", (slip.fix,))

    def _fields(self, wanted: str, slip: PythonSlip) -> Iterator[Fix]:
        yield from map(Fix, filter(None, [lost_fields(self._lines(slip.file), slip, wanted, self._package)]))

    def _retype(self, verb: str, wanted: str, slip: PythonSlip) -> Iterator[Fix]:
        others, (package, _, name) = self._making(slip), wanted.partition("/")
        notes = [f"made on {on_lines(others)}"] if others else []
        known = re.compile(rf"[^#]*\bimport\b.*(\b{name}\b|\*)")
        if not any(known.match(line[:LINE_CHARS]) for line in self._lines(slip.file) or ["import *"]):
            notes.append(f"with `from {package}.msg import {name}` at the top")
        more = f" ({'; '.join(notes)})" if notes else ""
        yield Fix(f"{verb} {wanted} on {_line(slip)}, not {slip.message}{more}", types=(wanted, slip.message))
        yield from self._fields(name, slip)

    def _lacks_words(self, words: str) -> bool:
        """Return whether the words stand in no line of the sources, which are known, or of modules that they import."""
        imports = [one for path in self._paths for one in self._lines(path)[:LINES_READ] if "import" in one]
        named = set(re.findall(r"\w+", " ".join(line[:LINE_CHARS] for line in imports)))
        own = [f.path for f in self._package.files if f.path.endswith(".py")]
        lines = [
            line.partition("#" if path.endswith(".py") else "//")[0]
            for path in {*self._paths, *(one for one in own if PurePosixPath(one).stem in named)}
            for line in self._lines(path)
        ]
        return bool(lines) and not any(
            words.strip().casefold() in " ".join(line.split()).casefold() for line in lines
        )

    def _set(self) -> Iterator[Fix]:
        found, wanted = self._of("sets-parameter"), str(self._wanted.get("name", ""))
        if len(found) == 1 and absolute_name(found[0].message) != wanted:
            yield Fix(f"set {wanted} on {_line(found[0])}, not {found[0].message}")

    def _counted(self) -> Iterator[Fix]:
        """Yield what is wrong with a counter; where it is added to too early, that comes before what it is reset by."""
        first = str(self._wanted.get("start", self._wanted.get("minimum", 0)))
        starts = {slip.name: slip.message for slip in self._of("start-value")}
        early = [slip for slip in self._of("added-first") if starts.get(slip.name, first) == first]
        others = self._of(*OF_COUNTERS[self._criterion.check])
        named = {slip.name for slip in early}
        for slip in (*early, *(one for one in others if one.fix and one.name not in named)):
            place = f"in {slip.file}" if "line" in slip.fix else f"on {_line(slip)}"
            yield Fix(f"{place}, {slip.fix}", (slip.fix,))

    def _message(self) -> Iterator[Fix]:
        template = str(self._wanted.get("template", ""))
        said = list({one.message: one for one in self._of("publishes")}.values())
        of_cpp = bool(self._paths) and all(path.endswith(CPP_SUFFIXES) for path in self._paths)
        code = in_words(template) if of_cpp else in_language(code_of(template), "python")
        if self._in_comment():
            return
        if len(said) != 1:
            types = {one.message for one in self._of("publisher-type")}
            no_text = bool(types) and "String" not in types
            if not said and (no_text or self._lacks_words(template.partition("{")[0])):
                yield Fix(f"publish `{code}`", (f"`{code}`",))
            return
        text = said[0].message
        if text in {SAID_VALUE, SAID_DATA} and self._lacks_words(template.partition("{")[0]):
            yield Fix(f"publish `{code}` on {_line(said[0])}")
        sample = template.replace(SECONDS, "1234567890.25").replace("{count}", "12")
        if len(self._of("publisher")) > 1:  # it may be another topic's
            if not could_say(text, sample):
                yield Fix(f"publish `{code}`", (f"`{code}`",))
        elif not could_say(text, sample):
            yield Fix(f"publish `{code}` on {_line(said[0])}, not '{in_source(text)}'")
        elif SECONDS in template and self._of("no-clock"):
            yield Fix(f"publish the time on {_line(said[0])}, `{code}`: the script only counts")

    def _logged(self) -> Iterator[Fix]:
        text, said = str(self._wanted.get("text", "")), self._of("prints")
        source = "\n".join(line for path in self._paths for line in self._lines(path)).casefold()
        words = re.findall(r"\w{3,}", text.casefold())
        if source and words and not any(word in source for word in words):
            yield Fix(f"log {text!r}, which no line of {join_words(sorted(self._paths))} does")
        elif len(said) == 1 and "{" not in said[0].message and text not in said[0].message:
            yield Fix(f"log {text!r} on {_line(said[0])}, not {said[0].message!r}")


def _line(slip: PythonSlip) -> str:
    return f"line {slip.line} of {slip.file}"
