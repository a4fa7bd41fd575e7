"""What is run again when, with saves and gradings that are made up; the package is real."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from grader.errors import ExitCode, SubmissionError
from grader.model.result import ErrorInfo
from grader.model.verdict import Status
from tests.student.watching.labs import LEEDS, append, rubric, write
from tests.student.watching.made_up import Course, Step

TALKER, LISTENER, LAUNCH = "src/numeric_talker.py", "src/numeric_listener.py", "launch/lab1.launch"


@pytest.fixture
def make(package: Path):
    return lambda *steps: Course(package, rubric(LEEDS).rubric, *steps)


def saving(package: Path, *names: str) -> Step:
    """Somebody saves these files, with something new in them."""

    def save() -> list[Path]:
        text = "\n<!-- new -->\n"
        return [append(package / n, text if n.endswith(".launch") else "\n# new\n") for n in names]

    return save


def test_each_save_grades_again(make, package) -> None:
    course = make(saving(package, LAUNCH), saving(package, TALKER))
    assert course.run() is ExitCode.PASSED
    assert course.screen.words == [
        "begin", "end", f"begin {LAUNCH}", f"end {LAUNCH}", f"begin {TALKER}", f"end {TALKER}"
    ]  # fmt: skip


def test_several_files_saved_at_once_are_one_run(make, package) -> None:
    course = make(saving(package, LAUNCH, TALKER))
    course.run()
    assert course.grading.ended == 2


def test_a_save_while_something_runs_stops_it_and_it_begins_again(make, package) -> None:
    course = make(saving(package, LAUNCH))
    course.grading.during = [lambda: None, lambda: course.saves.save(saving(package, TALKER)())]
    course.run()
    assert (course.grading.begun, course.grading.ended) == (3, 2)
    assert course.screen.words[2:] == [
        f"begin {LAUNCH}", "restart", f"begin {LAUNCH} {TALKER}", f"end {LAUNCH} {TALKER}"
    ]  # fmt: skip


def test_a_save_at_the_end_of_a_run_is_not_overlooked(make, package) -> None:
    course = make()
    course.grading.after = [lambda: course.saves.save(saving(package, LISTENER)())]
    course.run()
    assert course.grading.ended == 2
    assert course.screen.words == ["begin", "restart", f"begin {LISTENER}", f"end {LISTENER}"]


def test_a_change_that_no_poll_found_is_found(make, package) -> None:
    def quietly() -> None:
        saving(package, LAUNCH)()

    course = make(quietly)
    course.run()
    assert course.grading.ended == 2


def test_a_file_saved_as_it_was_runs_nothing(make, package) -> None:
    course = make(lambda: package / TALKER)
    course.run()
    assert course.screen.words == ["begin", "end", f"unchanged {TALKER}"]


def test_what_could_not_be_judged_is_run_again_with_any_save(make, package) -> None:
    course = make(lambda: None, lambda: package / TALKER)
    course.grading.verdicts = {"wraps": Status.INCONCLUSIVE}
    course.run()
    assert course.grading.ended == 2


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
    assert course.screen.ends == []


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

    def fix() -> Path:
        course.grading.error = None
        return write(manifest, sound)

    course = make(spoil, fix)
    assert course.run() is ExitCode.PASSED
    assert [outcome.code for outcome in course.screen.ends] == [0, 3, 0]


def test_it_ends_with_the_error_where_that_was_the_last_result(make, package) -> None:
    course = make()
    course.grading.error = ErrorInfo(kind="submission", message="no", hint="")
    assert course.run() is ExitCode.NOT_GRADED


@pytest.mark.parametrize("error", [FileNotFoundError("gone"), SubmissionError("cannot be read")])
def test_a_file_that_cannot_be_read_for_a_moment_is_read_a_moment_later(error, make, package) -> None:
    failing = [error]

    def look() -> None:
        if failing and course.screen.ends:
            raise failing.pop()

    course = make(saving(package, LAUNCH))
    course.look = look
    assert course.run() is ExitCode.PASSED
    assert course.grading.ended == 2


@pytest.mark.parametrize("leave", [lambda p: p.rename(p.with_name("lab2")), shutil.rmtree])
def test_a_package_folder_that_is_gone_ends_it(leave, make, package, monkeypatch) -> None:
    monkeypatch.setattr(
        "grader.student.watching.GONE_S", 0.05
    )  # made-up saves come at once, so it waits busily
    course = make(lambda: (leave(package), package)[1])
    with pytest.raises(SubmissionError, match="was deleted or renamed"):
        course.run()
