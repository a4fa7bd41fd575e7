"""Package files that are sent to do harm: bounded time and memory, and a fault that says what is wrong."""

from __future__ import annotations

import os
import resource
import time
from contextlib import contextmanager

import pytest

from grader.errors import SubmissionError
from grader.intake.open import open_submission
from grader.package.cmake import read_trace
from grader.package.facts import read_package, read_shebang
from grader.package.launch import parse_launch, parse_launch_files
from grader.package.manifest import parse_manifest
from grader.package.python import REPORT_BYTES_MAX, check_syntax, read_syntax_report, reason_of
from tests.intake.samples import lab, write
from tests.package.trees import CMAKE, MANIFEST, NODE, make_package

GOOD = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, "src/a.py": NODE}
MEMORY_KB = 120_000


@contextmanager
def bounded(cpu_s=5.0):
    """CPU time of this process, and how much its memory has grown."""
    begin, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert time.process_time() - begin < cpu_s
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MEMORY_KB


def facts_of(tmp_path, files):
    with bounded():
        return read_package(make_package(tmp_path / "lab1", {**GOOD, **files}))


# XML

HEAD, TAIL = MANIFEST.split("  <depend>", 1)[0], "</package>"


@pytest.mark.parametrize(
    "inside",
    [
        "<a/>" * 150_000,
        "".join(f"<x{n}/>" for n in range(80_000)),
        "".join(f"\n<x{n}\n/>" for n in range(60_000)),
        "<a>" * 100_000 + "</a>" * 100_000,
    ],
)
def test_a_manifest_of_very_many_tags(inside):
    with bounded():
        manifest, fault = parse_manifest(f"{HEAD}{inside}{TAIL}".encode())
    assert manifest is None
    assert "2000 tags" in fault.cause


def test_tags_nested_too_deep():
    manifest, fault = parse_manifest(f"{HEAD}{'<a>' * 900}{'</a>' * 900}{TAIL}".encode())
    assert manifest is None
    assert "250 deep" in fault.cause


@pytest.mark.parametrize(
    "condition", ["(" * 100_000, "$" * 500_000, "1 == 1 and " * 50_000, "((((((((((1 == 1"]
)
def test_conditions_that_a_parser_could_work_on_for_ever(condition):
    text = HEAD.replace('format="2"', 'format="3"') + f'<depend condition="{condition}">x</depend>{TAIL}'
    with bounded():
        manifest, fault = parse_manifest(text.encode())
    assert manifest is None
    assert "condition" in fault.cause
    assert len(fault.message) < 1000


@pytest.mark.parametrize("letter", [" ", "a.", "\n ", "&#32;"])
@pytest.mark.parametrize("place", ["0.0.0", "The lab1 package", "ada@example.org", "MIT", "lab1"])
def test_texts_that_keep_patterns_busy(letter, place):
    text = MANIFEST.replace(place, f"x{letter * 100_000}x", 1)
    with bounded():
        manifest, fault = parse_manifest(text.encode())
    assert (manifest is None) != (fault is None)


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE l [<!ENTITY x SYSTEM "file:///etc/shadow">]><launch><node name="&x;"/></launch>',
        '<!DOCTYPE l [<!ENTITY x SYSTEM "file:///etc/shadow">]><launch>&x;</launch>',
        '<!DOCTYPE l [<!ENTITY % x SYSTEM "file:///etc/shadow"> %x;]><launch/>',
        '<!DOCTYPE l SYSTEM "file:///etc/shadow"><launch/>',
        '<launch xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="/etc/shadow" parse="text"/></launch>',
        '<?xml-stylesheet href="file:///etc/shadow"?><launch/>',
    ],
)
def test_nothing_of_the_machine_is_read_by_a_launch_file(text):
    assert "root:" not in parse_launch(text.encode(), "a.launch").model_dump_json()
    assert "root:" not in parse_launch(text.encode("utf-16"), "a.launch").model_dump_json()


def test_a_billion_entities_in_a_launch_file():
    entities = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))
    text = f'<!DOCTYPE l [<!ENTITY a0 "lol">{entities}]><launch><node name="&a11;"/></launch>'
    with bounded():
        assert parse_launch(text.encode(), "a.launch").fault is not None


# Launch files


def test_arguments_that_double():
    args = "".join(f'<arg name="a{n}" value="$(arg a{n - 1})$(arg a{n - 1})"/>' for n in range(1, 60))
    text = f'<launch><arg name="a0" value="x"/>{args}<node pkg="p" type="t" name="$(arg a59)"/></launch>'
    with bounded():
        launch = parse_launch(text.encode(), "a.launch")
    assert 1000 < len(launch.brings[0].name) < 10_000


