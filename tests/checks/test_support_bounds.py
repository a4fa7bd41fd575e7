"""What a process printed may be as long as it may be, and made to keep patterns busy: checks read it in seconds."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

from grader.arena.limits import RunLimits
from grader.checks.support.console_output import printed_lines, printed_times, split_log_line, tracebacks
from grader.checks.support.cpp_errors import first_error
from grader.checks.support.exit_causes import _refused_name
from grader.checks.support.launch import died, finished, name_pattern, refusal
from grader.checks.support.processes import lives
from grader.checks.support.text import NAMES_MAX, near_names
from grader.evidence.events import ConsoleLine, ProcessEvent
from grader.evidence.run import Run
from grader.judging.facts import NO_PACKAGE
from grader.model.launch_file import LaunchNode

LINE_CHARS = 4096
CPU_S = 20.0
"""Minutes or hours before; two seconds on a machine with nothing else to do."""


def cpu_s_of(*calls: Callable[[], object]) -> float:
    """Return the processor time of these calls, in seconds."""
    begin = time.process_time()
    for call in calls:
        call()
    return time.process_time() - begin


def lines_of(part: str) -> list[str]:
    """As many lines as the arena takes, each as long as it takes them."""
    line = (part * LINE_CHARS)[:LINE_CHARS]
    return [line] * (RunLimits().output_bytes // LINE_CHARS)


def run_of(lines: list[str], stream: str = "stderr") -> Run:
    record = [ConsoleLine(process="p", stream=stream, line=line, truncated=False) for line in lines]
    started = ProcessEvent(event="start", name="p", role="student")
    return Run(
        evidence="x.mcap", scenario="x", clock="real", warp=1.0, metadata={"format": "1"},
        start_ns=0, end_ns=10**9,
        processes=((0, started),), console=tuple(enumerate(record)),
    )  # fmt: skip


def node(name: str) -> LaunchNode:
    given = dict.fromkeys(("pkg", "type", "ns", "output", "launch_prefix", "args"))
    return LaunchNode(**given, name=name, namespace="/", remaps=(), line=1)


@pytest.mark.full
@pytest.mark.parametrize(
    "part",
    [
        "multiple nodes named [", "file does not exist [", "Unknown substitution command [", "Unable to launch [1-",
        "missing required attribute: 'a", "requires the 'a", "[", "[1-", "process[1-", "REQUIRED process [1-",
        "[a-1] process has died [pid 1", "\x1b[1",
    ],
)  # fmt: skip
def test_words_of_roslaunch(part: str) -> None:
    run = run_of(lines_of(part))
    calls = (lambda: refusal(run, NO_PACKAGE), lambda: died(run, node("a")), lambda: finished(run, node("a")))
    assert cpu_s_of(*calls) < CPU_S


@pytest.mark.full
@pytest.mark.parametrize("part", ["a", "aError", "a:1:", "CMake Error at a", "Error", "error "])
def test_errors_of_a_build(part: str) -> None:
    assert cpu_s_of(lambda: first_error(lines_of(part), NO_PACKAGE)) < CPU_S


@pytest.mark.full
@pytest.mark.parametrize(
    "part", ["a_1", "a/", "1", "-1 ", "1.", "0x", "[", "[INFO] [", " ", "/a_1_123456789"]
)
def test_lines_that_a_node_printed(part: str) -> None:
    lines = lines_of(part)
    assert (
        cpu_s_of(lambda: printed_lines(run_of(lines)), lambda: [split_log_line(line) for line in lines])
        < CPU_S
    )


def test_a_node_of_half_letters_half_digits() -> None:
    line = "a" * (LINE_CHARS // 2) + "_" + "1" * (LINE_CHARS // 2)
    assert cpu_s_of(lambda: printed_lines(run_of([line] * 2000))) < CPU_S


@pytest.mark.parametrize(
    "part", ["register service [", "register service [] with master: ", "illegal chars "]
)
def test_names_that_ros_refused(part: str) -> None:
    run = run_of([f"{line[:-14]} illegal chars" for line in lines_of(part)])
    assert cpu_s_of(lambda: _refused_name(lives(run)[0], run)) < CPU_S


@pytest.mark.parametrize("line", ['  File "a", line 1', "Traceback (most recent call last):", " ", "a: b"])
def test_tracebacks_of_as_many_lines_as_there_may_be(line: str) -> None:
    assert cpu_s_of(lambda: tracebacks([line] * RunLimits().output_lines)) < CPU_S


def test_a_syntax_error_without_a_heading_is_found_all_the_same() -> None:
    lines = ['  File "a.py", line 3', "    x = (", "        ^", "SyntaxError: never closed", "more"]
    (found,) = tracebacks(lines)
    assert (found.kind, found.first, found.last) == ("SyntaxError", 0, 3)
    assert tracebacks([*lines[:3], "no error"]) == ()


@pytest.mark.parametrize("part", ["$(anon a)", "$(find a)", "$(anon a)_", "$(a)b"])
def test_names_made_of_substitutions(part: str) -> None:
    pattern = name_pattern(node(part * 400 + "z"))
    names = ("/" + "a_" * 2000, "/" + "b" * LINE_CHARS, "/" + "a_x" * 1300)
    assert cpu_s_of(lambda: [pattern.fullmatch(name) for name in names]) < CPU_S


@pytest.mark.parametrize(
    ("name", "fits", "not_"),
    [
        ("$(anon a)", ["/a_host_1_2"], ["/a", "/b_1", "/a_"]),
        ("$(anon a)_b", ["/a_x_b", "/a_b_b"], ["/a_b", "/a_x_c"]),
        ("x$(find p)y$(find p)z", ["/xyz", "/x1y2z", "/xyyzz"], ["/xz", "/1xyz"]),
        ("$(anon a)$(anon b)", ["/a_1b_2", "/a_b_b_b"], ["/a_b_", "/a_1"]),
        ("$(find p)$(find p)", ["/", "/a"], ["a"]),
        ("a b", ["/a b"], ["/a_b"]),
    ],
)
def test_what_such_names_stand_for(name: str, fits: list[str], not_: list[str]) -> None:
    pattern = name_pattern(node(name))
    assert [bool(pattern.fullmatch(one)) for one in fits] == [True] * len(fits)
    assert [bool(pattern.fullmatch(one)) for one in not_] == [False] * len(not_)


@pytest.mark.full
@pytest.mark.parametrize(("text", "line"), [("1 " * 99 + "1", "1 " * 98 + "12 "), ("a " * 99 + "b", "a ")])
def test_texts_that_nearly_are_in_lines(text: str, line: str) -> None:
    run = run_of(lines_of(line), stream="stdout")
    texts = [text[2 * number :] for number in range(95)] * 20
    assert cpu_s_of(lambda: printed_times(run, "p", texts, "{value}")) < CPU_S


def test_texts_are_counted_as_before() -> None:
    run = run_of(["I heard hello  world 3", "hello world 33", "Hello world 3"], stream="stdout")
    assert printed_times(run, "p", ["hello world 3"], "{value}") == {"hello world 3": 1}
    assert printed_times(run, "p", ["x" * 1000], "{value}") == {}


@pytest.mark.parametrize("name", ["talker.py", "a" * 5000])
@pytest.mark.parametrize("other", [pytest.param("a" * 240, marks=pytest.mark.full), "talker", "pytalker"])
def test_near_names_among_thousands(name: str, other: str) -> None:
    begin = time.process_time()
    found = near_names(name, [f"{other}{number}" for number in range(50_000)])
    assert time.process_time() - begin < CPU_S
    assert len(found) <= NAMES_MAX


def _anonymous(text: str) -> str:
    return printed_lines(run_of([text]))[0].text


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/node_12_1700000000000: 7", " : 7"),
        ("node_12_1700000000000abc 7", " abc 7"),
        ("12node_1_123456789_123456789", "12 "),
        ("node_12_17 7", "node_12_17 7"),
        ("a_1_123456789 b_2_123456789", "   "),
    ],
)
def test_names_that_ros_made_anonymous_are_left_out(text: str, left: str) -> None:
    check: Callable[[str], str] = _anonymous
    assert check(text) == left
