"""Lines and YAML: CMake, its trace, reports, rubrics, SOURCE."""

from __future__ import annotations

import json

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars.common import encoded, joined, soup, words

CMAKE = (
    "project", "find_package", "catkin_package", "set", "list", "foreach", "endforeach", "if", "elseif", "else",
    "endif", "while", "endwhile", "function", "endfunction", "macro", "endmacro", "include", "add_subdirectory",
    "install", "catkin_install_python", "add_executable", "unset", "break", "return", "block", "endblock", "message",
)  # fmt: skip
CMAKE_ARGUMENTS = (
    "lab1", "catkin", "REQUIRED", "COMPONENTS", "rospy", "a", "b", "${a}", "${a}${a}", "${${a}}", "$ENV{HOME}", "${a",
    "APPEND", "IN", "LISTS", "ITEMS", "RANGE", "100", "PROGRAMS", "DESTINATION", "${CATKIN_PACKAGE_BIN_DESTINATION}",
    "src/talker.py", '"a;b;c"', "sub", "x.cmake", "CMakeLists.txt", "..", "FALSE", "[[x]]", "[==[", "#[[c]]", "# c\n",
    "$<TARGET_FILE:x>", "PARENT_SCOPE", "CACHE", "\\;", '"', "(", ")",
)  # fmt: skip
JSON_VALUES = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=6), st.just(10**400), st.just("\ud800")
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=6), inner, max_size=4)),
    max_leaves=8,
)  # fmt: skip
PYTHON_MESSAGES = (
    "invalid syntax", "invalid character '“' (U+201C)", "invalid non-printable character U+00A0", "U+FFFFFF",
    "expected ':'", "'(' was never closed", "unmatched ')'", "EOL while scanning string literal", "unexpected EOF",
    "Missing parentheses in call to 'print'", "inconsistent use of tabs", "invalid decimal literal", "{0}", "'break'",
    "closing parenthesis ')' does not match opening parenthesis '['", "duplicate argument 'x'", "(unicode error)",
)  # fmt: skip
PYTHON_LINES = (
    "print 'x'", "if x = 1:", "else if y:", "x = “a”", "\tfoo()", "def f()", "for i in x", "<<<<<<< HEAD", "a++",
    "x\u00a0= 1", "rosrun lab1 talker.py", "except A, b:", "while (((", "# comment", "`x`", "1l", "a <> b",
)  # fmt: skip


def cmake() -> SearchStrategy[bytes]:
    call = st.builds("{}({})".format, st.sampled_from(CMAKE), joined(words(*CMAKE_ARGUMENTS), " ", most=6))
    block = st.builds(
        "{0}({1})\n{2}\nend{0}()".format,
        st.sampled_from(("foreach", "if", "while", "function", "macro")),
        joined(st.sampled_from(CMAKE_ARGUMENTS), " ", most=8),
        joined(call, "\n", most=5),
    )
    nested = st.builds("foreach(a 1 2 3 4 5 6 7 8)\n{}\nendforeach()".format, block)
    return encoded(joined(st.one_of(call, call, block, nested), "\n", most=14))


def cmake_trace() -> SearchStrategy[bytes]:
    entry = st.fixed_dictionaries(
        {
            "cmd": words("project", "install", "Set"),
            "args": st.one_of(st.lists(words("a", "a;b", "\\;"), max_size=4), JSON_VALUES),
            "file": words(
                "/home/student/catkin_ws/src/lab1/CMakeLists.txt", "/x/lab1/CMakeLists.txt", "CMakeLists.txt"
            ),
            "line": st.one_of(st.integers(-2, 50), st.booleans(), st.just(1.5), st.just(10**400)),
        },
        optional={"version": st.one_of(JSON_VALUES, st.just({"major": 1})), "frame": JSON_VALUES},
    )
    return _json_lines(st.one_of(entry, entry, entry, JSON_VALUES))


def syntax_report() -> SearchStrategy[bytes]:
    fault = st.fixed_dictionaries(
        {
            "kind": words("SyntaxError", "IndentationError"),
            "line": st.one_of(st.none(), st.integers()),
            "column": st.one_of(st.none(), st.integers()),
            "message": words(*PYTHON_MESSAGES),
        },
        optional={"text": words(*PYTHON_LINES), "opened": st.integers(), "mixed": st.booleans()},
    )
    slip = st.fixed_dictionaries(
        {
            "line": st.integers(),
            "kind": words("not-called", "input", "no-clock", "misspelt"),
            "message": words("a call"),
        }
    )
    entry = st.fixed_dictionaries(
        {
            "file": words("src/talker.py", "src/\udce9.py"),
            "faults": st.lists(fault, max_size=2),
            "slips": st.lists(slip, max_size=2),
        }
    )
    return _json_lines(st.one_of(entry, entry, entry, JSON_VALUES))


def _json_lines(values: SearchStrategy[object]) -> SearchStrategy[bytes]:
    line = st.one_of(
        values.map(json.dumps), values.map(json.dumps), st.sampled_from(("", "{", "[" * 3000, "noise"))
    )
    return encoded(joined(line, "\n", most=6))


def python_causes() -> SearchStrategy[bytes]:
    line = joined(words(*PYTHON_LINES), most=4)
    return encoded(st.builds("{}\n{}".format, words(*PYTHON_MESSAGES), line))


