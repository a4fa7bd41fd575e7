"""Every fixture gets exactly the statuses that it declares, and the reference solution gets full marks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from fixtures.make import faulty_package, labs
from grader.authoring.mutation.solution import read_tree
from grader.intake.open import open_submission
from grader.judging.judge import judge_files
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation
from grader.package.facts import read_packages
from grader.pipeline import wanted_package
from tests.classes.gradebook.made import criterion
from tests.fixture_runs import (
    GIT,
    REFERENCE,
    ROOT,
    TOGETHER,
    expected_points,
    fixture_names,
    grade_fixture,
    in_turn,
    is_example,
    lacking_packages,
    loaded,
    missed,
    read_fixture,
    rubric_of,
    shorter_round,
    source_of,
    surprises,
    workers,
)
from tests.support.advice import faulty_advice

LABS = labs()
FAULTY_AT_LEAST = {"leeds-comp3631-lab1": 20}
NAMED = [(lab, name) for lab in LABS for name in fixture_names(lab)]
SHORTER = dict.fromkeys((lab, name) for lab in LABS for name in (REFERENCE, *shorter_round(lab)))
TOGETHER_TOO = dict.fromkeys((lab, name) for lab in LABS for name in TOGETHER.get(lab, ()))
GRADED = SHORTER | TOGETHER_TOO | dict.fromkeys(NAMED)
IN_ANOTHER_TEST = ("leeds-comp3631-lab1", REFERENCE)
"""Gets full marks in tests/test_grading.py, too: left to `make test-all` here."""
MAKE = ROOT / "fixtures" / "make.py"
SUMMARY = re.compile(r"\S.{9,}\.")
REFERENCES = ROOT / "reference_solutions"
TALKER = "lab1/src/numeric_talker.py"
SCRIPT_MODE = "100755"


each_lab = pytest.mark.parametrize("lab", LABS)


@pytest.fixture(scope="module")
def graded(request, tmp_path_factory) -> Iterator[dict[tuple[str, str], Future[GradingResult]]]:
    """The selected fixtures, graded side by side while the tests wait for their own one."""
    every = [getattr(getattr(item, "callspec", None), "params", {}) for item in request.session.items]
    chosen = [(params["lab"], params["graded_name"]) for params in every if "graded_name" in params]
    out = tmp_path_factory.mktemp("graded")
    with workers() as pool:
        yield {pair: pool.submit(grade_fixture, *pair, out) for pair in in_turn(dict.fromkeys(chosen))}


@each_lab
def test_there_are_enough_faults(lab) -> None:
    faulty = [name for name in fixture_names(lab) if not name.startswith("ok-")]
    assert len(faulty) >= FAULTY_AT_LEAST.get(lab, 12)
    assert all(read_fixture(lab, name).expect for name in faulty)


@pytest.mark.parametrize("lab", [lab for lab in LABS if not is_example(lab)])
def test_every_criterion_is_missed_in_the_shorter_round(lab) -> None:
    lost = {i for name in shorter_round(lab) for i in missed(lab, name)}
    assert lost == {criterion.id for criterion in rubric_of(lab).criteria}


@each_lab
def test_declarations(lab) -> None:
    rubric = rubric_of(lab)
    ids = {criterion.id for criterion in rubric.criteria}
    for name in fixture_names(lab):
        fixture = read_fixture(lab, name)
        assert SUMMARY.fullmatch(fixture.summary), name
        banned = set(fixture.never_says) if isinstance(fixture.never_says, dict) else set()
        assert set(fixture.expect) | set(fixture.message) | set(fixture.says) | banned <= ids, name
        points = expected_points(fixture, rubric)
        assert 0 <= points <= rubric.max_points, name
        assert name.startswith("ok-") == (points == rubric.max_points), name
        for pattern in fixture.message.values():
            re.compile(pattern)


@each_lab
def test_one_cause_explains_what_is_blocked(lab) -> None:
    """What it requires is lost, or it says which other one has paid for the same exception or unheard topic."""
    requires = {criterion.id: criterion.requires for criterion in rubric_of(lab).criteria}
    for name in fixture_names(lab):
        fixture = read_fixture(lab, name)
        failed = "|".join(i for i, status in fixture.expect.items() if status == "fail")
        charged = re.compile(rf"blocked by (?:{failed}): .*(?:Error|no node subscribes)")
        blocked = [i for i, status in fixture.expect.items() if status == "blocked"]
        unexplained = [i for i in blocked if not set(requires[i]) & set(fixture.expect)]
        assert [i for i in unexplained if not charged.match(fixture.message.get(i, ""))] == [], name


@pytest.mark.full
@each_lab
def test_packages_are_written_and_listed(lab, tmp_path) -> None:
    names = fixture_names(lab)[:2]

    def make(*words: str | Path) -> str:
        return subprocess.run(
            [sys.executable, MAKE, lab, *words], capture_output=True, text=True, check=True
        ).stdout

    assert len(make().splitlines()) == len(fixture_names(lab))
    assert make(*names, "--out", tmp_path).splitlines() == [str(tmp_path / name) for name in names]
    for name in names:
        assert (
            read_tree(tmp_path / name) == read_tree(faulty_package(lab, name)) != read_tree(REFERENCES / lab)
        )


KILLED = """
import os, signal, time
from tests.fixture_runs import workers
if __name__ == "__main__":
    with workers(2) as pool:
        print([pool.submit(os.getpid).result() for _ in range(2)][0], flush=True)
        for _ in range(6):
            pool.submit(time.sleep, 100)
        {end}
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize(
    "end",
    [
        "os.kill(os.getpid(), signal.SIGKILL)",
        *(pytest.param(end, marks=pytest.mark.full) for end in ("raise KeyboardInterrupt", "pass")),
    ],
)
def test_workers_end_with_who_started_them(end, tmp_path) -> None:
    script = tmp_path / "killed.py"
    script.write_text(KILLED.replace("{end}", end))
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, script], env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        timeout=60, check=False,
    )  # fmt: skip
    worker, until_s = Path("/proc", done.stdout.strip(), "stat"), time.monotonic() + 20
    while worker.exists() and time.monotonic() < until_s:
        time.sleep(0.1)
    assert done.stdout.strip()
    assert not worker.exists()