NODE_TAG = '<node pkg="a" type="b" name="c"/>'


@pytest.mark.parametrize(
    "inside",
    [
        '<remap from="a" to="b"/>' * 990 + NODE_TAG * 990,
        '<param name="~a" value="b"/>' * 990 + NODE_TAG * 990,
        "".join(f'<arg name="a{n}" value="{n}"/>' for n in range(1990)),
        f'<group ns="{"x" * 400_000}">' + '<node name="a" ns="b"/>' * 1900 + "</group>",
        f'<node args="{"$(" * 200_000}" name="a"/>',
        "<node/>" * 120_000,
    ],
)
def test_launch_files_that_multiply(inside):
    with bounded():
        launch = parse_launch(f"<launch>{inside}</launch>".encode(), "a.launch")
    assert len(launch.brings) <= 2000
    assert len(launch.model_dump_json()) < 30_000_000


def test_included_files_that_multiply():
    texts = {"a.launch": b"<launch>" + b"<include file='$(find lab1)/b.launch'/>" * 49 + b"</launch>"}
    texts["b.launch"] = f"<launch>{NODE_TAG * 1900}</launch>".encode()
    with bounded():
        first, second = parse_launch_files(texts, ("lab1",))
    assert len(first.brings) < 11_000
    assert "more than a robot can start" in first.include_faults[0].message
    assert (len(second.brings), second.include_faults) == (1900, ())


@pytest.mark.full
def test_very_many_launch_files():
    texts = {f"{n}.launch": f"<launch>{NODE_TAG * 900}</launch>".encode() for n in range(300)}
    with bounded():
        files = parse_launch_files(texts, ("lab1",))
    assert len(files[0].brings) == 900
    assert files[-1].fault.kind == "TooLarge"


# CMake


@pytest.mark.full
@pytest.mark.parametrize(
    "text",
    [
        "".join(f"foreach(i{n} {' '.join('abcdefghijklmnop')})\n" for n in range(20)) + "endforeach()\n" * 20,
        "set(x aaaaaaaaaaaaaaaa)\n" + 'set(x "${x}${x}")\n' * 60,
        "set(x a)\n" + "list(APPEND x ${x} ${x})\n" * 60,
        "set(x " + "(" * 90_000 + ")" * 90_000 + ")\n",
        "set(x " + "a " * 90_000 + ")\n",
        'set(x "' + "${" * 90_000 + '")',
        '"\\' * 90_000,
        "#[" + "=" * 190_000,
        "#[=[" * 45_000,
        "a()\n" * 45_000,
        "if(a)\n" * 30_000,
        "set(x " + "a" * 200_001 + ")\n",
    ],
)
def test_cmake_files_that_multiply(text, tmp_path):
    cmake = facts_of(tmp_path, {"CMakeLists.txt": f"project(lab1)\n{text}"}).cmake
    assert len(cmake.model_dump_json()) < 10_000_000


@pytest.mark.full
def test_cmake_files_that_include_each_other(tmp_path):
    files = {f"{n}.cmake": f"include({n + 1}.cmake)\n" + "a()\n" * 20_000 for n in range(30)}
    cmake = facts_of(tmp_path, files | {"CMakeLists.txt": "project(lab1)\ninclude(0.cmake)\n"}).cmake
    assert cmake.calls[0].name == "project"
    assert len(cmake.calls) <= 5_000


def test_a_trace_of_a_gigabyte(tmp_path):
    line = b'{"cmd":"set","args":["' + b"a" * 900_000 + b'"],"file":"/w/lab1/CMakeLists.txt","line":1}\n'
    trace = tmp_path / "trace"
    trace.write_bytes(line * 30)
    os.truncate(trace, 1 << 30)
    with bounded():
        assert len(read_trace(trace, ("lab1",))) < 10


# Python and scripts


@pytest.mark.parametrize(
    "line",
    [
        "if " + "a" * 1_000_000,
        "except " + "a." * 500_000,
        '"' + "\\" * 1_000_000,
        "'\"" * 500_000,
        "print " + " " * 1_000_000,
        "1" * 1_000_000,
        " " * 1_000_000 + "else  if",
        "while " + "=" * 1_000_000,
        "\u2018" * 300_000,
    ],
)
@pytest.mark.parametrize(
    "message", ["invalid syntax", "x" * 1_000_000, "'break' outside loop", "invalid character"]
)
def test_lines_that_keep_patterns_busy(line, message):
    with bounded(1.0):
        assert len(reason_of(message, line, column=3).text) < 500


