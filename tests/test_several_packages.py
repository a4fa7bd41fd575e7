"""A lab with several packages: found, told apart, judged each by itself. What runs is in the example's fixtures."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from grader import pipeline
from grader.cli.fixing import fix_packages
from grader.cli.select_rubric import choose_all, only
from grader.errors import PackageNotFound, RubricError
from grader.intake.open import open_submission
from grader.model.result import CriterionResult, Silence
from grader.model.submission import Submission
from grader.model.verdict import FileCitation, Status
from grader.package.facts import read_packages
from grader.pipeline import wanted_package
from grader.repaired_copy import choose_repairs, repaired_copy
from grader.rubric.find import VARIABLE
from grader.rubric.load import load_rubric
from tests.fixture_runs import loaded, source_of
from tests.intake.samples import git, make_zip, write, zip_entry

LAB = "two-packages"
MSGS, STATION = "weather_msgs", "weather_station"


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The correct submission, to be changed."""
    return Path(shutil.copytree(source_of(LAB, "reference"), tmp_path / "handed-in"))


def opened(source: Path, tmp_path: Path) -> Submission:
    wanted = wanted_package(loaded(LAB).rubric, "")
    return open_submission(str(source), package=wanted, workdir=tmp_path / "work")


def judged(source: Path, tmp_path: Path) -> dict[str, CriterionResult]:
    options = pipeline.GradeOptions(static_only=True)
    result = pipeline.grade(str(source), loaded(LAB), tmp_path / "out", options, Silence())
    return {criterion.id: criterion for criterion in result.criteria}


def renamed(folder: Path, old: str, new: str) -> None:
    path = folder / "package.xml"
    path.write_text(path.read_text().replace(f"<name>{old}</name>", f"<name>{new}</name>"))


def test_all_packages_are_found_wherever_they_lie(copy, tmp_path):
    entries = [
        (zip_entry(f"ws/src/{p.relative_to(copy)}", mode=0o755), p.read_bytes())
        for p in sorted(copy.rglob("*"))
        if p.is_file()
    ]
    packed = make_zip(tmp_path / "handed-in.zip", entries)
    git(copy, "init", "-q")
    git(copy, "add", ".")
    git(copy, "commit", "-qm", "both")
    for source, path in ((copy, STATION), (packed, f"ws/src/{STATION}"), (f"file://{copy}", STATION)):
        submission = opened(source, tmp_path)
        assert submission.package.name == MSGS
        assert [(one.name, one.asked, one.path) for one in submission.also] == [(STATION, STATION, path)]
        assert submission.packages == ()


def test_each_package_is_part_of_the_digest(copy, tmp_path):
    before = opened(copy, tmp_path).digest
    (copy / STATION / "scripts" / "new.py").write_text("")
    added = opened(copy, tmp_path).digest
    shutil.rmtree(copy / STATION)
    assert len({before, added, opened(copy, tmp_path).digest}) == 3


def test_a_package_that_is_missing_costs_its_own_criteria_and_is_named(copy, tmp_path):
    shutil.rmtree(copy / STATION)
    found = judged(copy, tmp_path)
    assert found["definition"].status is Status.PASS
    for name in ("manifest", "executable"):
        assert found[name].status is Status.FAIL
        assert found[name].message == f"package {STATION} is missing; packages found: {MSGS}"


def test_without_the_main_package_nothing_is_graded(copy, tmp_path):
    shutil.rmtree(copy / MSGS)
    with pytest.raises(PackageNotFound, match=rf"no package {MSGS} .*packages here: {STATION}"):
        opened(copy, tmp_path)


def test_a_package_is_never_taken_for_another_one_of_the_lab(copy, tmp_path):
    """Two names that are one letter apart: what has the one is no slip of the other."""
    renamed(copy / STATION, STATION, "weather_msgz")
    wanted = wanted_package(loaded(LAB).rubric.model_copy(update={"package_": (MSGS, "weather_msgz")}), "")
    shutil.rmtree(copy / MSGS)
    with pytest.raises(PackageNotFound):
        open_submission(str(copy), package=wanted, workdir=tmp_path / "work")


def test_a_slip_in_a_name_is_seen_and_said(copy, tmp_path):
    renamed(copy / STATION, STATION, "weather_staton")
    submission = opened(copy, tmp_path)
    assert [one.asked for one in submission.also] == [STATION]
    assert any(
        hint.startswith(f"{STATION}: ") and "names the package weather_staton" in hint
        for hint in submission.hints
    )
    found = judged(copy, tmp_path)["manifest"]
    assert found.citations[0].file == f"../{STATION}/package.xml"


