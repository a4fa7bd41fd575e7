"""What is in the archive of the sources and in the wheel, and what is not."""

from __future__ import annotations

import email
import email.message
import re
import subprocess
import tarfile
from pathlib import PurePosixPath
from typing import get_args
from zipfile import ZipFile

import pytest

from grader import __version__
from grader.cli.commands.integrations import Shell
from grader.cli.completion import script
from scripts.man_page import man_page
from tests.packaging.making import ROOT, Built

FOLDERS = {
    "grader": "grader",
    "rubrics": "grader/_data/rubrics",
    "reference_solutions": "grader/_data/reference_solutions",
    "fixtures": "grader/_data/fixtures",
}
"""Of the repository, and where they lie in the wheel."""
SETUP = {"scripts/setup.sh": "grader/_data/setup.sh"}
"""What an autograder's image is made with."""
ROOT_FILES = {
    "CHANGELOG.md", "LICENSE", "README.md", "hatch_build.py", "pyproject.toml", "scripts/man_page.py"
}  # fmt: skip
MADE = {"PKG-INFO", ".gitignore"}
SHARED = {
    "share/man/man1/grader.1",
    "share/bash-completion/completions/grader",
    "share/zsh/site-functions/_grader",
    "share/fish/vendor_completions.d/grader.fish",
}


def ours() -> set[str]:
    """The repository's files below the folders that a wheel holds; those that nobody has added yet, too."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *FOLDERS]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
    return {
        name
        for name in files
        if not name.startswith("fixtures/") or re.fullmatch(r"fixtures/[^/]+\.yaml", name)
    }


def in_wheel(name: str) -> str:
    """Where a file of the repository lies in the wheel."""
    folder, _, rest = name.partition("/")
    return f"{FOLDERS[folder]}/{rest}"


@pytest.fixture(scope="module")
def wheel(packages: Built) -> ZipFile:
    return ZipFile(packages.wheel)


@pytest.fixture(scope="module")
def metadata(wheel: ZipFile) -> email.message.Message:
    return email.message_from_bytes(wheel.read(f"{_info()}/METADATA"))


def _info() -> str:
    return f"ros_lab_grader-{__version__}.dist-info"


def _shared() -> str:
    return f"ros_lab_grader-{__version__}.data/data/"


@pytest.mark.full
def test_the_wheel_holds_every_file_of_ours_and_no_other(wheel: ZipFile):
    names = {name for name in wheel.namelist() if name.startswith("grader/")}
    assert names == {in_wheel(name) for name in ours()} | set(SETUP.values())


@pytest.mark.parametrize(
    "name",
    [
        "grader/py.typed",
        "grader/arena/standins/turtlesim/turtlesim_node",
        "grader/package/lint/syntax.py",
        "grader/report/html/templates/report.html",
        "grader/report/html/style.css",
        "grader/report/class_page/class.js",
        "grader/_data/rubrics/leeds-comp3631-lab1.yaml",
        "grader/_data/fixtures/leeds-comp3631-lab1.yaml",
        "grader/_data/rubrics/examples/own-checks/my_checks.py",
        "grader/_data/reference_solutions/leeds-comp3631-lab1/lab1/src/talker.py",
    ],
)
def test_the_wheel_holds_what_commands_need(wheel: ZipFile, name):
    assert name in wheel.namelist()


def test_programs_are_executable_in_the_wheel(wheel: ZipFile):
    programs = [name for name in ours() if (ROOT / name).stat().st_mode & 0o100]
    modes = {name: wheel.getinfo(in_wheel(name)).external_attr >> 16 & 0o111 for name in programs}
    assert len(programs) > 5
    assert {name for name, mode in modes.items() if not mode} == set()


def test_the_wheel_holds_the_man_page_and_completion_of_this_parser(wheel: ZipFile):
    texts = {
        name.removeprefix(_shared()): wheel.read(name).decode()
        for name in wheel.namelist()
        if ".data/" in name
    }
    assert texts.keys() == SHARED
    assert texts["share/man/man1/grader.1"] == man_page()
    scripts = {text for name, text in texts.items() if "man1" not in name}
    assert scripts == {script(shell) for shell in get_args(Shell)}


def test_the_archive_holds_what_a_wheel_is_made_of_and_nothing_else(packages: Built):
    with tarfile.open(packages.sdist) as archive:
        names = {
            PurePosixPath(member.name).relative_to(f"ros_lab_grader-{__version__}") for member in archive
        }
    present = {name for name in ROOT_FILES if (ROOT / name).exists()}
    assert {str(name) for name in names} == ours() | SETUP.keys() | present | MADE


def test_the_licence_is_inside(wheel: ZipFile, metadata):
    assert metadata["License-Expression"] == "Apache-2.0"
    assert metadata["License-File"] == "LICENSE"
    assert wheel.read(f"{_info()}/licenses/LICENSE") == (ROOT / "LICENSE").read_bytes()


def test_the_version_has_one_source(metadata):
    written = [
        str(path.relative_to(ROOT))
        for path in (ROOT / "pyproject.toml", *ROOT.joinpath("grader").rglob("*.py"))
        if re.search(rf'["\']{re.escape(__version__)}["\']', path.read_text(encoding="utf-8"))
    ]
    assert metadata["Version"] == __version__
    assert written == ["grader/__init__.py"]


def test_the_description_has_no_links_into_the_repository(metadata):
    text = str(metadata.get_payload())
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert text.startswith("# ros-lab-grader")
    assert [link for link in links if not link.startswith("https://")] == []
    assert "![" not in text
    assert "docs/images" not in text


def test_it_says_which_pythons_and_extras(metadata):
    classifiers = metadata.get_all("Classifier")
    pythons = {c.rpartition(" ")[2] for c in classifiers if "Python :: 3." in c}
    assert metadata["Requires-Python"] == ">=3.10"
    assert pythons == {"3.10", "3.11", "3.12", "3.13", "3.14"}
    assert {"cluster", "review", "similarity"} <= set(metadata.get_all("Provides-Extra"))