@pytest.mark.parametrize(
    "data", [b"\n" * 2_000_000, b"#!" + b" " * 2_000_000, b"#!/usr/bin/env -S" + b"'" * 100_000]
)
def test_first_lines_without_an_end(data):
    with bounded(1.0):
        assert len(read_shebang(data)[2]) < 1_000


@pytest.mark.parametrize("first", ["#" + " " * 16_000 + "x", "#" + "!" * 16_000, "# " * 8_000])
def test_first_lines_of_very_many_files(first):
    with bounded():
        found = {read_shebang(f"{first}\nimport rospy\n".encode())[0] for _ in range(500)}
    assert len(found) == 1


@pytest.mark.parametrize("text", ["a/" * 90_000 + "!", " " * 190_000 + "a/b !", "a" * 190_000 + "/"])
def test_a_cmake_file_that_is_nearly_a_path(text, tmp_path):
    facts = facts_of(tmp_path, {"CMakeLists.txt": text})
    assert "the path that a link should lead to" not in facts.cmake.fault.cause


@pytest.mark.parametrize("part", ["<!--", "<![CDATA[", "<?", "<!DOCTYPE[", "<!DOCTYPE"])
def test_text_of_another_encoding_that_looks_like_markup(part):
    """In UTF-16, these bytes are letters."""
    letters = (part + " " * (len(part) % 2)).encode().decode("utf-16-le") * 20_000
    text = f'<?xml version="1.0" encoding="UTF-16"?><launch><!-- {letters[:200_000]} --></launch>'
    with bounded():
        file = parse_launch(b"\xff\xfe" + text.encode("utf-16-le"), "launch/a.launch")
    assert (file.fault, file.nodes) == (None, ())


@pytest.mark.full
def test_remarks_on_python_files_without_end(tmp_path):
    """Each file has a hundred, as far as a thousand go."""
    line = "a." + "b" * 290 + "\n"
    files = [f"f{number}.py" for number in range(300)]
    for name in files:
        (tmp_path / name).write_text(line * 100)
    with bounded():
        report = check_syntax(tmp_path, files, timeout_s=60)
    assert (len(report.slips), len(report.checked), report.faults) == (1000, 300, {})