def test_findings_name_the_package_and_lead_to_its_file(copy, tmp_path):
    script = copy / STATION / "scripts" / "sensor.py"
    script.write_text(script.read_text().replace("rospy.Rate(10)", "rospy.Rate(10"))
    found = judged(copy, tmp_path)["executable"]
    (cited,) = (one for one in found.citations if isinstance(one, FileCitation))
    assert found.message.startswith(f"{STATION}: scripts/sensor.py line 13: ")
    assert (copy / MSGS / cited.file).resolve() == script
    assert cited.source.strip() == "rate = rospy.Rate(10"


def test_repairs_are_made_on_a_copy_of_their_own_package(copy, tmp_path):
    script = copy / STATION / "scripts" / "sensor.py"
    script.write_text(script.read_text().replace("rospy.Rate(10)", "rospy.Rate(10"))
    submission, rubric = opened(copy, tmp_path), loaded(LAB).rubric
    facts = read_packages(submission, rubric.launch_commands)
    lost = [c.model_copy(update={"status": Status.FAIL}) for c in judged(copy, tmp_path).values()]
    repairs, scenarios = choose_repairs(submission, facts, rubric, lost, built=True)
    assert [one.file for one in repairs] == [f"../{STATION}/scripts/sensor.py"]
    assert "sensor" in scenarios
    with repaired_copy(submission, repairs) as repaired:
        assert repaired is not None
        (station,) = repaired.also
        assert "rospy.Rate(10)" in (station.folder / "scripts" / "sensor.py").read_text()
    assert "rospy.Rate(10)" not in script.read_text()


@pytest.fixture
def known(tmp_path, monkeypatch) -> None:
    """The example among the user's own labs, so that it is found without --rubric."""
    labs = tmp_path / "labs"
    labs.mkdir()
    shutil.copy(loaded(LAB).path, labs)
    monkeypatch.setenv(VARIABLE, str(labs))


@pytest.mark.usefixtures("known")
@pytest.mark.parametrize("inside", [".", MSGS, STATION, f"{STATION}/scripts"])
def test_check_finds_the_lab_by_any_of_its_packages_and_takes_them_all(inside, copy, tmp_path):
    chosen = only(choose_all(copy / inside, None))
    assert chosen.rubric.rubric.id == LAB
    submission = opened(Path(chosen.source), tmp_path)
    assert [one.name for one in (submission.package, *submission.also)] == [MSGS, STATION]


@pytest.mark.usefixtures("known")
def test_fix_repairs_them_all(copy):
    scripts = [copy / STATION / "scripts" / "sensor.py", copy / MSGS / "package.xml"]
    scripts[0].write_bytes(scripts[0].read_bytes().replace(b"\n", b"\r\n"))
    renamed(copy / MSGS, MSGS, "weather_msg")
    assert fix_packages([only(choose_all(copy, LAB))], dry_run=False, yes=True)
    assert b"\r" not in scripts[0].read_bytes()
    assert f"<name>{MSGS}</name>" in scripts[1].read_text()


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            f"package: {STATION}, script: scripts/sensor.py",
            "package: weather_statoin, script: scripts/sensor.py",
            f'scenarios.sensor.start[0].package: the lab has no package "weather_statoin" (did you mean "{STATION}"?)',
        ),
        (
            f"     package: {STATION}, with: {{path: scripts/sensor",
            "     package: lab9, with: {path: scripts/sensor",
            f'criteria[3].package: the lab has no package "lab9": there is {MSGS} and {STATION}',
        ),
        (
            f"package: [{MSGS}, {STATION}]",
            f"package: [{MSGS}, {STATION}, {MSGS}]",
            f'package[2]: "{MSGS}" is there twice',
        ),
        (
            f"package: {STATION}, script: scripts/sensor.py",
            f"package: {STATION}, program: turtlesim/turtlesim_node",
            "scenarios.sensor.start[0].package: is not for a program: that names its package itself",
        ),
    ],
)
def test_a_package_that_the_lab_does_not_have_is_refused(old, new, fault, tmp_path):
    text = loaded(LAB).path.read_text()
    assert text.count(old) == 1
    path = write(tmp_path, {"lab.yaml": text.replace(old, new)}) / "lab.yaml"
    with pytest.raises(RubricError) as caught:
        load_rubric(str(path))
    assert any(fault in one for one in caught.value.faults), caught.value.faults
