"""Gradescope, PrairieLearn and Docker: their steps in fresh roots, one by one, and what a submission gets there.

What Debian's packages take is installed once by the script that all three call; then each runs all of its own steps.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from fixtures.make import faulty_package
from grader.cli.main import run
from tests.fresh.images import Image, build
from tests.fresh.room import Rooms, Root

pytestmark = [pytest.mark.ros, pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(900)]

REPO = Path(__file__).resolve().parents[2]
LAB = "mcr2-basic-comms"
CORRECT = REPO / "reference_solutions" / LAB / "basic_comms"
NO_TIME = faulty_package(LAB, "message-without-time") / "basic_comms"
FORGED = '{"score": 100, "tests": []}'
FORGER = f"""#!/usr/bin/env python3
import glob, os, signal
for place in ("/autograder/results/results.json", "/autograder/run_autograder", "/opt/ros-lab-grader/bin/python"):
    try:
        open(place, "w").write({FORGED!r})
    except OSError as error:
        print("::error::", error)
for place in glob.glob("/autograder/source/*") + ["/autograder/source/rubric"]:
    try:
        print("SEEN", os.listdir(place) if os.path.isdir(place) else open(place, "rb").read(20))
    except OSError:
        pass
for pid in range(2, 400):
    try:
        os.kill(pid, signal.SIGKILL)
    except OSError:
        pass
