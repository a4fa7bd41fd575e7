from __future__ import annotations

import hashlib
import os

import pytest

from grader.package import facts
from grader.package.facts import on_system, read_files, read_shebang
from tests.package.trees import NODE, make_package


@pytest.fixture
def none_found(monkeypatch):
    """A machine on which no program is."""
    monkeypatch.setattr(facts, "on_system", lambda _program: False)


@pytest.mark.usefixtures("none_found")
@pytest.mark.parametrize(
    ("text", "interpreter"),
    [
        ("#!/usr/bin/env python", "python"),
        ("#!/usr/bin/env python3", "python3"),
        ("#! /usr/bin/env  python3 ", "python3"),
        ("#!/bin/env python3", "python3"),
        ("#!/usr/bin/python", "python"),
        ("#!/usr/bin/python3", "python3"),
        ("#!/usr/local/bin/python", "python"),
        ("#!/usr/bin/python3 -u", "python3"),
        ("#!/usr/bin/env -S python3 -u", "python3"),
        ("#!/usr/bin/env -S PYTHONUNBUFFERED=1 python3 -u", "python3"),
        ("#!/usr/bin/env --split-string=python3 -u", "python3"),
    ],
)
def test_usable_shebangs_of_python(text, interpreter):
    shebang, fault, problem = read_shebang(text.encode() + b"\nimport rospy\n")
    assert (shebang.interpreter, shebang.found, shebang.crlf) == (interpreter, True, False)
    assert (fault, problem) == ("", "")
    assert shebang.text == text[2:].strip()


@pytest.mark.parametrize(
    ("data", "interpreter", "problem"),
    [
        (b"#!/usr/bin/env python2\n", "python2", "no `python2`"),
        (b"#!/usr/bin/env python2.7\n", "python2.7", "no `python2.7`"),
        (b"#!/usr/bin/python3.99\n", "python3.99", "no `/usr/bin/python3.99`"),
        (b"#!/home/ada/venv/bin/python3\n", "python3", "no `/home/ada/venv/bin/python3`"),
        (b"#!/usr/bin/env python3 -u\n", "python3", "keep only `python3`"),
        (b"#!/usr/bin/env\n", "", "given no program"),
        (b"#!\n", "", "nothing follows"),
        (b"#!", "", "nothing follows"),
        (b"#!python\n", "python", "not an absolute path"),
        (b"#!usr/bin/env python\n", "env", "not an absolute path"),
        (b"#!/usr/bin/env/ python\n", "python", "`/usr/bin/env/` ends with a slash"),
        (b"#!/usr/bin/python3/\n", "python3", "ends with a slash"),
    ],
)
@pytest.mark.usefixtures("none_found")
def test_interpreters_that_are_not_there(data, interpreter, problem):
    shebang, fault, said = read_shebang(data)
    assert (shebang.interpreter, shebang.found, fault) == (interpreter, False, "other")
    assert problem in said


def test_crlf_spoils_a_good_shebang():
    shebang, fault, problem = read_shebang(b"#!/usr/bin/env python3\r\nimport rospy\r\n")
    assert (shebang.text, shebang.interpreter, shebang.found, shebang.crlf) == (
        "/usr/bin/env python3",
        "python3",
        True,
        True,
    )
    assert fault == "line-end"
    assert "CRLF" in problem
    assert "python3\\r" in problem


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "empty-file: the file is empty"),
        (b"\n\n", "empty-file: the file is empty"),
        (b"\xef\xbb\xbf#!/usr/bin/env python\n", "byte-order-mark: an invisible byte order mark"),
        (b"\n#!/usr/bin/env python\n", "line 1 is blank and `#!` comes on line 2"),
        (b"# my node\n\n#!/usr/bin/env python\n", "line 1 is `# my node` and `#!` comes on line 3"),
        (b" #!/usr/bin/env python\n", "a space comes before"),
        (b"# !/usr/bin/env python\n", "not a shebang"),
        (b"#/usr/bin/env python\n", "not a shebang"),
        (b"!#/usr/bin/env python\n", "not a shebang"),
        (b"import rospy\n", "there is no `#!` line"),
        (b"\xef\xbb\xbfimport rospy\n", "there is no `#!` line"),
    ],
)
def test_why_there_is_no_shebang(data, problem):
    shebang, fault, said = read_shebang(data)
    assert shebang is None
    assert problem in f"{fault}: {said}"


def test_the_machine_is_asked_for_other_programs(monkeypatch):
    asked = []
    monkeypatch.setattr(facts, "on_system", lambda program: bool(asked.append(program)))
    read_shebang(b"#!/bin/bash\n")
    read_shebang(b"#!/usr/bin/env bash\n")
    assert asked == ["/bin/bash", "bash"]
    assert on_system("sh")
    assert on_system("/bin/sh")
    assert not on_system("no-such-program")


