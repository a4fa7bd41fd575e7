"""What the command line can say. Imports nothing heavy: `--help` is quick."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NoReturn

from grader import __version__
from grader.errors import UsageError

EXIT_CODES = """exit codes:
  0    passed: the pass mark is reached (by default every visible criterion)
  1    graded, below the pass mark
  2    the command line or a rubric is wrong
  3    could not be graded
  4    inconclusive: a criterion could not be judged
  130  interrupted
"""


CLASS_EXIT_CODES = """exit codes, that of the worst submission:
  0    all passed
  1    all graded, not all passed
  2    the command line, the roster, the rubric or overrides.yaml is wrong
  3    some could not be graded
  4    some are inconclusive, or wait for a person
  130  interrupted: the same command goes on
"""


MUTANTS_EXIT_CODES = """exit codes:
  0    the correct package got everything, and every mutant lost what it must, and no more
  1    it did not, or a mutant was not killed, or a criterion is worth points and costs no mutant anything
  2    the command line, the rubric or the mutants file is wrong
  3    nothing could be graded here
  130  interrupted
"""

REPORT_EXIT_CODES = """exit codes:
  0    written, whatever the result is
  2    the command line or a rubric is wrong
  3    a result cannot be read, or is none that can be shown in this form
  130  interrupted
"""
FORMS = ("html", "markdown", "terminal", "junit", "sarif", "code-quality", "annotations", "gradescope")


class Parser(argparse.ArgumentParser):
    """argparse, with its errors as ours: one line and exit code 2."""

    def error(self, message: str) -> NoReturn:
        """Raise UsageError."""
        raise UsageError(message, hint=f"see {self.prog} --help")


def build_parser() -> argparse.ArgumentParser:
    """The whole command line. Each command sets `module`, and its options are its function's keywords."""
    common = _common()
    parser = Parser(
        prog="grader",
        description="Grades introductory ROS 1 labs.",
        epilog=EXIT_CODES,
        parents=[common],
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"grader {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, title="commands", parser_class=Parser)
    adder = _Adder(commands, common)
    _grading(adder)
    _class(adder)
    _evidence(adder)
    _authoring(adder)
    return parser


def _common() -> Parser:
    common = Parser(add_help=False)
    common.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show tracebacks of errors"
    )
    return common


class _Adder:
    """Adds commands that are made alike."""

    def __init__(self, commands: argparse._SubParsersAction[Parser], common: Parser) -> None:
        self.commands = commands
        self.common = common

    def __call__(self, name: str, text: str, module: str = "") -> argparse.ArgumentParser:
        parser = self.commands.add_parser(
            name,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog=EXIT_CODES,
            parents=[self.common],
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.set_defaults(module=module or name)
        return parser


def _grading(add: _Adder) -> None:
    grade = add("grade", "grade one submission: a folder, a .zip or .tar.*, a git URL with @ref, a .bag")
    grade.add_argument("source", metavar="SOURCE")
    _rubric(grade, required=True)
    _out(grade, "results go to DIR/<submission id>/ (default: ./grader-results)")
    grade.add_argument("--id", metavar="NAME", dest="submission_id", help="the submission's id")
    _sandbox(grade)
    _json(grade)

    check = add("check", "check your own package before handing it in")
    check.add_argument("path", metavar="PATH", nargs="?", default=".", help="default: this folder")
    _rubric(check, required=False)
    check.add_argument("--static", action="store_true", help="look at the files only, run nothing")
    check.add_argument(
        "--watch", action="store_true", help="stay, and run again what a saved file concerns, until Ctrl-C"
    )
    _out(check, "keep the results in DIR/<submission id>/ (default: they are only shown)")
    _sandbox(check)
    _json(check)


def _class(add: _Adder) -> None:
    _batch(add("batch", "grade a class, and go on where an earlier batch stopped"))
    _regrade(add("regrade", "judge a class again from its evidence; nothing is run, needs no ROS"))
    _gradebook(add("gradebook", "write a class's gradebook for people, programs or a learning platform"))
    _report(add("report", "write the reports of a result or of a class again; needs no ROS"))
    _review(add("review", "look at a class in the browser: give points, decide otherwise, comment"))
    _similar(add("similar", "name submissions that are nearly the same, for a person; never a mark"))


def _batch(batch: argparse.ArgumentParser) -> None:
    batch.epilog = CLASS_EXIT_CODES
    batch.add_argument(
        "roster",
        metavar="ROSTER|FOLDER",
        type=Path,
        help="a CSV file (id,source,...), a folder of submissions, an export of GitHub Classroom or GitLab",
    )
    _rubric(batch, required=True)
    _out(batch, "results go to DIR/<id>/, with gradebook.csv and results.jsonl (default: ./grader-results)")
    batch.add_argument(
        "--jobs",
        metavar="N",
        type=_count,
        help="how many side by side (default: four a core, static ones one)",
    )
    batch.add_argument(
        "--only",
        metavar="WHICH",
        nargs="+",
        default=[],
        help="failed, inconclusive, changed, or ids: these once more, all others stay",
    )
    batch.add_argument(
        "--before", metavar="TIME", help="the last commit before it counts (default: the rubric's deadline)"
    )
    batch.add_argument("--static", action="store_true", help="look at the files only, run nothing")
    batch.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="hand the submissions to a Dask cluster: tcp://HOST:8786, or local",
    )
    batch.add_argument(
        "--exchange",
        metavar="URL",
        help="where a cluster's workers leave results (default: in the folder of --out)",
    )
    _sandbox(batch)
    _json(batch)