@pytest.mark.full
def test_a_report_on_syntax_that_has_no_end():
    entry = b'{"file": "a.py", "faults": [], "slips": []}\n'
    with bounded():
        report = read_syntax_report(entry * (2 * REPORT_BYTES_MAX // len(entry)))
    assert len(report.checked) == REPORT_BYTES_MAX // len(entry)


def test_files_that_python_has_no_time_for_are_named(tmp_path):
    files = [f"f{number}.py" for number in range(5000)]
    with bounded():
        report = check_syntax(tmp_path, files, timeout_s=0)
    assert {fault.kind for fault in report.faults.values()} == {"NotChecked"}
    assert len(report.faults) == 5000


def test_hostile_source_does_not_stop_the_others(tmp_path):
    (tmp_path / "bomb.py").write_text("x = " + "-" * 900_000 + "1\n")
    (tmp_path / "chain.py").write_text("x = a" + ".a" * 400_000 + "\n")
    (tmp_path / "good.py").write_text("x = 1\n")
    (tmp_path / "large.py").write_bytes(b"(" * 2_000_001)
    report = check_syntax(tmp_path, ["bomb.py", "chain.py", "good.py", "large.py", "gone.py"])
    assert set(report.checked) == {"bomb.py", "chain.py", "good.py", "large.py", "gone.py"}
    assert report.faults["bomb.py"].kind in {"MemoryError", "RecursionError", "PythonCrash", "SyntaxError"}
    assert "good.py" not in report.faults
    assert report.faults["gone.py"].kind == "FileNotFoundError"


@pytest.mark.full
def test_a_crash_is_laid_to_its_file(tmp_path, monkeypatch):
    monkeypatch.setattr("grader.package.python.CHECK", "tests.package.crashing:check_all")
    report = check_syntax(tmp_path, ["a", "crash", "b", "slow", "c"], timeout_s=10.0)
    assert {path: fault.kind for path, fault in report.faults.items()} == {
        "crash": "PythonCrash",
        "slow": "NotChecked",
        "c": "NotChecked",
    }


def test_python_files_that_crash_or_never_end(tmp_path):
    files = {
        "src/brackets.py": "(" * 10_000 + ")" * 10_000,
        "src/zeros.py": b"x = 1\0\n",
        "src/line.py": b"x = '" + b"a" * 3_000_000 + b"'",
    }
    facts = facts_of(tmp_path, files)
    assert facts.file("src/brackets.py").python_fault is not None
    assert "null bytes" in facts.file("src/zeros.py").python_fault.cause
    assert facts.file("src/line.py").python_fault is None
    assert facts.file("src/a.py").python_fault is None


def test_links_that_no_system_follows(tmp_path):
    package = make_package(tmp_path / "lab1", dict(GOOD))
    for number in range(1500):
        (package.folder / f"link{number}").symlink_to(f"link{number + 1}")
    (package.folder / "link1500").symlink_to("src/a.py")
    (package.folder / "package.xml").unlink()
    (package.folder / "package.xml").symlink_to("link0")
    with bounded():
        facts = read_package(package)
        submission = open_submission(str(tmp_path / "lab1"), package="lab1", workdir=tmp_path / "work")
    assert facts.manifest_fault.kind == "LinkLoop"
    assert "leads back to itself" in facts.file("link0").link_problem
    assert facts.file("link1490").link_problem == ""
    assert "no name can be read" in submission.hints[0]


# Files that are none, or too large, or closed

MATTER = ("package.xml", "CMakeLists.txt", "src/a.py", "launch/a.launch")


@pytest.mark.full
@pytest.mark.parametrize("name", MATTER)
@pytest.mark.parametrize("what", ["folder", "pipe", "zero", "shadow", "terabyte", "binary"])
def test_what_takes_the_place_of_a_file(name, what, tmp_path):
    files = {f"lab1/{path}": text for path, text in GOOD.items()} | {"lab1/launch/a.launch": "<launch/>"}
    root = write(tmp_path / "ws", files)
    place = root / "lab1" / name
    place.unlink()
    if what == "folder":
        (place / "x").mkdir(parents=True)
    elif what == "pipe":
        os.mkfifo(place)
    elif what in {"zero", "shadow"}:
        place.symlink_to({"zero": "/dev/zero", "shadow": "/etc/shadow"}[what])
    elif what == "terabyte":
        place.touch()
        os.truncate(place, 1 << 40)
    else:
        place.write_bytes(bytes(range(256)) * 100)
    with bounded():
        submission = open_submission(str(root), package="lab1", workdir=tmp_path / "work")
        facts = read_package(submission.package, hints=submission.hints)
    assert "root:" not in facts.model_dump_json()
    assert facts.file("src/a.py" if name != "src/a.py" else "package.xml").sha256
    if name == "package.xml":
        assert facts.manifest_fault is not None
    elif name == "CMakeLists.txt":
        assert facts.cmake is None or facts.cmake.fault is not None


@pytest.mark.parametrize("name", ["data/map.bin", "old.bag", "README"])
def test_a_terabyte_beside_the_rest_is_left_out(name, tmp_path):
    root = write(
        tmp_path / "ws", {f"lab1/{path}": text for path, text in GOOD.items()} | {f"lab1/{name}": ""}
    )
    os.truncate(root / "lab1" / name, 1 << 40)
    with bounded():
        submission = open_submission(str(root), package="lab1", workdir=tmp_path / "work")
        facts = read_package(submission.package, hints=submission.hints)
    assert submission.hints == (
        f"too large, so left out: {name} (keep recordings and data out of the package)",
    )
    assert submission.package.left_out == {name}
    assert (facts.file(name).size_bytes, facts.file(name).sha256) == (1 << 40, "")
    assert facts.manifest is not None


def test_a_hundred_thousand_files_beside_the_package_cost_it_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("grader.intake.tree.MAX_IN_FOLDER", 300)
    root = write(tmp_path / "ws", lab() | {f"junk/{n}": "" for n in range(400)})
    assert open_submission(str(root), package="lab1", workdir=tmp_path / "work").package.path == "lab1"
    (root / "junk").rename(root / "lab1/junk")
    with pytest.raises(SubmissionError, match="junk holds more than 300 files"):
        open_submission(str(root), package="lab1", workdir=tmp_path / "work")


def test_a_neighbour_that_is_broken_in_every_way_costs_nothing(tmp_path):
    root = write(tmp_path / "ws", lab() | {"other/package.xml": "<", "third/package.xml": "x" * 2_000_000})
    os.mkfifo(root / "other/CMakeLists.txt")
    (root / "fourth").mkdir()
    os.mkfifo(root / "fourth/package.xml")
    (root / "fifth").mkdir()
    (root / "fifth/package.xml").symlink_to("package.xml")
    (root / "sixth/package.xml").mkdir(parents=True)
    os.truncate(root / "other/package.xml", 1 << 40)
    with bounded():
        submission = open_submission(str(root), package="lab1", workdir=tmp_path / "work")
    assert (submission.package.path, submission.hints) == ("lab1", ())


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else")
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("data/map.png", "left out"),
        (".cache/x", "left out"),
        ("src/a.py", "refused"),
        ("package.xml", "refused"),
    ],
)
def test_files_that_an_ordinary_user_may_not_read(name, says, tmp_path):
    files = {f"lab1/{path}": text for path, text in GOOD.items()} | {
        "lab1/data/map.png": "x",
        "lab1/.cache/x": "x",
    }
    root = write(tmp_path / "ws", files)
    (root / "lab1" / name).chmod(0)
    result = tmp_path / "result"
    tmp_path.chmod(0o777)
    for folder in tmp_path.parents[:4]:  # pytest keeps them to itself
        if folder.name.startswith(("pytest-", "popen-")):
            folder.chmod(0o755)
    child = os.fork()
    if child == 0:
        try:
            os.setresuid(65534, 65534, 65534)
            result.write_text(_opened_by_somebody(root, tmp_path / "work"))
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    if not result.exists():
        pytest.skip("this folder is closed to other users")
    assert result.read_text() == says