def test_executable_bits_are_those_of_the_declaration() -> None:
    lab = "leeds-comp3631-lab1"
    faulty, right = faulty_package(lab, "talker-not-executable"), faulty_package(lab, "talker-crlf")
    assert not (faulty / TALKER).stat().st_mode & 0o111
    assert (right / TALKER).stat().st_mode & 0o777 == 0o755


def test_git_keeps_the_executable_bits() -> None:
    """A checkout's file system may lie; what is graded on another machine comes from git's tree."""
    done = subprocess.run(
        [GIT, "ls-files", "-sz", "reference_solutions"], cwd=ROOT, capture_output=True, check=False
    )
    if done.returncode or not done.stdout:
        pytest.skip("not in a git checkout")
    entries = dict(reversed(line.split("\t")) for line in done.stdout.decode().split("\0") if line)
    regular = {path: stat for path, stat in entries.items() if not stat.startswith("120000")}
    wrong = [
        path
        for path, stat in regular.items()
        if (ROOT / path).is_file()
        and stat.startswith(SCRIPT_MODE) != bool((ROOT / path).stat().st_mode & 0o100)
    ]
    assert wrong == []


@pytest.mark.parametrize(
    ("lab", "name"),
    [pytest.param(*pair, marks=[] if pair in SHORTER else pytest.mark.full) for pair in NAMED],
)
def test_what_is_advised_by_the_files_is_true(lab, name, tmp_path) -> None:
    """Two criteria do not contradict each other, lines and files are there, and what to write is not there yet."""
    rubric, source = loaded(lab), source_of(lab, name)
    submission = open_submission(
        str(source), package=wanted_package(rubric.rubric, ""), workdir=tmp_path, submission_id=name
    )
    found = judge_files(
        rubric.rubric, read_packages(submission, rubric.rubric.launch_commands), rubric.checks
    )
    assert faulty_advice([verdict.criterion for verdict in found], source) == []


@pytest.mark.parametrize(
    ("hint", "fault"),
    [
        ("write `rate.sleep()`", "rate: rate.sleep() is there already"),
        (
            "write #!/usr/bin/env python3 as the very first line",
            "rate: the first line is #!/usr/bin/env python3",
        ),
        ("src/talker.py line 7: write `rospy.spin()`", "rate: there is no line 7 of src/talker.py"),
        ("write `pass`", "src/talker.py, line 2: write break or pass?"),
        ("remove `break`", "rate: remove break, which other advice says to write"),
    ],
)
def test_wrong_advice_is_found(hint, fault, tmp_path) -> None:
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "talker.py").write_text("#!/usr/bin/env python3\nrate.sleep()\n")
    place = (FileCitation(file="src/talker.py", line=2),)
    first, other = (
        criterion(name, 0).model_copy(update={"hint": said, "citations": place})
        for name, said in (("rate", hint), ("name", "write `break`"))
    )
    found = faulty_advice([first, other], tmp_path)
    assert any(line.startswith(fault) for line in found)
    assert faulty_advice([other], tmp_path) == []


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize(
    ("lab", "graded_name"),
    [
        pytest.param(*pair, marks=[] if pair in SHORTER and pair != IN_ANOTHER_TEST else pytest.mark.full)
        for pair in GRADED
    ],
)
def test_graded_for_real(lab, graded_name, graded) -> None:
    if lacking := lacking_packages(lab):
        pytest.skip(f"this machine lacks {', '.join(lacking)}")
    result, rubric = graded[lab, graded_name].result(), rubric_of(lab)
    found = surprises(result, read_fixture(lab, graded_name), rubric)
    assert not found, "\n  ".join([f"{lab}/{graded_name} is not graded as declared:", *found])
    assert {c.id for c in result.criteria} == {c.id for c in rubric.criteria}
    assert faulty_advice(result.criteria, source_of(lab, graded_name)) == []
