"""The commands for a whole course: grade and publish its labs, see how far they are, and write its gradebook."""

from pathlib import Path
from typing import Annotated

from grader.cli.declare import (
    CLASS_EXIT_CODES,
    INSTRUCTORS,
    PUBLISH_EXIT_CODES,
    STATIC,
    Argument,
    AuthorOption,
    BookColumn,
    BookForm,
    BookTemplate,
    DraftsFlag,
    Flag,
    JobsOption,
    JsonFlag,
    LocalOption,
    OnlyOption,
    Option,
    SandboxOption,
    command,
    loading,
)
from grader.errors import ExitCode

COURSE = Argument("COURSE", "the course's file, course.yaml")
LAB = Argument("NAME", "the lab's name in that file")


@command("course status", group=INSTRUCTORS)
def status(*, course: Annotated[Path, COURSE], as_json: JsonFlag = False) -> ExitCode:
    """List the labs of a course: what is graded, open, published and sent, and the next command for each."""
    with loading():
        from grader.cli import classes
    return classes.print_status(course, as_json=as_json)


@command("course grade", group=INSTRUCTORS, exit_codes=CLASS_EXIT_CODES, runs_code=True)
def grade(
    *,
    course: Annotated[Path, COURSE],
    lab: Annotated[str, LAB],
    jobs: JobsOption = None,
    only: OnlyOption = (),
    allow_local: LocalOption = (),
    static: Annotated[bool, STATIC] = False,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Grade one lab of a course as `grader batch` does, with the deadline, late policy and attempts of the course.

    The same command continues one that was stopped.
    """
    with loading():
        from grader.cli import classes
    return classes.grade_lab(
        course,
        lab,
        jobs=jobs,
        only=only,
        allow_local=allow_local,
        static=static,
        sandbox=sandbox,
        as_json=as_json,
    )


@command("course publish", group=INSTRUCTORS, exit_codes=PUBLISH_EXIT_CODES)
def publish(
    *,
    course: Annotated[Path, COURSE],
    lab: Annotated[str, LAB],
    dry_run: Annotated[bool, Flag("--dry-run", "only show what would be published and sent")] = False,
    author: AuthorOption = None,
) -> ExitCode:
    """Publish one lab of a course, and return it to the students by the course's form of feedback."""
    with loading():
        from grader.cli import classes
    return classes.publish_lab(course, lab, dry_run=dry_run, author=author)


@command("course gradebook", group=INSTRUCTORS)
def gradebook(
    *,
    course: Annotated[Path, COURSE],
    form: BookForm,
    out: Annotated[
        str, Option("--out", "FILE", "where to write it; - is stdout (default: beside the course file)")
    ] = "",
    template: BookTemplate = None,
    column: BookColumn = "",
    per_lab: Annotated[bool, Flag("--per-lab", "add a column for each lab, on a platform")] = False,
    drafts: DraftsFlag = False,
) -> ExitCode:
    """Write a course's gradebook: each lab's points, and 0 to 100 for all labs by their weights.

    It has what is published; of a lab of which nothing is published, it has results as they are now, and says so.
    """
    with loading():
        from grader.cli import classes
    wanted = classes.WantedBook(
        form=form, out=out, template=template, column=column, wide=per_lab, drafts=drafts
    )
    return classes.write_course_gradebook(course, wanted)
