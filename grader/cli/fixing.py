"""`grader check --fix`: what is mechanical in a package is shown as a diff, and repaired if the student agrees.

Never what a program does: a missing call, a bracket or Python 2 is for the student to find.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from stat import S_IMODE

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from grader.authoring.mutation.solution import read_tree, unified_diff
from grader.cli.output import say
from grader.cli.select_rubric import Chosen
from grader.errors import OutputError, UsageError
from grader.files import temporary_folder
from grader.intake.open import open_submission
from grader.model.package import PackageFacts
from grader.model.repair import Repair
from grader.model.submission import Submission
from grader.package.facts import read_packages
from grader.package.repairs import NotRepairable, apply_repair, find_repairs, wanted_of
from grader.package.repairs.editing import is_executable, naming_files, read_data
from grader.pipeline import wanted_package
from grader.portable import MODES_ON_DISK
from grader.report.terminal import emit, open_console
from grader.report.text import line

LINE_CHARS = 300
FIXED = frozenset(
    {"executable-bit", "encoding", "byte-order-mark", "line-ends", "shebang", "file-name", "package-name"}
    | {"launch-type", "node-name", "topic-name", "service-name", "parameter-name"}
)
STYLES = (("diff ", "bold"), ("---", "bold"), ("+++", "bold"), ("@@", "cyan"), ("+", "green"), ("-", "red"))


def fix_packages(chosen: Sequence[Chosen], *, dry_run: bool, yes: bool) -> bool:
    """Show what can be repaired in each package, and repair it unless it is a `dry_run` or the student says no. Return
    whether there was anything.

    Raises UsageError where the lab forbids it, or nobody can be asked.
    """
    for one in chosen:
        if one.rubric.rubric.fixes == "none":
            raise UsageError(
                "This lab asks you to fix mistakes yourself",
                hint="leave out --fix; grader explain CRITERION says how each repair is done",
            )
    # both: an answer is typed, and the question has to be seen
    if not (dry_run or yes or (sys.stdin.isatty() and sys.stdout.isatty())):
        raise UsageError(
            "--fix asks before it changes your files, and there is no terminal to ask on",
            hint="add --dry-run to see the changes, or --yes to make them without being asked",
        )
    found = [_fix_package(one, dry_run=dry_run, yes=yes) for one in chosen]
    return any(found)


def _fix_package(chosen: Chosen, *, dry_run: bool, yes: bool) -> bool:
    rubric = chosen.rubric.rubric
    with temporary_folder("source") as work:
        submission = _submission(chosen, work)
        read = read_packages(submission, ())
        found: dict[Path, list[Repair]] = {}
        of_git: list[Repair] = []
        packages = (submission.package, *submission.also)
        for package, facts in zip(packages, (read, *read.also), strict=True):
            known = find_repairs(package.folder, facts, wanted_of(rubric, package.asked))
            fixed = [one for one in known if is_fixed(package.folder, one)]
            found[package.folder] = [*_bits_of_git(package.folder, facts), *fixed]
            bits = (one for one in known if one.kind == "executable-bit" and one not in fixed)
            of_git += [one for one in bits if is_executable(package.folder, one.file)]
        found = {folder: repairs for folder, repairs in found.items() if repairs}
        for number, (folder, repairs) in enumerate(found.items()):
            preview = work / f"preview-{number}"
            emit(open_console(sys.stdout), _parts(repairs, _diff(folder, repairs, preview)))
        for one in of_git:
            say(f"{one.file} is executable on this disk but not in git: {one.fix}")
        if not found and not of_git:
            say("There is nothing here that --fix repairs.")
    if found and not dry_run and (yes or _ask_agreement(sum(map(len, found.values())))):
        for folder, repairs in found.items():
            for repair in repairs:
                _apply(folder, repair)
    return bool(found)


def _bits_of_git(folder: Path, facts: PackageFacts) -> Iterator[Repair]:
    """Yield the bits of scripts that git has and this disk has not: no mark is lost by them, but nothing runs here."""
    for file in facts.files if MODES_ON_DISK else ():
        is_script = file.shebang is not None and file.link is None and file.mode_source == "git"
        if is_script and file.executable and not is_executable(folder, file.path):
            what = f"{file.path} is executable in git but not on this disk"
            yield Repair(kind="executable-bit", file=file.path, message=what, fix=f"chmod +x {file.path}")


def _submission(chosen: Chosen, work: Path) -> Submission:
    """Return what is in the student's own folder. Raises UsageError for an archive or an address."""
    submission = None
    if Path(chosen.source).is_dir():
        wanted = wanted_package(chosen.rubric.rubric, "")
        submission = open_submission(chosen.source, package=wanted, workdir=work)
    # what was unpacked or cloned lies in our own folder: a repair there would be lost
    if submission is None or submission.package.folder.resolve().is_relative_to(work.resolve()):
        raise UsageError(
            f"{chosen.source} is not a folder on your disk", hint="give your package's folder to --fix"
        )
    return submission


def is_fixed(folder: Path, repair: Repair) -> bool:
    """Return whether `--fix` makes this repair: of Python, the indentation alone, and no bit that git alone lacks."""
    if repair.kind == "executable-bit":
        return MODES_ON_DISK and not is_executable(folder, repair.file)
    # as they are without their indentation: if that makes them equal, nothing but it changes
    lines = [[row.lstrip(" \t") for row in text.split("\n")] for text in (repair.before, repair.after)]
    tabs = repair.kind == "python-syntax" and "\t" in repair.before and lines[0] == lines[1]
    return tabs or repair.kind in FIXED


def _diff(folder: Path, repairs: Sequence[Repair], preview: Path) -> str:
    """Return what the repairs change as a unified diff, made on copies of the files that they touch."""
    files = {*naming_files(folder), *(repair.file for repair in repairs)}
    preview.mkdir()
    for file in sorted(files):
        source = folder / file
        # a link is not copied: what it points to may be outside the package
        if source.is_symlink() or not source.is_file():
            continue
        copy = preview / file
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(read_data(folder, file) or b"")
        # the copies must be written to
        copy.chmod(S_IMODE(source.stat().st_mode) | 0o600)
    before = read_tree(preview)
    for repair in repairs:
        _apply(preview, repair)
    return unified_diff(before, read_tree(preview))


def _apply(folder: Path, repair: Repair) -> None:
    try:
        apply_repair(folder, repair)
    except NotRepairable as error:
        raise UsageError(f"{error}", hint="run it again") from error
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise OutputError(f"cannot change {repair.file}: {reason}", hint="see who owns the file") from error


def _parts(repairs: Sequence[Repair], diff: str) -> Iterator[RenderableType]:
    yield Text("What --fix repairs:", "bold")
    for repair in repairs:
        yield Padding(Text(line(repair.message, LINE_CHARS)), (0, 0, 0, 2))
    yield Text("")
    for row in diff.splitlines():
        yield Text(
            line(row, LINE_CHARS), next((style for start, style in STYLES if row.startswith(start)), "")
        )
    yield Text("")


def _ask_agreement(count: int) -> bool:
    words = "this change" if count == 1 else f"these {count} changes"
    try:
        answer = input(f"Make {words}? [y/N] ")
    except EOFError:
        answer = ""
    if answer.strip().lower() in ("y", "yes"):
        return True
    say("Nothing was changed.")
    return False
