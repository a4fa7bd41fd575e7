"""What every other output stands on: text made visible, JSON that may be printed, bounded lengths."""

from __future__ import annotations

import ast
import json
import re
import unicodedata
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fixtures.make import labs, rubric_of
from grader.model.verdict import FileCitation
from grader.report.text import code_parts, markdown, markdown_block
from grader.report.view import caret, commands_in, headline, hint_beside, steps, where_to_type, without_place
from grader.untrusted_text import (
    HIDDEN_CATEGORIES,
    clip,
    clipped,
    json_text,
    line,
    text_limit,
    visible,
    without_ci_commands,
)
from tests.report.hostile import result
from tests.report.nasty import ANY_TEXT, STEERING, TEXTS, TO_A_CI

FLOOD = "`/chatter` runs at about 5,500 Hz instead of 10 Hz; the loop does not sleep (src/talker.py, line 14)"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("write rate.sleep() in the loop", ["rate.sleep()"]),
        ("rate = rospy.Rate(10) before it", ["rate = rospy.Rate(10)"]),
        (
            "use rospy.Publisher('/chatter', String, queue_size=10)",
            ["rospy.Publisher('/chatter', String, queue_size=10)"],
        ),
        (
            'write <node pkg="lab1" type="talker.py" name="t"/>; then build',
            ['<node pkg="lab1" type="talker.py" name="t"/>'],
        ),
        ("set header.frame_id = 'odom' and x = 5, so it is", ["header.frame_id = 'odom'", "x = 5"]),
        ("/chatter carries std_msgs/String", ["/chatter", "std_msgs/String"]),
        ("a `:` of src/talker.py", [":", "src/talker.py"]),
        ("write #!/usr/bin/env python3 first", ["#!/usr/bin/env python3"]),
        ('write type="talker.py" instead of type="talker"', ['type="talker.py"', 'type="talker"']),
        ("write name= instead of nme=, or anonymous=True", ["name=", "nme=", "anonymous=True"]),
        (
            "chmod +x src/a.py src/b.py, then git add --chmod=+x src/a.py, commit and push",
            [
                "chmod +x src/a.py src/b.py",
                "git add --chmod=+x src/a.py",
            ],
        ),
        ("git mv Launch launch; then git add it", ["git mv Launch launch", "git add"]),
        (
            "mkdir -p scripts && mv src/a.py scripts/a.py if it is",
            ["mkdir -p scripts && mv src/a.py scripts/a.py"],
        ),
        ("roslaunch lab1 lab1.launch shows it; roslaunch does not find it", ["roslaunch lab1 lab1.launch"]),
        ("write $(find lab1)/launch/a.launch", ["$(find lab1)/launch/a.launch"]),
        ('publish "hello world %s" % rospy.get_time()', ['"hello world %s" % rospy.get_time()']),
        ("write <name>lab1</name> in package.xml", ["<name>lab1</name>", "package.xml"]),
        ("a message reads 'at world(2026) of <x>', not 'the time is <seconds>'", []),
        (
            '<maintainer email="a@b.uk">Your Name</maintainer>',
            ['<maintainer email="a@b.uk">Your Name</maintainer>'],
        ),
        ("5 of 10, and/or 3/4, e.g. ada@york.ac.uk: it's 'hello world <seconds>'", []),
        ("the test(s) of the first node; 2.5 s, i.e. late", []),
    ],
)
def test_code_in_a_sentence_is_found(text, code) -> None:
    parts = list(code_parts(text))
    assert [part for part, is_code in parts if is_code] == code
    assert "".join(part for part, _ in parts) == text.replace("`", "")


LOOKS_LIKE_CODE = re.compile(r"[=<>${}]|\w[(\[]|\bchmod\b|\bgit (add|mv|push|rm)\b|--\w|\w_\w|\+x")
ORDER = re.compile(
    r"(add|below|call|create|end|give|in|make|name|print|publish|put|remove|replace|run|set|take|use|write)\b"
)


