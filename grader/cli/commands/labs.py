"""The commands for labs and their rubrics."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.cli.commands.grading import PACKAGE
from grader.cli.declare import (
    INSTRUCTORS,
    MUTANTS_EXIT_CODES,
    RUBRIC,
    STDOUT,
    Argument,
    Flag,
    JsonFlag,
    Option,
    SandboxOption,
    command,
    count,
    loading,
)
from grader.errors import ExitCode, RubricError, UsageError

OUT = Option("--out", "FILE", "where to write it (default: -, stdout)")
FORCE = Flag("--force", "overwrite an existing file")
LAB = Argument("LAB", "see grader labs")


@command("labs", group=INSTRUCTORS)
def labs(
    *,
    add: Annotated[
        Path | None, Option("--add", "DIR", "also look for labs in this folder, from now on")
    ] = None,
    remove: Annotated[Path | None, Option("--remove", "DIR", "do not look there any more")] = None,
    examples: Annotated[
        bool, Flag("--examples", "list the examples of rubrics that come with the grader")
    ] = False,
    as_json: JsonFlag = False,
) -> ExitCode:
    """List the labs that are known here, and where each comes from.

    Those are the grader's own, and rubrics in the folders that --add has named or $GRADER_RUBRICS lists.
    """
    with loading():
        from grader.cli.labs import labs_data, print_labs
        from grader.cli.output import say, say_json
        from grader.rubric.find import add_folder, example_labs, known_labs, own_folders, remove_folder
        from grader.rubric.load import load_rubric
    if add is not None:
        say(f"{add_folder(add)}: its labs are known from now on")
    if remove is not None:
        say(f"{remove_folder(remove)}: its labs are no longer known")
    if add is not None or remove is not None:
        return ExitCode.PASSED
    rows, faulty = [], [f"{folder} is not there" for folder in own_folders() if not folder.is_dir()]
    for lab in example_labs() if examples else known_labs():
        try:
            rows.append((load_rubric(str(lab.path)).rubric, lab.source))
        except RubricError:  # noqa: PERF203 - one that is faulty hides no other
            faulty.append(f"{lab.path} is faulty: grader rubric validate {lab.path}")
    if as_json:
        say_json(labs_data(rows))
        return ExitCode.PASSED
    print_labs(rows, sys.stdout)
    for line in faulty:
        say(line)
    return ExitCode.PASSED


@command("example", group=INSTRUCTORS)
def example(
    *,
    lab: Annotated[str, LAB],
    folder: Annotated[
        Path | None,
        Argument("DIR", "a new or empty folder (default: list the names for --mistake, and what each costs)"),
    ] = None,
    mistake: Annotated[str | None, Option("--mistake", "NAME", "with this mistake of students in it")] = None,
) -> ExitCode:
    """Write a lab's correct package to try things with, or one with a mistake."""
    with loading():
        from grader.cli.labs import list_mistakes, write_example
    if folder is not None:
        write_example(lab, folder, mistake)
    elif mistake is None:
        list_mistakes(lab)
    else:
        raise UsageError(
            "--mistake needs a folder to write to", hint=f"grader example {lab} DIR --mistake {mistake}"
        )
    return ExitCode.PASSED


@command("rubric validate", group=INSTRUCTORS)
def validate_rubrics(*, files: Annotated[Sequence[str], Argument("FILE", "rubric files")]) -> ExitCode:
    """Check rubric files, and name every fault.

    It warns of what may be meant and may be a slip: a name that one line alone has, two criteria that judge the same,
    a time that a busy machine exceeds.
    """
    with loading():
        from grader.cli.output import say
        from grader.rubric.load import load_rubric, warnings_of
        from grader.wording import number
    faults, hint = [], ""
    for file in files:
        try:
            loaded = load_rubric(file)
        except RubricError as error:  # noqa: PERF203 - each file has its own
            faults += error.faults
            hint = hint or error.hint
        else:
            rubric, points = loaded.rubric, number(loaded.rubric.max_points)
            say(f"{file}: ok, {rubric.id}, {len(rubric.criteria)} criteria, {points} points")
            say(f"  digest {loaded.digest}")
            for warning in warnings_of(loaded, file):
                say(f"  warning: {warning}")
    if faults:
        raise RubricError(faults, hint=hint)
    return ExitCode.PASSED


@command("rubric schema", group=INSTRUCTORS)
def print_rubric_schema(*, rubric: Annotated[str | None, RUBRIC] = None) -> ExitCode:
    """Print the JSON Schema of rubrics, for editors.

    With a rubric, its own checks are part of it.
    """
    with loading():
        from grader.cli.output import say_json
        from grader.rubric.load import load_rubric
        from grader.rubric.schema import rubric_schema
    checks = load_rubric(rubric).checks if rubric is not None else None
    say_json(rubric_schema(checks))
    return ExitCode.PASSED