def source_file() -> SearchStrategy[bytes]:
    heads = words(
        "#!/usr/bin/env python3\n", "#!/usr/bin/env -S python3 -u\r\n", "#!/usr/bin/python", "#!", "#! \n",
        "\n#!/bin/sh\n", " #!/usr/bin/env python\n", "#!python\n", "#!/usr/bin/env -S 'python\n",
        "#!/usr/bin/env A=b -i\n",
    )  # fmt: skip
    codings = words(
        "# -*- coding: utf-8 -*-\n", "# coding: latin-1\n", "# coding: nonsense\n", "# coding: rot13\n"
    )
    return encoded(st.builds("{}{}{}".format, heads, codings, words("import rospy\n", "print('é')\r\n")))


SCALARS = (
    "a", "1", "1.5", "true", "null", "~", "2020-01-01", "2020-13-45", "0x" + "f" * 5000, "1:59:59", ".inf", ".nan",
    "!!int x", "!!binary x", "!!set {a}", "!!python/name:os.system", "!degrees 90", "!!omap [a]", "!!str 1", "*a", "*b",
    "|\n  x", "'it''s'", '"\\ud800"', '"\\x41"', "@", "`", "%TAG", "=", "<<", "0o777", "1_000", "-", "?", "...",
)  # fmt: skip


def yaml_values() -> SearchStrategy[str]:
    """Flow style, so that it nests on one line; anchors, aliases, tags, merges."""
    anchors = st.sampled_from(("", "", "", "&a ", "&b ", "!!map ", "!!seq "))

    def around(inner: SearchStrategy[str]) -> SearchStrategy[str]:
        pair = st.builds(
            "{}: {}".format, st.one_of(words("a", "b", "name", "<<", "1", "[x]", "*a"), inner), inner
        )
        return st.one_of(
            st.builds("{}[{}]".format, anchors, joined(inner, ", ", most=4)),
            st.builds("{}{{{}}}".format, anchors, joined(pair, ", ", most=4)),
        )

    return st.recursive(words(*SCALARS), around, max_leaves=15)


def any_yaml() -> SearchStrategy[bytes]:
    line = st.builds("{}: {}".format, words("a", "name", "b/c", "/d", "~e", "&a f", "? g"), yaml_values())
    return encoded(joined(line, "\n", most=6))


def rubric() -> SearchStrategy[bytes]:
    return _document(
        'schema: grader.rubric/1\nid: x\ntitle: x\nversion: "1"\npackage: lab1\n',
        ("scenarios", "criteria", "checks", "digits", "pass_mark", "package", "late"),
        (
            "{talker: {title: t, start: [{name: talker, script: src/a.py}], until: {window_s: 3}}}",
            "[{id: a, title: t, points: 100, check: rate, scenario: talker, with: {topic: /c, rate_hz: 10}}]",
            "[{id: a, title: t, points: 1e400, check: topic-type, requires: [a]}]",
            "my_checks.py",
        ),
    )


def mutants() -> SearchStrategy[bytes]:
    return _document(
        "schema: grader.mutants/1\nrubric: leeds-comp3631-lab1\n",
        ("mutants", "rubric", "schema"),
        (
            "{a: {edits: [{operator: other-rate, at: {script: src/a.py}, with: {factor: 2}}], expect: {rate: fail}}}",
            "{b: {expect: {x: blocked}, edits: [{operator: crlf}, {replace: {file: a, old: b, new: c}}]}}",
        ),
    )


def timeline() -> SearchStrategy[bytes]:
    return _document(
        "",
        ("topics", "package", "runs", "console", "processes", "clock", "warp", "graph", "outcome"),
        (
            "[{topic: /c, type: std_msgs/String, rate_hz: 10, count: 5}]",
            "[{topic: /n, type: std_msgs/Int8, values: {from: 0, to: 127}, count: 300}]",
            "[{topic: /n, type: std_msgs/Int8, raw: ['00', zz]}]",
            "{name: lab1}",
            "[{at_s: 1, line: hello}]",
        ),
    )


def _document(head: str, keys: tuple[str, ...], values: tuple[str, ...]) -> SearchStrategy[bytes]:
    value = st.one_of(st.sampled_from(values), st.sampled_from(values), yaml_values())
    line = st.builds("{}: {}".format, st.sampled_from(keys), value)
    return encoded(st.builds(lambda text: head + text + "\n", joined(line, "\n", most=5)))


def source() -> SearchStrategy[bytes]:
    tokens = (
        "https://", "http://", "git@", "ssh://", "file://", "ext::", "github.com", "/", ":", "@", "user", "lab1",
        ".git", "main", "..", "~", "~root", "%2e%2e", "%00", "localhost", "[::1]", "?", "#", " ", "-", "C:",
        "--upload-pack=x",
    )  # fmt: skip
    return soup(tokens, most=10)


def git_refs() -> SearchStrategy[bytes]:
    hashes = st.sampled_from(("0" * 40, "a" * 40, "ab" * 32, "x", ""))
    names = words(
        "HEAD", "refs/heads/main", "refs/heads/x", "refs/tags/v1", "refs/tags/v1^{}", "refs/pull/1/head"
    )
    line = st.builds("{}\t{}".format, hashes, names)
    return encoded(st.builds("{}\n{}".format, words("main", "v1", "aaaaaaa", "", "-x"), joined(line, "\n")))
