"""What students upload, and what is known of its file modes: never a fault of theirs that a platform dropped them."""

from __future__ import annotations

import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from grader.errors import SubmissionError
from grader.intake.open import open_submission
from grader.integrations.autograde import find_upload
from grader.model.submission import Submission

MANIFEST = "<package format='2'><name>lab1</name></package>"
FILES = {"lab1/package.xml": 0o644, "lab1/src/talker.py": 0o755, "lab1/src/listener.py": 0o644}
TALKER, LISTENER = "src/talker.py", "src/listener.py"


def put(folder: Path, modes: Mapping[str, int]) -> Path:
    for path, mode in modes.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(MANIFEST if path.endswith(".xml") else "#!/usr/bin/env python3\n")
        file.chmod(mode)
    return folder


def opened(folder: Path, tmp_path: Path, modes: str = "lost") -> Submission:
    return open_submission(find_upload(folder, modes), package="lab1", workdir=tmp_path / "work")


def bits(submission: Submission) -> tuple[bool | None, bool | None]:
    return submission.package.executable[TALKER], submission.package.executable[LISTENER]


@pytest.fixture
def handed_in(tmp_path) -> Path:
    folder = tmp_path / "submission"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("mode", [0o644, 0o777, 0o600])
def test_where_all_files_have_one_mode_nobody_knows_it(handed_in, tmp_path, mode) -> None:
    put(handed_in, dict.fromkeys(FILES, mode))
    assert bits(opened(handed_in, tmp_path)) == (None, None)


def test_where_they_differ_the_disk_is_believed(handed_in, tmp_path) -> None:
    put(handed_in, FILES)
    assert bits(opened(handed_in, tmp_path)) == (True, False)


def test_what_is_granted_is_granted_and_said(handed_in, tmp_path) -> None:
    put(handed_in, dict.fromkeys(FILES, 0o644))
    submission = opened(handed_in, tmp_path, "granted")
    assert bits(submission) == (True, True)
    assert any("no file modes" in hint for hint in submission.hints)


def test_what_is_known_is_not_granted_otherwise(handed_in, tmp_path) -> None:
    put(handed_in, FILES)
    assert bits(opened(handed_in, tmp_path, "granted")) == (True, False)


def test_an_archive_among_uploads_brings_its_own_modes(handed_in, tmp_path) -> None:
    put(tmp_path / "mine", FILES)
    with tarfile.open(handed_in / "lab1.tar.gz", "w:gz") as archive:
        archive.add(tmp_path / "mine" / "lab1", "lab1")
    (handed_in / ".DS_Store").touch()
    submission = opened(handed_in, tmp_path)
    assert bits(submission) == (True, False)
    assert submission.source == "lab1.tar.gz"


@pytest.mark.parametrize(("modes", "expected"), [("lost", None), ("granted", True)])
def test_a_zip_of_windows_carries_none(handed_in, tmp_path, modes, expected) -> None:
    with zipfile.ZipFile(handed_in / "lab1.zip", "w") as archive:
        for path in FILES:
            about = zipfile.ZipInfo(path)
            about.create_system = 0
            archive.writestr(about, MANIFEST if path.endswith(".xml") else "#!/usr/bin/env python3\n")
    assert bits(opened(handed_in, tmp_path, modes)) == (expected, expected)


def test_an_archive_beside_a_package_is_the_students_own_business(handed_in, tmp_path) -> None:
    put(handed_in, dict.fromkeys(FILES, 0o644))
    (handed_in / "old.zip").write_bytes(b"not a zip")
    assert opened(handed_in, tmp_path).package.name == "lab1"


def test_a_link_to_an_archive_is_not_followed(handed_in, tmp_path) -> None:
    (tmp_path / "solution.zip").write_bytes(b"PK")
    (handed_in / "lab1.zip").symlink_to(tmp_path / "solution.zip")
    assert find_upload(handed_in, "lost").kind == "folder"


def test_files_of_a_package_without_its_folder_are_the_package(handed_in, tmp_path) -> None:
    put(handed_in, {path.removeprefix("lab1/"): 0o644 for path in FILES})
    assert opened(handed_in, tmp_path).package.path == "."


def test_nothing_handed_in_is_said(handed_in) -> None:
    (handed_in / "__MACOSX").mkdir()
    with pytest.raises(SubmissionError, match="nothing was submitted"):
        find_upload(handed_in, "lost")
    with pytest.raises(SubmissionError, match="cannot be read"):
        find_upload(handed_in / "none", "lost")