def _opened_by_somebody(root, workdir):
    """What the reader of a submission says of it, in a word."""
    try:
        hints = open_submission(str(root), package="lab1", workdir=workdir).hints
    except SubmissionError as error:
        return "refused" if "Permission denied" in error.message else error.message
    return "left out" if any("not readable here" in hint for hint in hints) else str(hints)


SCRIPT = "import rospy\nrospy.init_node('x')\npub = rospy.Publisher('c', String, queue_size=1)\n"


LINES = [
    "".join(f"def f{number}():\n    pub.publish(x)\n" for number in range(400)),
    SCRIPT + "while a:\n    pub.publish(b)\n" * 400,
    SCRIPT + "rospy.spin()\n" * 2000,
    SCRIPT + "class A:\n    def f(self):\n" + "".join(f"        print(self.a{n}x)\n" for n in range(2000)),
]
MORE_LINES = [
    SCRIPT + "while not rospy.is_shutdown():\n" + "    if a: pub.publish(b)\n" * 400,
    SCRIPT + "while not rospy.is_shutdown():\n" + "    a = a + 1\n    pub.publish(a)\n" * 400,
    "".join(f"def f{n}():\n    print(d{n})\nrospy.Subscriber('a', String, f{n})\n" for n in range(1000)),
    "for r in m.ranges:\n"
    + "    if r < 1:\n        v.x = 1\n    else:\n        v.x = 2\n" * 1200
    + "    p.publish(v)\n",
    "".join(f"q{n}.z = sin(a)\nq{n}.w = cos(a)\n" for n in range(2000)),
    "while a:\n" + "    for i in b:\n        p.publish(i)\n" * 1500,
    SCRIPT + "while a < 3:\n    t.angular.z = 1\n    pub.publish(t)\nrospy.spin()\n" * 1200,
    SCRIPT + "rospy.spin()\ndef f():\n" + "    if a:\n        g()\n" * 4000,
    SCRIPT
    + "".join(f"def f{n}(m):\n    global x{n}\n    x{n} = m.data\n" for n in range(1000))
    + "".join(f"rospy.Subscriber('t{n}', String, f{n})\n" for n in range(1000))
    + "def f0(m):\n    global x0\n    x0 = m.data\n"
    + "    y = x0 + z\n" * 2000,
    SCRIPT
    + "def heard(m):\n"
    + "".join(f"    x{n} = m.data\n    print(x{n})\n" for n in range(700))
    + "".join(f"rospy.Subscriber('t{n}', String, heard)\n" for n in range(700)),
    "def f(m):\n    r = m.ranges[0]\n" + "    if r == float('inf'): return 0\n    return r\n" * 1500,
    SCRIPT + "def f(m):\n" + "    a = A()\n    a.x = 1\n    p.publish(a)\n" * 1500,
]
"""These take longer."""


@pytest.mark.parametrize(
    "text", [*LINES, *(pytest.param(text, marks=pytest.mark.full) for text in MORE_LINES)]
)
def test_lines_that_all_have_to_do_with_each_other(tmp_path, text) -> None:
    """Where each is compared with all the others, these took up to twenty seconds."""
    facts = facts_of(tmp_path, {"src/a.py": text})
    assert any(slip.file == "src/a.py" for slip in facts.slips)
