"""`grader check` with nothing to configure: in every folder in which a student may stand."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import pytest

from grader.cli.select_rubric import choose_all, find
from grader.errors import UsageError
from tests.student.conftest import git, write_package

SOLUTIONS = Path(__file__).resolve().parents[2] / "reference_solutions"
LABS = (
    "eyantra-ros-basics",
    "leeds-comp3631-lab1",
    "mcr2-basic-comms",
    "sheffield-com2009-week1",
    "york-ele00118m-lab7",
)


def _workspace(lab: str, tmp_path: Path) -> tuple[Path, Path]:
    """A built workspace with a lab's reference solution: the workspace, and the package in it."""
    workspace = tmp_path / "catkin_ws"
    shutil.copytree(SOLUTIONS / lab, workspace / "src")
    package = next((workspace / "src").rglob("package.xml")).parent
    (workspace / ".catkin_workspace").touch()
    for made in ("build", "devel/lib", "install/share"):
        (workspace / made).mkdir(parents=True)
    shutil.copytree(package, workspace / "install" / "share" / package.name)
    shutil.copytree(package, workspace / "build" / package.name)
    (workspace / "build" / "CMakeCache.txt").touch()
    git(workspace / "src", "init", "-q")
    return workspace, package


@pytest.mark.full
@pytest.mark.parametrize("lab", LABS)
def test_every_folder_of_a_workspace_leads_to_the_package(lab: str, tmp_path: Path) -> None:
    workspace, package = _workspace(lab, tmp_path)
    (workspace / "docs").mkdir()
    (workspace / "src" / "empty").mkdir()
    folders = [workspace, *(p for p in workspace.rglob("*") if p.is_dir() and p.parent.name != "objects")]
    for folder in folders:
        (chosen,) = choose_all(folder, None)
        assert (chosen.rubric.rubric.id, chosen.package and chosen.package.resolve()) == (lab, package), (
            folder
        )
        assert f" against {lab}" in chosen.words


@pytest.mark.full
@pytest.mark.parametrize("lab", LABS)
def test_a_file_stands_for_its_package(lab: str, tmp_path: Path) -> None:
    _, package = _workspace(lab, tmp_path)
    for file in (p for p in package.rglob("*") if p.is_file()):
        (chosen,) = choose_all(file, None)
        assert (chosen.rubric.rubric.id, Path(chosen.source)) == (lab, package)


def test_what_a_build_or_git_keeps_is_left_and_that_is_said(tmp_path: Path, monkeypatch) -> None:
    workspace, _ = _workspace("leeds-comp3631-lab1", tmp_path)
    monkeypatch.chdir(workspace)
    (chosen,) = choose_all(Path("install/share/lab1"), None)
    assert chosen.words.endswith("(install/ was made by a build)")
    (chosen,) = choose_all(Path("src/.git"), None)
    assert chosen.words.endswith("(this folder belongs to git)")


def test_a_package_may_have_a_folder_named_build(tmp_path: Path) -> None:
    package = write_package(tmp_path / "lab1")
    (package / "build").mkdir()
    (chosen,) = choose_all(package / "build", None)
    assert chosen.package == package


def test_packages_of_several_labs_are_all_checked(tmp_path: Path) -> None:
    for name in ("lab1", "basic_comms", "my_helpers"):
        write_package(tmp_path / "repository" / name, name)
    chosen = choose_all(tmp_path / "repository", None)
    assert sorted(one.rubric.rubric.id for one in chosen) == ["leeds-comp3631-lab1", "mcr2-basic-comms"]


@pytest.mark.parametrize("name", ["Lab1", "LAB1"])
def test_another_case_is_the_same_lab(name: str, tmp_path: Path) -> None:
    (chosen,) = choose_all(write_package(tmp_path / "work", name), None)
    assert chosen.rubric.rubric.id == "leeds-comp3631-lab1"


@pytest.mark.parametrize("folder", ["lab1", "lab1-main"])
def test_a_folder_tells_where_the_manifest_does_not(folder: str, tmp_path: Path) -> None:
    (chosen,) = choose_all(write_package(tmp_path / folder, "beginner_tutorials"), None)
    assert chosen.words.endswith(
        "the lab that its folder is named after (its package.xml says beginner_tutorials)"
    )
    shutil.rmtree(tmp_path / folder)
    (write_package(tmp_path / folder) / "package.xml").unlink()
    (chosen,) = choose_all(tmp_path / folder, None)
    assert chosen.words.endswith("the lab that its folder is named after (it has no package.xml)")


