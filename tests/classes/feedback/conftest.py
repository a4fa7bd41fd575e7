"""One class for all tests of this folder, copied for each: it is judged once."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.classes.feedback.a_class import Student, made, publish

STUDENTS = (
    Student(
        id="ada",
        name="Ada Lovelace",
        where="Ada Lovelace_101_assignsubmission_file_",
        extra={"Email": "ada@x.example"},
    ),
    Student(id="bob", name="Bob", where="bobby_LATE_12_345_lab1.zip", extra={"Email": "bob@x.example"}),
    Student(
        id="cem",
        where="cem_13_346_lab1.tar.gz",
        extra={"Moodle id": "103", "Email": "c@x.example, d@x.example"},
    ),
    Student(id="eve", open=True),
    Student(id="fay", error="there is no package"),
    Student(id="gus", missing=True),
)


@pytest.fixture(scope="session")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("judged") / "results", *STUDENTS)


@pytest.fixture
def out(judged: Path, tmp_path: Path) -> Path:
    return shutil.copytree(judged, tmp_path / "results")


@pytest.fixture(scope="session")
def _published(judged: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = shutil.copytree(judged, tmp_path_factory.mktemp("published") / "results")
    publish(out)
    return out


@pytest.fixture
def published(_published: Path, tmp_path: Path) -> Path:
    """The class with four published results and two drafts."""
    return shutil.copytree(_published, tmp_path / "results")