def test_code_is_shown_as_code_in_what_checks_and_rubrics_advise() -> None:
    checks = Path(__file__).parents[2] / "grader" / "checks"
    advice = [text for path in checks.rglob("*.py") for text in _texts_of(path) if ORDER.match(text)]
    advice += [hint for lab in labs() for one in rubric_of(lab).rubric.criteria if (hint := one.hint)]
    assert len(advice) > 200
    plain = {text: "".join(part for part, is_code in code_parts(text) if not is_code) for text in advice}
    assert {text: rest for text, rest in plain.items() if LOOKS_LIKE_CODE.search(rest)} == {}
    assert markdown('write type="a.py"; then rate.sleep()') == 'write `type="a.py"`; then `rate.sleep()`'


def _texts_of(path: Path) -> Iterator[str]:
    """Yield each text of a source file with a name in place of each of its values; docstrings are none."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(value) for value in node.values}
            yield "".join(str(v.value) if isinstance(v, ast.Constant) else "x1" for v in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in skipped:
            yield re.sub(r"\{\w*\}", "x1", node.value)


@given(ANY_TEXT)
def test_no_text_is_lost_by_looking_for_code(text) -> None:
    assert "".join(part for part, _ in code_parts(text)).replace("`", "") == text.replace("`", "")


def test_a_long_message_says_the_verdict_first() -> None:
    assert headline(FLOOD) == (FLOOD, "")
    first, rest = headline(f"{FLOOD}; rosrun answers: nothing at all")
    assert (first, rest) == (FLOOD, "rosrun answers: nothing at all")
    long = "it ends with NameError: name 'mgs; not' is not defined " + "x" * 100
    assert headline(long) == (long, "")
    on_copy = "judged on a copy with src/a.py line 5 repaired"
    assert headline(f"{on_copy}: /a runs at 9 Hz") == ("/a runs at 9 Hz", on_copy)


def test_a_fix_with_several_steps_is_told_step_by_step() -> None:
    assert steps('line 2: write <a b="; c">') == ['line 2: write <a b="; c">']
    assert steps("src/a.py line 2: write f(1; 2); then add g()") == [
        "src/a.py line 2: write f(1; 2)",
        "add g()",
    ]
    assert len(steps("test_a[1]: f(1) is 2; test_b: g() is 3")) == 2, "each test that failed for itself"
    assert steps("it is late; grade it") == ["it is late; grade it"], "a reason is no step"


@pytest.mark.parametrize(
    ("hint", "shown"),
    [
        ("src/a.py line 3: write f()", "on line 3, write f()"),
        ("src/a.py line 3: indent line 3 by four spaces", "indent line 3 by four spaces"),
        ("write f()", "on line 3, write f()"),
        ("write f() after the loop", "write f() after the loop"),
        ("write f() in place of g()", "write f() in place of g()"),
        ("write the names one below the other", "write the names one below the other"),
        ('write pkg="lab1"', 'on line 3, write pkg="lab1"'),
        (
            "src/a.py line 3: write f(); src/b.py line 4: write g()",
            "on line 3, write f(); src/b.py line 4: write g()",
        ),
    ],
)
def test_a_fix_says_in_which_line(hint, shown) -> None:
    criterion = (
        result()
        .criteria[0]
        .model_copy(update={"hint": hint, "citations": (FileCitation(file="src/a.py", line=3),)})
    )
    assert hint_beside(criterion, "src/a.py:3") == shown


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("not printed; in src/a.py, line 3 prints `n`", "not printed; line 3 prints `n`"),
        ("the loop in src/a.py, line 3, never ends", "the loop on line 3, never ends"),
        ("`n` (src/a.py, line 3) is new", "`n` is new"),
        ("in src/b.py, line 3 prints `n`", "in src/b.py, line 3 prints `n`"),
    ],
)
def test_a_file_that_stands_beside_is_not_named_again(text, shown) -> None:
    assert without_place(text, "src/a.py:3") == shown


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("rostopic hz /chatter", [("rostopic hz /chatter", True)]),
        (
            "In two terminals: `rosrun a b` Then: `rosnode list`",
            [("In two terminals:", False), ("rosrun a b", True), ("Then:", False), ("rosnode list", True)],
        ),
        ("", []),
    ],
)
def test_commands_are_told_from_the_sentence_around_them(text, parts) -> None:
    assert list(commands_in(text)) == parts


@pytest.mark.parametrize(
    ("reproduce", "where"),
    [
        ("cat package.xml", "In the folder of your package:"),
        (
            "rosparam load config/a.yaml",
            "In the folder of your package, with roscore running:",
        ),
        ("rosrun lab1 talker.py", "With roscore running:"),
        ("rostopic hz /chatter", "With roscore and your nodes running:"),
        ("roslaunch lab1 lab1.launch", ""),
        ("cd ~/catkin_ws && catkin_make", ""),
        ("In two terminals: `rosrun a b` Then: `rosnode list`", ""),
    ],
)
def test_a_command_says_where_it_works(reproduce, where) -> None:
    assert where_to_type(reproduce) == where


@given(ANY_TEXT)
def test_nothing_that_steers_a_terminal_gets_through(text):
    assert not [c for c in visible(text) if unicodedata.category(c) in HIDDEN_CATEGORIES]
    assert not [c for c in visible(text, lines=True) if unicodedata.category(c) in HIDDEN_CATEGORIES - {"Cc"}]
    assert set(visible(text, lines=True)) & {chr(i) for i in (*range(32), *range(127, 160))} <= {"\n", "\t"}


@given(TEXTS)
def test_what_is_visible_stays_as_it_is_and_encodes(text):
    for lines in (False, True):
        once = visible(text, lines=lines)
        assert visible(once, lines=lines) == once
        assert once.encode().decode() == once
        assert STEERING.search(once) is None
        assert TO_A_CI.search(once) is None


@given(
    st.text(
        st.characters(categories=["L", "N", "P", "S"], exclude_characters="#:\u115f\u1160\u2800\u3164\uffa0")
    )
)
def test_printed_characters_are_not_touched(text):
    assert visible(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31m", "\\x1b[31m"),
        ("a\nb\r\t", "a\\nb\\r\\t"),
        ("\u202e", "\\u202e"),
        ("\x9b", "\\x9b"),
        ("\U000e0001", "\\U000e0001"),
        ("\ud800", "\\ud800"),
        ("\ufffe", "\\ufffe"),
        ("\u3164\u2800\U000e0100", "\\u3164\\u2800\\U000e0100"),
        ("Grüße, 10 Hz ± 5 % ✓", "Grüße, 10 Hz ± 5 % ✓"),
        ("a\u0300\u0301", "a\u0300\u0301"),
        ("a" + "\u0300" * 6, "a" + "\u0300" * 4 + "\\u0300\\u0300"),
        ("std::vector and ## [x]", "std::vector and ## [x]"),
        ("::error file=a::b", "\\x3a:error file=a::b"),
        ("\u3000 ::set-output::", "\u3000 \\x3a:set-output::"),
        ("x ##[error]", "x \\x23#[error]"),
        ("###vso[task.complete]", "#\\x23#vso[task.complete]"),
        ("##teamcity[x]", "\\x23#teamcity[x]"),
    ],
)
def test_written_out(text, shown):
    assert visible(text) == shown


def test_every_line_of_many_is_no_command():
    assert visible("a\n ::error::b\n\t::x", lines=True) == "a\n \\x3a:error::b\n\t\\x3a:x"
    assert without_ci_commands("\x1b[31m::error::x") == "\x1b[31m\\x3a:error::x"


def test_clip_says_how_much_is_gone():
    assert clip("abc", 3) == "abc"
    assert clip("abcdef", 3) == "abc… (3 more characters)"


@given(TEXTS, st.integers(1, 60))
def test_a_line_keeps_to_its_length_and_counts_what_it_leaves_out(text, limit):
    shown = line(text, limit)
    if len(visible(text)) <= limit:
        assert shown == visible(text)
    else:
        head, left = re.fullmatch(r"(.*)… \((\d+) more characters\)", shown, re.DOTALL).groups()
        assert len(head) <= limit
        assert head == visible(text[: len(text) - int(left)])


def test_a_line_of_what_must_be_written_out_is_no_longer_than_another():
    assert len(line("\U000e0001" * 10**6, 500)) < 540


def test_many_criteria_share_the_room():
    assert text_limit(0, 2000) == text_limit(30, 2000) == 2000
    assert text_limit(200, 2000) * 200 * 8 <= 600_000
    assert text_limit(10**6, 2000) == 200


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)


def _encodable(data):
    """What a file of JSON can hold: lone surrogates as the text of their escapes."""
    if isinstance(data, str):
        return data.encode("utf-8", "backslashreplace").decode()
    if isinstance(data, dict):
        return {_encodable(key): _encodable(item) for key, item in data.items()}
    return [_encodable(item) for item in data] if isinstance(data, list) else data


@given(JSON, st.booleans())
def test_json_reads_back_and_may_be_printed(data, ascii_only):
    text = json_text(data, ascii_only=ascii_only)
    assert json.loads(text.encode()) == _encodable(data)
    assert text.isascii() or not ascii_only
    assert STEERING.search(text) is None
    assert TO_A_CI.search(text) is None


def test_json_keeps_letters_and_has_no_number_that_json_lacks():
    assert json_text(["größer\x9b\u2028\U000e0001", float("nan"), float("-inf")]).split() == [
        "[",
        '"größer\\u009b\\u2028\\udb40\\udc01",',
        "null,",
        "null",
        "]",
    ]


def test_of_citations_only_the_first_are_kept():
    data = clipped({"citations": [{"file": "x" * 999}] * 50, "other": ["y" * 9] * 50}, 4)
    assert data["citations"] == [{"file": "x" * 120 + "… (879 more characters)"}] * 20
    assert data["other"] == ["yyyy… (5 more characters)"] * 50


@pytest.mark.parametrize(
    ("source", "column", "text", "below"),
    [
        ("        print text", 9, "        print text", "        ^"),
        ("\tcounter += 1", 2, "    counter += 1", "    ^"),
        ("x = 语(", 6, "x = 语(", "      ^"),
        ("for i in x", 11, "for i in x", "          ^"),
        ("a" * 100 + "`" + "b" * 100, 101, "…" + "a" * 30 + "`" + "b" * 29 + "…", " " * 31 + "^"),
    ],
)
def test_a_caret_stands_below_the_column(source, column, text, below):
    assert caret(FileCitation(file="talker.py", line=3, column=column, source=source)) == (text, below)


@given(TEXTS, st.integers(-2, 400))
def test_a_caret_shows_nothing_that_steers(source, column):
    shown = caret(FileCitation(file="talker.py", line=3, column=column, source=source))
    assert shown is None or not any(STEERING.search(row) or "\n" in row for row in shown)


def test_carets_stand_below_all_that_is_meant():
    line = FileCitation(file="talker.py", line=3, source='    print("I heard" + data.data)')
    assert caret(line) == ('    print("I heard" + data.data)', "    " + "^" * 28)
    part = line.model_copy(update={"column": 11, "end_column": 32})
    assert caret(part) == ('    print("I heard" + data.data)', " " * 10 + "^" * 21)
    assert caret(FileCitation(file="talker.py", line=3, column=3)) is None


@given(TEXTS)
def test_no_text_leaves_a_block_of_code(text):
    first, *rows, last = markdown_block(("before", text)).split("\n")
    assert rows == ["before", visible(text)]
    assert first == last
    assert first not in "".join(rows)