@pytest.mark.parametrize("name", ["lab_1", "lab-1", "labb1", "LAB_1"])
@pytest.mark.parametrize("asked", [False, True])
def test_a_slip_of_the_only_name_chooses_the_lab(name: str, asked: bool, tmp_path: Path) -> None:
    write_package(tmp_path / "work", name)
    (chosen,) = choose_all(tmp_path / "work", None, name if asked else "")
    assert chosen.rubric.rubric.id == "leeds-comp3631-lab1"
    assert chosen.words.endswith("the lab for a package named lab1: did you mean that name?")


def test_of_two_names_none_is_taken_for_a_slip_unless_it_is_asked_for(tmp_path: Path) -> None:
    write_package(tmp_path / "one", "lab_1")
    write_package(tmp_path / "two", "basic_coms")
    with pytest.raises(UsageError, match="no lab is for the package"):
        choose_all(tmp_path, None)
    (chosen,) = choose_all(tmp_path, None, "basic_coms")
    assert chosen.rubric.rubric.id == "mcr2-basic-comms"


@pytest.mark.parametrize("name", ["lab1_ada", "my_lab1", "comp3631_lab1"])
def test_a_near_miss_names_the_lab(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        choose_all(write_package(tmp_path / "work", name), None)
    assert caught.value.message == f"no lab is for the package {name}"
    assert caught.value.hint.startswith(
        "leeds-comp3631-lab1 is for a package named lab1: write <name>lab1</name> in"
    )
    assert "--rubric leeds-comp3631-lab1 --package NAME" in caught.value.hint


def test_without_a_near_miss_every_lab_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        choose_all(write_package(tmp_path / "work", "autonomous_vacuum"), None)
    assert all(lab in caught.value.hint for lab in LABS)
    assert "--rubric FILE" in caught.value.hint


@pytest.mark.parametrize("kind", ["empty", "no package", "hidden", "file", "missing"])
def test_what_is_no_package_is_said_to_be_none(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    if kind == "no package":
        (folder / "notes.txt").write_text("hello")
    if kind == "hidden":
        (write_package(folder / "lab1") / "CATKIN_IGNORE").touch()
    asked = {"file": tmp_path / "notes.txt", "missing": tmp_path / "nowhere"}.get(kind, folder)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(UsageError) as caught:
        choose_all(asked, None)
    said = {"hidden": "is hidden from catkin by", "file": "is a file", "missing": "does not exist"}
    assert said.get(kind, "there is no package.xml in") in caught.value.message
    assert caught.value.hint


@pytest.mark.full
@pytest.mark.parametrize("place", ["/", "~"])
def test_a_whole_disk_is_not_walked(place: str) -> None:
    begun = time.process_time()
    find(Path(os.path.expanduser(place)))  # noqa: PTH111 - the home that a shell means
    assert time.process_time() - begun < 3


@pytest.mark.full
def test_a_folder_of_a_hundred_thousand_files(tmp_path: Path) -> None:
    package = write_package(tmp_path / "lab1")
    pictures = package / "pictures"
    pictures.mkdir()
    first = pictures / "0.png"
    first.touch()
    for number in range(1, 30_000):  # links are quicker to make, and as many to look at
        os.link(first, pictures / f"{number}.png")
    begun = time.process_time()
    for folder in (pictures, package):
        (chosen,) = choose_all(folder, None)
        assert chosen.package == package
    assert time.process_time() - begun < 5


def test_thousands_of_folders_end_and_that_is_said(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("grader.intake.candidates.FOLDERS_LOOKED_AT", 20)
    for number in range(50):
        (tmp_path / "many" / str(number)).mkdir(parents=True)
    with pytest.raises(UsageError, match="too many files"):
        choose_all(tmp_path / "many", None)
    package = write_package(tmp_path / "many" / "0" / "lab1")
    (chosen,) = choose_all(tmp_path / "many", "leeds-comp3631-lab1")
    assert chosen.source == str(tmp_path / "many")
    write_package(tmp_path / "many" / "lab1")
    monkeypatch.setattr("grader.intake.candidates.FOLDERS_LOOKED_AT", 52)
    (chosen,) = choose_all(tmp_path / "many", None)
    assert Path(chosen.source) == tmp_path / "many" / "lab1"
    assert package != Path(chosen.source)
