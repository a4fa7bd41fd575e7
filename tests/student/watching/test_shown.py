"""What `grader check --watch` prints."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from io import BytesIO, StringIO, TextIOWrapper

from rich.console import Console

from grader.errors import ExitCode
from grader.model.result import ErrorInfo, GradingResult
from grader.model.verdict import Status
from grader.report.sentences import MINUS
from grader.student.watching import DASH, JsonLines, TerminalScreen, WatchedResult, compare
from tests.report.hostile import ESCAPES, MARKDOWN, RICH, XML, criterion, result, rubric

NOON = datetime(2026, 3, 2, 12, 3, 4, tzinfo=timezone.utc)
CLEARED = "\x1b[2J\x1b[H"


class Terminal(StringIO):
    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def graded(*criteria, **changes: object) -> GradingResult:
    reached = sum(c.points for c in criteria)
    most = sum(c.max_points for c in criteria)
    return result(criteria=criteria, points=reached, max_points=most, notes=(), **changes)


def lab(*criteria):
    return rubric(
        scenarios={},
        criteria=tuple(
            {"id": c.id, "title": c.title, "points": c.max_points, "check": c.check} for c in criteria
        ),
    )


ONE = criterion("rate", Status.PASS, 10.0, 10.0, scenario="talker")
LOST = criterion(
    "rate", Status.FAIL, 0.0, 10.0, scenario="talker", message="5 Hz, not 10 Hz", hint="Rate(10)"
)
TWO = criterion("wrap", Status.FAIL, 0.0, 15.0, scenario="wraps", message="127 came twice")
HALF = criterion("wrap", Status.PARTIAL, 7.5, 15.0, scenario="wraps", message="once")


def shown(stream, *results: GradingResult, **options) -> str:
    screen = TerminalScreen("lab1", lab(ONE, TWO), stream, clock=lambda: NOON, **options)
    screen.begin(())
    for number, one in enumerate(results):
        if number:
            screen.begin(("src/talker.py",))
        saved = ("src/talker.py",) if number else ()
        screen.end(WatchedResult(result=one, code=ExitCode.PASSED), saved)
    return stream.getvalue()


def test_the_first_result_is_whole_and_later_ones_say_what_changed() -> None:
    text = shown(StringIO(), graded(ONE, TWO), graded(LOST, TWO))
    first, later = text.split(f"Watching lab1 {DASH} Ctrl-C ends it\n")
    assert "other criterion passed" in first
    assert later.splitlines() == [
        f"Watching lab1 {DASH} saved src/talker.py at 12:03:04: running everything … Ctrl-C ends it",
        "0 of 25 points, 25 lost",
        "now lost: rate 0/10",
        "",
        "To fix",
        f"✗ rate  {MINUS}10",
        "  5 Hz, not 10 Hz",
        "  fix: Rate(10)",
        "",
        f"✗ wrap  {MINUS}15",
        "  127 came twice",
        f"Watching lab1 {DASH} saved src/talker.py at 12:03:04 … Ctrl-C ends it",
    ]


def test_a_terminal_is_cleared_between_runs_without_its_scrollback() -> None:
    text = shown(Terminal(), graded(ONE, TWO), graded(LOST, TWO))
    assert text.count(CLEARED) == 1
    assert "\x1b[3J" not in text
    before, after = text.split(CLEARED)
    assert "running everything" in before
    assert "now lost: rate" in after


def test_a_log_has_no_escapes_and_each_message_on_one_line() -> None:
    screen = TerminalScreen("lab1", lab(ONE), stream := StringIO(), clock=lambda: NOON)
    names = tuple(f"src/a_rather_long_name_of_a_script_{number}.py" for number in range(9))
    screen.begin(names)
    screen.unchanged(names)
    screen.restart()
    assert "\x1b" not in stream.getvalue()
    begin, same, again = stream.getvalue().splitlines()
    assert begin.endswith("_2.py and 6 more at 12:03:04: running everything … Ctrl-C ends it")
    assert same.endswith("12:03:04: nothing has changed … Ctrl-C ends it")
    assert again == f"Watching lab1 {DASH} saved again: starting over"


def test_an_error_is_shown_and_the_next_result_is_compared_with_the_last_one_before_it() -> None:
    wrong = graded(
        ONE, TWO, status="error", error=ErrorInfo(kind="submission", message="no package", hint="fix it")
    )
    text = shown(StringIO(), graded(ONE, TWO), wrong, graded(ONE, HALF))
    assert "Could not be graded: no package\n    hint: fix it\n" in text
    assert "better: wrap 7.5/15\n" in text


def test_the_first_result_after_an_error_is_whole() -> None:
    wrong = graded(
        ONE, TWO, status="error", error=ErrorInfo(kind="submission", message="no package", hint="")
    )
    text = shown(Terminal(), wrong, graded(ONE, TWO))
    assert text.count(CLEARED) == 1
    assert "other criterion passed" in text.split(CLEARED)[1]


def test_files_alone_leave_the_rest_open() -> None:
    open_ = criterion("rate", Status.INCONCLUSIVE, 0.0, 10.0, scenario="talker", message="not run")
    text = shown(StringIO(), graded(open_, HALF), graded(open_, TWO), static=True)
    assert "worse: wrap 0/15\n" in text
    assert text.count("Nothing was run (--static): criteria worth 10 points are not decided yet.") == 2


def test_hostile_text_steers_nothing() -> None:
    words = f"{ESCAPES}{XML}{MARKDOWN}{RICH}\n::error::x ##[error]y"
    bad = criterion("rate", Status.FAIL, 0.0, 10.0, message=words, hint=words)
    wrong = graded(bad, error=ErrorInfo(kind="submission", message=words, hint=words))
    for stream in (StringIO(), Terminal()):
        screen = TerminalScreen("lab\x1b[31m", lab(bad), stream, clock=lambda: NOON)
        for saved, one in (((), graded(bad)), ((words,), graded(bad)), ((words,), wrong)):
            screen.begin(saved)
            screen.end(WatchedResult(result=one, code=ExitCode.PASSED), saved)
        text = stream.getvalue()
        assert "\x1b]0;" not in text
        assert "\x1b[31mred" not in text
        assert "\u202e" not in text
        assert "##[error]" not in text
        assert not any(row.lstrip().startswith("::error") for row in text.splitlines())


def test_an_encoding_without_dashes_gets_plain_ones() -> None:
    stream = TextIOWrapper(buffer := BytesIO(), encoding="ascii")
    TerminalScreen("lab1", lab(ONE), stream, clock=lambda: NOON).begin(())
    stream.flush()
    assert buffer.getvalue() == b"Watching lab1 - running everything ... Ctrl-C ends it\n"


def test_json_is_one_document_a_line_for_each_run() -> None:
    stream = TextIOWrapper(buffer := BytesIO(), encoding="utf-8")
    screen = JsonLines(stream)
    words = f"{ESCAPES}\n\u2028 ##[error]"
    screen.begin(())
    for message in ("fine", words):
        one = graded(criterion("rate", Status.FAIL, 0.0, 10.0, message=message))
        screen.end(WatchedResult(result=one, code=ExitCode.PASSED), ())
    screen.restart()
    rows = buffer.getvalue().decode().split("\n")
    assert [json.loads(row)["criteria"][0]["message"] for row in rows[:-1]] == ["fine", words]
    assert rows[-1] == ""


def test_what_is_better_and_what_is_worse() -> None:
    open_ = criterion("rate", Status.INCONCLUSIVE, 0.0, 10.0)
    advice = criterion("advice", Status.FAIL, 0.0, 0.0)

    def words(before, after) -> dict[str, list[str]]:
        return {name: [c.id for c in found] for name, found in compare(graded(before), graded(after)).items()}

    assert words(LOST, ONE) == {"now reached": ["rate"]}
    assert words(ONE, LOST) == {"now lost": ["rate"]}
    assert words(TWO, HALF) == {"better": ["wrap"]}
    assert words(HALF, TWO) == {"worse": ["wrap"]}
    assert words(ONE, open_) == {"no longer judged": ["rate"]}
    assert words(open_, open_) == {}
    assert compare(graded(ONE, TWO, advice), graded(ONE, TWO)) == {}


def test_rich_clears_as_we_say() -> None:
    console = Console(file=(stream := StringIO()), force_terminal=True)
    console.clear()
    assert stream.getvalue() == CLEARED