def _regrade(regrade: argparse.ArgumentParser) -> None:
    regrade.epilog = CLASS_EXIT_CODES
    regrade.add_argument("folder", metavar="DIR", type=Path, help="the --out of `grader batch`")
    _rubric(regrade, required=False)
    regrade.add_argument(
        "--run-missing",
        action="store_true",
        dest="run_missing_too",
        help="run the submissions of which a scenario was not recorded",
    )
    regrade.add_argument("--jobs", metavar="N", type=_count, help="how many side by side")
    _sandbox(regrade)
    _json(regrade)


def _gradebook(book: argparse.ArgumentParser) -> None:
    book.add_argument("folder", metavar="DIR", type=Path, help="the --out of `grader batch`")
    book.add_argument(
        "--form",
        choices=("csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"),
        required=True,
        help="what it is for; canvas, moodle and blackboard import theirs",
    )
    book.add_argument(
        "--out", metavar="FILE", default="", help="where it goes; - is stdout (default: into DIR)"
    )
    book.add_argument(
        "--template", metavar="FILE", type=Path, help="the platform's own export: our points are filled in"
    )
    book.add_argument(
        "--column", metavar="NAME", default="", help="what the platform calls the column of points"
    )
    book.add_argument("--per-criterion", action="store_true", help="a column for each criterion")


def _review(review: argparse.ArgumentParser) -> None:
    review.add_argument("folder", metavar="DIR", type=Path, help="the --out of `grader batch`")
    review.add_argument(
        "--port", metavar="N", type=_port, default=0, help="the page's port (default: any that is free)"
    )
    review.add_argument("--no-browser", action="store_true", help="only print the address")
    review.add_argument(
        "--author", metavar="NAME", help="who decides (default: git config user.name); the page can change it"
    )


def _similar(similar: argparse.ArgumentParser) -> None:
    similar.add_argument("folder", metavar="DIR", type=Path, help="the --out of `grader batch`")
    similar.add_argument(
        "--starter",
        metavar="PATH",
        action="append",
        default=[],
        type=Path,
        help="code that everybody was given: a folder, an archive or a program; may be given several times",
    )
    similar.add_argument(
        "--threshold",
        metavar="PERCENT",
        type=_percent,
        default=80.0,
        help="how much of one's own code must be in the other's (default: 80)",
    )
    _json(similar)


def _report(report: argparse.ArgumentParser) -> None:
    report.epilog = REPORT_EXIT_CODES
    report.add_argument(
        "folder",
        metavar="DIR",
        type=Path,
        help="a submission's folder of results, or the --out of `grader batch`",
    )
    _rubric(report, required=False)
    report.add_argument(
        "--form", choices=FORMS, default="", help="this one alone (default: all files of DIR)"
    )
    report.add_argument("--out", metavar="FILE", default="", help="where that one goes (default: -, stdout)")
    report.add_argument(
        "--prefix",
        metavar="PATH",
        help="the package's folder in the repository, for lines of files (default: looked for here)",
    )
    report.add_argument("--student", action="store_true", help="leave hidden criteria out of that one")
    report.add_argument(
        "--anonymous", metavar="FILE", type=Path, help="write the class's page without names there, too"
    )