@command("rubric copy", group=INSTRUCTORS)
def copy_rubric(
    *, lab: Annotated[str, LAB], out: Annotated[str, OUT] = STDOUT, force: Annotated[bool, FORCE] = False
) -> ExitCode:
    """Write the rubric of a lab that comes with the grader, to change it."""
    with loading():
        from grader.rubric.load import load_rubric
    path = load_rubric(lab).path
    _refuse_existing(out, force=force)
    _write(
        out, path.read_bytes().decode("utf-8"), f"{out}: change it, then run `grader rubric validate {out}`"
    )
    return ExitCode.PASSED


@command("rubric new", group=INSTRUCTORS, runs_code=True)
def new_rubric(
    *,
    solution: Annotated[str, Option("--from", "SOLUTION", "a folder, an archive or a git URL")],
    package: Annotated[str | None, PACKAGE] = None,
    rubric_id: Annotated[
        str | None, Option("--id", "NAME", "the rubric's id (default: from FILE or the package)")
    ] = None,
    out: Annotated[str, OUT] = STDOUT,
    force: Annotated[bool, FORCE] = False,
    sandbox: SandboxOption = "auto",
) -> ExitCode:
    """Write a first rubric from a run of a correct package."""
    with loading():
        from grader import pipeline
        from grader.authoring.propose import propose_rubric
        from grader.cli.display import open_progress
        from grader.cli.host_support import warn_without_sandbox
        from grader.cli.labs import rubric_id_from
        from grader.cli.select_rubric import only_package
    name = package or only_package(solution)
    chosen = rubric_id or rubric_id_from(Path(out).stem if out != STDOUT else name)
    _refuse_existing(out, force=force)
    options = pipeline.GradeOptions(sandbox=sandbox)
    warn_without_sandbox(sandbox)
    with open_progress() as progress:
        text = propose_rubric(solution, name, chosen, options, progress)
    _write(
        out,
        text,
        f"{out}: look through it, then run `grader rubric validate {out}`",
        f"and `grader rubric test {out} --solution {solution}`",
    )
    return ExitCode.PASSED


@command("rubric test", group=INSTRUCTORS, exit_codes=MUTANTS_EXIT_CODES, runs_code=True)
def run_rubric_test(
    *,
    rubric: Annotated[str, Argument("LAB|FILE", "a lab's id or a rubric's file")],
    solution: Annotated[
        Path | None, Option("--solution", "DIR", "a correct package (default: the lab's own)")
    ] = None,
    only: Annotated[
        Sequence[str], Option("--only", "MUTANT", "only these mutants or operators; * is a wildcard")
    ] = (),
    jobs: Annotated[int, Option("--jobs", "N", "how many at a time (default: 4)", count)] = 4,
    out: Annotated[
        Path | None,
        Option(
            "--out",
            "DIR",
            "keep everything in DIR/<mutant>/ (default: only what survived, in a temporary folder)",
        ),
    ] = None,
    write: Annotated[
        Path | None,
        Option("--write", "FILE", "try every operator, and write a mutants file with what each costs"),
    ] = None,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Grade a correct package, then mutants of it that must lose marks."""
    with loading():
        from grader.cli import labs as shown
        from grader.cli.host_support import require_room, warn_without_sandbox
        from grader.cli.output import say_json
    require_room(gradings=jobs)
    plan = shown.plan_test(rubric, solution, only=only, jobs=jobs, out=out, everything=write, sandbox=sandbox)
    warn_without_sandbox(sandbox, plan.rubric)
    tested = shown.run_plan(plan, temporary=out is None)
    # what mutants of a package that is not correct cost says nothing
    if write is not None and not tested.reference.lost:
        shown.write_mutants(plan, tested, write)
    if as_json:
        say_json(tested.model_dump(mode="json", by_alias=True))
    else:
        shown.print_test(tested, sys.stdout)
    return ExitCode.PASSED if tested.passed else ExitCode.BELOW_PASS_MARK


def _refuse_existing(out: str, *, force: bool) -> None:
    if out != STDOUT and Path(out).exists() and not force:
        raise UsageError(f"{out} exists", hint="choose another --out, or add --force")


def _write(out: str, text: str, *next_steps: str) -> None:
    from grader.cli.output import say, write_document

    write_document(out, lambda _: text, public=True)
    for step in next_steps if out != STDOUT else ():
        say(step)
