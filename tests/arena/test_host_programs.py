"""Programs around the sandbox are the machine's own, whatever the variables of whoever grades say."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.host_programs import HOST_ENV, find_host_program


@pytest.fixture(autouse=True)
def _asked_again():
    find_host_program.cache_clear()
    yield
    find_host_program.cache_clear()


def test_programs_are_not_found_by_the_path_of_whoever_grades(tmp_path, monkeypatch) -> None:
    for name in ("sh", "no-such-program-anywhere"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    found = find_host_program("sh")
    assert found is not None
    assert Path(found).parent != tmp_path
    assert find_host_program("no-such-program-anywhere") is None


def test_the_path_that_is_handed_on_has_no_folder_of_a_user() -> None:
    assert set(HOST_ENV) == {"PATH", "LANG"}
    folders = [Path(folder) for folder in HOST_ENV["PATH"].split(":")]
    assert all(folder.is_absolute() for folder in folders)
    assert not [folder for folder in folders if folder.exists() and folder.stat().st_uid != 0]