def _evidence(add: _Adder) -> None:
    judge = add("judge", "judge recorded evidence again; needs no ROS")
    judge.add_argument(
        "evidence",
        metavar="EVIDENCE",
        nargs="+",
        type=Path,
        help=".mcap and .bag files, or folders of them; of a folder of results, every submission in it",
    )
    _rubric(judge, required=True)
    judge.add_argument(
        "--out", metavar="FILE", default="-", help="where the criteria go as JSON (default: -)"
    )
    judge.add_argument(
        "--jobs", metavar="N", type=_count, help="how many submissions side by side (default: one a core)"
    )

    record = add("record", "record evidence without grading")
    record.add_argument("source", metavar="SOURCE")
    _rubric(record, required=False)
    record.add_argument("--package", metavar="NAME", help="the package, where there are several")
    record.add_argument("--script", metavar="FILE", action="append", default=[], help="a script to run")
    record.add_argument("--launch", metavar="FILE", action="append", default=[], help="a launch file to run")
    record.add_argument("--seconds", metavar="N", type=float, default=10.0, help="how long (default: 10)")
    _out(record, "evidence goes to DIR/<submission id>/evidence/", required=True)
    _sandbox(record)

    export = add("export", "write recorded evidence in another form")
    forms = export.add_subparsers(metavar="FORM", required=True, title="forms", parser_class=Parser)
    bag = _Adder(forms, add.common)("bag", "write recorded evidence as a ROS 1 bag", "export_bag")
    bag.add_argument("evidence", metavar="EVIDENCE", type=Path, help="a recording, or a folder of them")
    bag.add_argument("--out", metavar="FILE", type=Path, help="the bag, or a folder (default: here)")
    bag.add_argument(
        "--all", action="store_true", dest="everything", help="the grader's own records too, as JSON text"
    )

    inspect = add("inspect", "say what is in an evidence file or a bag: rates, gaps, nodes")
    inspect.add_argument("file", metavar="FILE", type=Path)
    _json(inspect)


def _authoring(add: _Adder) -> None:
    _json(add("labs", "list the rubrics that come with the grader"))
    explain = add("explain", "explain a check or a criterion: what, why, how it is measured, how to fix")
    explain.add_argument("name", metavar="NAME", help="a check, a criterion, or LAB/criterion")
    _rubric(explain, required=False)
    _json(add("doctor", "say what this machine can and cannot do, and what mends it"))

    rubric = add("rubric", "work on rubrics")
    parts = rubric.add_subparsers(metavar="COMMAND", required=True, title="commands", parser_class=Parser)
    inner = _Adder(parts, add.common)
    validate = inner("validate", "check rubric files; every fault is named", "rubric_validate")
    validate.add_argument("files", metavar="FILE", nargs="+")
    schema = inner("schema", "print the JSON Schema of rubrics, for editors", "rubric_schema")
    _rubric(schema, required=False)
    new = inner("new", "write a first rubric from a run of a correct package", "rubric_new")
    new.add_argument(
        "--from", metavar="SOLUTION", dest="solution", required=True, help="a folder, archive or git URL"
    )
    new.add_argument("--package", metavar="NAME", help="the package, where there are several")
    new.add_argument(
        "--id", metavar="NAME", dest="rubric_id", help="the rubric's id (default: from FILE or the package)"
    )
    new.add_argument("--out", metavar="FILE", default="-", help="where it goes (default: -)")
    new.add_argument("--force", action="store_true", help="write over a file that exists")
    _sandbox(new)
    test = inner("test", "grade a correct package, then mutants of it that must lose marks", "rubric_test")
    test.epilog = MUTANTS_EXIT_CODES
    _mutants(test)


def _mutants(test: argparse.ArgumentParser) -> None:
    test.add_argument("rubric", metavar="LAB|FILE")
    test.add_argument(
        "--solution", metavar="DIR", type=Path, help="a correct package (default: the lab's own)"
    )
    test.add_argument(
        "--only",
        metavar="MUTANT",
        nargs="+",
        default=[],
        help="these mutants, or these operators; * is allowed",
    )
    test.add_argument(
        "--jobs", metavar="N", type=_count, default=4, help="how many side by side (default: 4)"
    )
    _out(test, "keep everything in DIR/<mutant>/ (default: only what was not killed, in a temporary folder)")
    test.add_argument(
        "--write",
        metavar="FILE",
        type=Path,
        help="try every operator and write a mutants file from what it cost",
    )
    _sandbox(test)
    _json(test)


def _percent(text: str) -> float:
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = 0.0
    if not 1 <= number <= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage from 1 to 100")
    return number


def _port(text: str) -> int:
    number = int(text) if text.isascii() and text.isdecimal() else -1
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port from 1 to 65535")
    return number


def _count(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if not 1 <= number <= 64:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 64")
    return number


def _rubric(parser: argparse.ArgumentParser, *, required: bool) -> None:
    parser.add_argument("--rubric", metavar="ID|FILE", required=required, help="see grader labs")


def _out(parser: argparse.ArgumentParser, text: str, *, required: bool = False) -> None:
    parser.add_argument("--out", metavar="DIR", type=Path, required=required, help=text)


def _sandbox(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sandbox",
        choices=("auto", "require", "none"),
        default="auto",
        help="shut the student's code in: where possible, always, or not at all",
    )


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", dest="as_json", help="print JSON")