def files_of(tmp_path, files, **fields):
    return {e.file.path: e.file for e in read_files(make_package(tmp_path / "p", files, **fields))}


def test_every_file_with_mode_and_digest(tmp_path):
    files = files_of(
        tmp_path,
        {
            "scripts/a.py": NODE,
            "package.xml": "<x/>",
            "build/x": "",
            "devel/y": "",
            "src/install/z": "",
            ".git/config": "",
            "src/__pycache__/a.pyc": b"\0",
        },
        executable={"scripts/a.py": True},
    )
    assert list(files) == ["package.xml", "scripts/a.py"]
    script = files["scripts/a.py"]
    assert (script.executable, script.mode_source, script.size_bytes) == (True, "git", len(NODE))
    assert script.sha256 == hashlib.sha256(NODE.encode()).hexdigest()
    assert (script.python, script.shebang_problem, script.encoding) == (True, "", "utf-8")
    assert files["package.xml"].shebang_problem == ""


def test_modes_come_from_the_source_and_not_from_the_disk(tmp_path):
    files = files_of(tmp_path, {"a.py": NODE}, executable={"a.py": None}, mode_source="none")
    (tmp_path / "p" / "a.py").chmod(0o755)
    assert files["a.py"].executable is None
    package = make_package(tmp_path / "q", {"a.py": NODE}, mode_source="disk")
    (tmp_path / "q" / "late.py").write_text(NODE)
    (tmp_path / "q" / "late.py").chmod(0o755)
    assert [e.file.executable for e in read_files(package)] == [False, True]


@pytest.mark.parametrize(
    ("data", "facts"),
    [
        (b"", {"encoding": "utf-8", "crlf": False, "binary": False}),
        (b"x = 1\r\ny = 2\r\n", {"crlf": True}),
        (b"\xef\xbb\xbfx = 1\n", {"bom": True, "encoding": "utf-8-sig"}),
        ("# é\n".encode("latin-1"), {"encoding": "unknown-8bit"}),
        ("# -*- coding: latin-1 -*-\n# é\n".encode("latin-1"), {"encoding": "iso-8859-1"}),
        (b"# -*- coding: klingon -*-\n", {"encoding": "unknown-8bit"}),
        ("x = 1\n".encode("utf-16"), {"encoding": "utf-16", "bom": True, "binary": False}),
        (b"\x7fELF\0\r\n", {"binary": True, "crlf": False}),
        (b"x" * 5_000_000, {"size_bytes": 5_000_000, "encoding": "utf-8"}),
        ("é".encode() * 1_500_000, {"encoding": "utf-8"}),
    ],
)
def test_how_text_is_stored(tmp_path, data, facts):
    file = files_of(tmp_path, {"a.py": data})["a.py"]
    assert {key: getattr(file, key) for key in facts} == facts


def test_links_are_never_followed_out(tmp_path):
    package = make_package(tmp_path / "p", {"src/a.py": NODE}, executable={"src/a.py": True})
    (tmp_path / "secret.py").write_text("#!/bin/secret\n")
    links = {
        "in.py": "src/a.py",
        "folder": "src",
        "out.py": "../secret.py",
        "etc.py": "/etc/passwd",
        "loop.py": "loop.py",
        "gone.py": "nowhere",
        "through.py": "up/secret.py",
        "up": "..",
    }
    for name, target in links.items():
        (package.folder / name).symlink_to(target)
    files = {e.file.path: e.file for e in read_files(package)}
    assert {path: files[path].link for path in links} == links
    inside = files["in.py"]
    assert (inside.executable, inside.sha256, inside.link_problem) == (True, files["src/a.py"].sha256, "")
    problems = {path: files[path].link_problem for path in links if path != "in.py"}
    assert all(problems.values())
    assert "outside" in problems["etc.py"]
    assert "outside" in problems["through.py"]
    assert "back to itself" in problems["loop.py"]
    assert "does not exist" in problems["gone.py"]
    assert files["out.py"].shebang is None


def test_names_that_are_not_unicode_and_files_that_are_no_files(tmp_path):
    package = make_package(tmp_path / "p", {"a b/é.py": NODE})
    (package.folder / os.fsdecode(b"caf\xe9.py")).write_text(NODE)
    os.mkfifo(package.folder / "pipe.py")
    files = [e.file for e in read_files(package)]
    assert [f.path for f in files] == ["a b/é.py", "caf\\udce9.py"]
    assert all(f.model_dump_json() for f in files)
