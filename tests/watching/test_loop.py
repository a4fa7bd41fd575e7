"""What is run again when, with saves and gradings that are made up; the package is real."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from grader.errors import ExitCode, SubmissionError
from grader.model.result import ErrorInfo
from grader.model.verdict import Status
from tests.watching.labs import append, copy_of, rubric, write
from tests.watching.made_up import Course, Step

LEEDS = "leeds-comp3631-lab1"
ALL = {"talker", "wraps", "listener", "launch"}
TALKER, LISTENER, LAUNCH = "src/numeric_talker.py", "src/numeric_listener.py", "launch/lab1.launch"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return copy_of(LEEDS, tmp_path)


@pytest.fixture
def make(package: Path, tmp_path: Path):
    return lambda *steps: Course(package, rubric(LEEDS).rubric, tmp_path, *steps)


def saving(package: Path, *names: str) -> Step:
    """Somebody saves these files, with something new in them."""

    def save() -> list[Path]:
        text = "\n<!-- new -->\n"
        return [append(package / n, text if n.endswith(".launch") else "\n# new\n") for n in names]

    return save


def test_first_everything_then_what_is_concerned(make, package) -> None:
    course = make(saving(package, LAUNCH), saving(package, TALKER))
    assert course.run() is ExitCode.PASSED
    assert course.grading.ran == [ALL, {"launch"}, {"talker", "wraps"}]
    assert course.shown.words == [
        "everything", "end", f"{LAUNCH}: launch", "end", f"{TALKER}: talker wraps", "end"
    ]  # fmt: skip
    assert [unchanged for _, unchanged, _ in course.shown.ends] == [
        set(), ALL - {"launch"}, ALL - {"talker", "wraps"}
    ]  # fmt: skip


def test_several_files_saved_at_once_are_one_run(make, package) -> None:
    course = make(saving(package, LAUNCH, TALKER))
    course.run()
    assert course.grading.ran == [ALL, {"launch", "talker", "wraps"}]


def test_a_save_while_something_runs_stops_it_and_both_are_run(make, package) -> None:
    course = make(saving(package, LAUNCH))
    course.grading.during = [lambda: None, lambda: course.saves.save(saving(package, TALKER)())]
    course.run()
    assert course.grading.begun == [ALL, {"launch"}, {"launch", "talker", "wraps"}]
    assert course.grading.ran == [ALL, {"launch", "talker", "wraps"}]
    assert course.shown.words[2:] == [
        f"{LAUNCH}: launch",
        "again",
        f"{LAUNCH} {TALKER}: talker wraps launch",
        "end",
    ]


def test_a_change_that_is_taken_back_while_it_is_tried_leaves_nothing_to_run(make, package) -> None:
    before = (package / TALKER).read_text()
    course = make(saving(package, TALKER))
    course.grading.during = [lambda: None, lambda: course.saves.save(write(package / TALKER, before))]
    course.run()
    assert course.grading.ran == [ALL, set()]


def test_a_save_at_the_end_of_a_run_is_not_overlooked(make, package) -> None:
    course = make()
    course.grading.after = [lambda: course.saves.save(saving(package, LISTENER)())]
    course.run()
    assert course.grading.ran == [ALL, ALL]
    assert course.shown.words == ["everything", "again", f"{LISTENER}: everything", "end"]


def test_a_save_that_nobody_told_of_is_found(make, package) -> None:
    def quietly() -> None:
        saving(package, LAUNCH)()

    course = make(quietly)
    course.run()
    assert course.grading.ran == [ALL, {"launch"}]


def test_a_file_saved_as_it_was_runs_nothing(make, package) -> None:
    course = make(lambda: package / TALKER)
    course.run()
    assert course.grading.ran == [ALL]
    assert course.shown.words == ["everything", "end", f"{TALKER}: same"]


def test_what_could_not_be_judged_is_run_again_with_any_save(make, package) -> None:
    course = make(lambda: package / TALKER, saving(package, LAUNCH))
    course.grading.verdicts = {"wraps": Status.INCONCLUSIVE}
    course.run()
    assert course.grading.ran == [ALL, {"wraps"}, {"wraps", "launch"}]


def test_the_exit_code_is_that_of_the_last_result(make, package) -> None:
    course = make(saving(package, LAUNCH))
    course.grading.after = [lambda: course.grading.verdicts.update(launch=Status.FAIL)]
    assert course.run() is ExitCode.BELOW_PASS_MARK


def test_ctrl_c_before_there_is_a_result_is_an_interruption(make) -> None:
    course = make()

    def interrupt() -> None:
        raise KeyboardInterrupt

    course.grading.during = [interrupt]
    with pytest.raises(KeyboardInterrupt):
        course.run()
    assert course.shown.ends == []


def test_ctrl_c_while_a_later_run_goes_on_gives_the_last_results_code(make, package) -> None:
    course = make(saving(package, LAUNCH))

    def interrupt() -> None:
        raise KeyboardInterrupt

    course.grading.during = [lambda: None, interrupt]
    assert course.run() is ExitCode.PASSED


def test_a_package_that_cannot_be_graded_for_a_while_does_not_end_it(make, package) -> None:
    manifest = package / "package.xml"
    sound = manifest.read_text()
    wrong = ErrorInfo(kind="package-not-found", message="no package lab1", hint="")

    def spoil() -> Path:
        course.grading.error = wrong
        return write(manifest, sound.replace("<name>lab1<", "<name><"))

    def mend() -> Path:
        course.grading.error = None
        return write(manifest, sound)

    course = make(spoil, mend)
    assert course.run() is ExitCode.PASSED
    assert [outcome.code for outcome, _, _ in course.shown.ends] == [0, 3, 0]
    assert course.grading.ran[2] == set()


def test_it_ends_with_the_error_where_that_was_the_last_result(make, package) -> None:
    course = make()
    course.grading.error = ErrorInfo(kind="submission", message="no", hint="")
    assert course.run() is ExitCode.NOT_GRADED


@pytest.mark.parametrize("error", [FileNotFoundError("gone"), SubmissionError("cannot be read")])
def test_a_file_that_cannot_be_read_for_a_moment_is_read_a_moment_later(error, make, package) -> None:
    failing = [error]

    def look() -> None:
        if failing and course.shown.ends:
            raise failing.pop()

    course = make(saving(package, LAUNCH))
    course.look = look
    assert course.run() is ExitCode.PASSED
    assert course.grading.ran == [ALL, {"launch"}]


@pytest.mark.parametrize("leave", [lambda p: p.rename(p.with_name("lab2")), shutil.rmtree])
def test_a_package_folder_that_is_gone_ends_it(leave, make, package) -> None:
    course = make(lambda: (leave(package), package)[1])
    with pytest.raises(SubmissionError, match="was deleted or renamed"):
        course.run()


def test_files_alone_need_no_evidence(make, package) -> None:
    course = make(saving(package, TALKER))
    course.runs = False
    course.run()
    assert course.shown.words == ["nothing", "end", f"{TALKER}: nothing", "end"]


def test_a_new_folder_is_followed(make, package) -> None:
    def new() -> Path:
        return write(package / "nodes/deep/new.py", "x = 1\n").parent

    course = make(new)
    course.run()
    assert package / "nodes/deep" not in course.saves.followed[0]
    assert package / "nodes/deep" in course.saves.followed[-1]


def test_evidence_is_taken_over_from_the_run_that_it_was_recorded_in(make, package, tmp_path) -> None:
    course = make(saving(package, LAUNCH), saving(package, LAUNCH))
    course.run()
    kept = {path.stem: path.read_text() for path in (tmp_path / "kept").iterdir()}
    assert kept == {"talker": "1", "wraps": "1", "listener": "1", "launch": "3"}