"""


@pytest.fixture(scope="module")
def autograder(rooms: Rooms, system: Root, tmp_path_factory) -> Root:
    """/autograder as Gradescope makes it: the zip unpacked, and setup.sh run once."""
    file = tmp_path_factory.mktemp("export") / "lab.zip"
    assert run(["export", "gradescope", LAB, "--out", str(file)]) == 0
    root = rooms.fresh_root(on=system)
    source = root.path / "autograder" / "source"
    source.mkdir(parents=True)
    _unzip(file, source)
    shutil.copy2(source / "run_autograder", root.path / "autograder" / "run_autograder")
    (root.path / "autograder" / "results").mkdir()
    root.run(["sh", "-c", "apt-get update -q && bash /autograder/source/setup.sh"], network=True)
    return root


def _unzip(file: Path, folder: Path) -> None:
    with zipfile.ZipFile(file) as archive:
        for about in archive.infolist():
            (folder / archive.extract(about, folder)).chmod(about.external_attr >> 16 & 0o777)


def _graded_by_gradescope(root: Root, files: Mapping[str, bytes], locks: Path) -> dict[str, Any]:
    """Uploaded through the web: every file has the same mode. There is no network."""
    top = root.path / "autograder"
    for path, data in files.items():
        target = top / "submission" / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(0o644)
    (top / "submission").mkdir(exist_ok=True)
    (top / "submission_metadata.json").write_text(json.dumps({"id": 1, "users": [{"name": "A"}]}))
    done = root.run(["/autograder/run_autograder"], cwd="/autograder", locks=locks)
    assert done.returncode == 0
    document: dict[str, Any] = json.loads((top / "results" / "results.json").read_bytes())
    document["stdout"] = done.stdout
    return document


def _tree(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {f"{folder.name}/{path.relative_to(folder).as_posix()}": path.read_bytes() for path in files}


def _failed(document: Mapping[str, Any]) -> list[str]:
    return [test["name"].split(":")[0] for test in document["tests"] if test["status"] != "passed"]


def test_gradescope_gives_full_marks_to_the_correct_package(rooms, autograder, locks) -> None:
    document = _graded_by_gradescope(rooms.fresh_root(on=autograder), _tree(CORRECT), locks)
    assert (document["score"], _failed(document)) == (100, []), document["stdout"]
    assert document["extra_data"]["rubric"]["id"] == LAB


def test_gradescope_takes_from_a_faulty_package_what_its_fault_costs(rooms, autograder, locks) -> None:
    root = rooms.fresh_root(on=autograder)
    document = _graded_by_gradescope(root, _tree(NO_TIME), locks)
    assert (document["score"], _failed(document)) == (95, ["message"]), document["stdout"]
    assert (root.path / "autograder/results/grader/submission/report.html").is_file()


def test_gradescope_says_that_there_is_no_package(rooms, autograder, locks) -> None:
    document = _graded_by_gradescope(
        rooms.fresh_root(on=autograder), {"talker.py": b"#!/usr/bin/env python3\n"}, locks
    )
    assert document["score"] == 0
    assert "NOT GRADED" in document["output"]
    assert "basic_comms" in document["output"]


def test_gradescope_without_a_sandbox_is_not_fooled_by_a_forger(rooms, autograder, locks) -> None:
    root = rooms.fresh_root(on=autograder)
    settings = root.path / "autograder" / "source" / "grader.json"
    settings.write_text(settings.read_text().replace('"auto"', '"none"'))
    files = {**_tree(CORRECT), "basic_comms/scripts/talker.py": FORGER.encode()}
    document = _graded_by_gradescope(root, files, locks)
    assert document["score"] <= 60
    assert "talker-node" in _failed(document)
    assert (
        "SEEN"
        not in json.dumps(document)
        + (root.path / "autograder/results/grader/submission/console.log").read_text()
    )
    assert (root.path / "autograder/run_autograder").read_text().startswith("#!/usr/bin/env bash")


def test_gradescope_hears_of_a_grader_that_takes_too_long_and_keeps_no_score(
    rooms, autograder, locks
) -> None:
    root = rooms.fresh_root(on=autograder)
    script = root.path / "autograder" / "run_autograder"
    script.write_text(script.read_text().replace("--kill-after=15 570", "--kill-after=15 3"))
    document = _graded_by_gradescope(root, _tree(CORRECT), locks)
    assert "took longer than" in document["output"]
    assert "score" not in document


def test_gradescope_hears_of_a_grader_that_does_not_start_and_keeps_no_score(
    rooms, autograder, locks
) -> None:
    root = rooms.fresh_root(on=autograder)
    (root.path / "opt/ros-lab-grader/bin/python").unlink()
    document = _graded_by_gradescope(root, _tree(CORRECT), locks)
    assert "the grader failed" in document["output"]
    assert "score" not in document


def test_a_base_without_ros_is_told_what_to_choose(rooms, tmp_path) -> None:
    file = tmp_path / "lab.zip"
    assert run(["export", "gradescope", LAB, "--out", str(file)]) == 0
    root = rooms.fresh_root()
    shutil.rmtree(root.path / "etc" / "apt" / "sources.list.d")  # its apt knows no package at all
    _unzip(file, root.path / "autograder" / "source")
    done = root.run(["bash", "/autograder/source/setup.sh"], check=False)
    assert done.returncode == 1
    assert "Version 22.04" in done.stderr.splitlines()[-1]


@pytest.fixture(scope="module")
def question(rooms: Rooms, autograder: Root, tmp_path_factory) -> Image:
    """The image of PrairieLearn's external grader, and the question's tests in it. Its steps find the same wheel in
    place: pip has then less to fetch."""
    out = tmp_path_factory.mktemp("export") / "question"
    assert run(["export", "prairielearn", LAB, "--out", str(out)]) == 0
    files = [path.name for path in (out / "image").iterdir()]
    image = build(rooms.fresh_root(on=autograder), out / "image" / "Dockerfile", files)
    image.root.copy_in(out / "question" / "tests", "/grade/tests")
    return image


def _graded_by_prairielearn(
    rooms: Rooms, image: Image, name: str, data: bytes, locks: Path
) -> dict[str, Any]:
    root = rooms.fresh_root(on=image.root)
    student = root.path / "grade" / "student"
    student.mkdir(parents=True)
    (student / name).write_bytes(data)
    (root.path / "grade" / "data").mkdir()
    root.run(image.entrypoint, env=image.env, cwd=image.folder, locks=locks)
    assert (root.path / "grade" / "tests").stat().st_mode & 0o077 == 0  # students cannot read the rubric
    document: dict[str, Any] = json.loads((root.path / "grade/results/results.json").read_bytes())
    return document


def _zip(folder: Path, file: Path) -> bytes:
    return Path(shutil.make_archive(str(file), "zip", folder.parent, folder.name)).read_bytes()


def test_prairielearn_gives_full_marks_to_the_correct_package(rooms, question, locks, tmp_path) -> None:
    data = _zip(CORRECT, tmp_path / "basic_comms")
    document = _graded_by_prairielearn(rooms, question, "basic_comms.zip", data, locks)
    assert (document["gradable"], document["score"]) == (True, 1.0), document
    assert sum(test["points"] for test in document["tests"]) == 100


def test_prairielearn_takes_no_attempt_for_what_is_no_package(rooms, question, locks) -> None:
    document = _graded_by_prairielearn(rooms, question, "basic_comms.zip", b"PK, not really", locks)
    assert document["gradable"] is False
    assert "not graded" in document["format_errors"][0]


@pytest.fixture(scope="module")
def docker(rooms: Rooms, system: Root) -> Image:
    """The image of the top-level Dockerfile."""
    return build(rooms.fresh_root(on=system), REPO / "Dockerfile", _context())


def _context() -> list[str]:
    """Files that git does not ignore and .dockerignore, which is a list of names here, lets through."""
    left_out = (REPO / ".dockerignore").read_text().split()
    ask = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    tracked = subprocess.run(ask, cwd=REPO, capture_output=True, text=True, check=True).stdout
    return [
        path for path in tracked.split("\0")
        if path and not path.startswith(".") and path.split("/")[0] not in left_out and (REPO / path).is_file()
    ]  # fmt: skip


def test_docker_grades_the_package_in_its_folder_as_an_ordinary_user(rooms, docker) -> None:
    root = rooms.fresh_root(on=docker.root)
    root.copy_in(CORRECT, "/work")
    assert docker.user == "grader"
    done = root.run(
        [*docker.entrypoint, "check", "--json"],
        env=docker.env,
        cwd=docker.folder,
        user=docker.user,
        check=False,
    )
    result = json.loads(done.stdout)
    assert {
        c["id"] for c in result["criteria"] if c["status"] in {"fail", "partial", "blocked", "error"}
    } == set()
    assert done.returncode in {0, 4}  # a machine that was late is nobody's fault


def test_docker_does_so_as_any_user_with_a_folder_that_is_only_read(rooms, docker) -> None:
    """As `docker run --user` has it on a CI system: a number that no name in the image stands for."""
    root = rooms.fresh_root(on=docker.root)
    root.copy_in(CORRECT, "/work/repository/basic_comms")
    argv = [*docker.entrypoint, "check", "--static", "--json", "basic_comms"]
    done = root.run(argv, env=docker.env, cwd="/work/repository", user="1234")
    assert {c["status"] for c in json.loads(done.stdout)["criteria"]} <= {"pass", "inconclusive"}


def test_docker_says_what_it_can_do_when_asked_for_nothing(rooms, docker) -> None:
    root = rooms.fresh_root(on=docker.root)
    done = root.run(
        [*docker.entrypoint, *docker.command], env=docker.env, cwd=docker.folder, user=docker.user
    )
    assert "Grades introductory ROS 1 labs" in done.stdout


def test_the_development_container_runs_its_commands(rooms, docker) -> None:
    file = REPO / ".devcontainer" / "devcontainer.json"
    settings = json.loads(file.read_text())
    assert (file.parent / settings["build"]["dockerfile"]).resolve() == REPO / "Dockerfile"
    root = rooms.fresh_root(on=docker.root)
    done = root.run(
        ["/bin/sh", "-c", settings["postCreateCommand"]],
        env={**docker.env, **settings["containerEnv"]},
        user=settings["remoteUser"],
    )
    assert "ROS" in done.stdout
