"""The commands for those who write labs."""

from __future__ import annotations

import argparse
from pathlib import Path

from grader.cli.parsing.base import Adder, Parser
from grader.cli.parsing.exit_codes import MUTANTS_EXIT_CODES
from grader.cli.parsing.options import count, json_option, out_option, rubric_option, sandbox_option


def add_authoring(add: Adder) -> None:
    """Add `labs`, `example`, `explain`, `doctor` and `rubric`."""
    json_option(add("labs", "list the rubrics that come with the grader"))
    _example(add("example", "write a lab's correct package to try things with, or one with a mistake in it"))
    explain = add("explain", "explain a check or a criterion: what, why, how it is measured, how to fix")
    explain.add_argument("name", metavar="NAME", help="a check, a criterion, or LAB/criterion")
    rubric_option(explain, required=False)
    json_option(add("doctor", "say what this machine can and cannot do, and what mends it"))

    rubric = add("rubric", "work on rubrics")
    parts = rubric.add_subparsers(metavar="COMMAND", required=True, title="commands", parser_class=Parser)
    inner = Adder(parts, add.common)
    validate = inner("validate", "check rubric files; every fault is named", "rubric_validate")
    validate.add_argument("files", metavar="FILE", nargs="+")
    schema = inner("schema", "print the JSON Schema of rubrics, for editors", "rubric_schema")
    rubric_option(schema, required=False)
    copy = inner("copy", "write the rubric of a lab that comes with the grader, to change it", "rubric_copy")
    copy.add_argument("lab", metavar="LAB", help="see grader labs")
    copy.add_argument("--out", metavar="FILE", default="-", help="where it goes (default: -)")
    copy.add_argument("--force", action="store_true", help="write over a file that exists")
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
    sandbox_option(new)
    test = inner("test", "grade a correct package, then mutants of it that must lose marks", "rubric_test")
    test.epilog = MUTANTS_EXIT_CODES
    _mutants(test)


def _example(example: argparse.ArgumentParser) -> None:
    example.add_argument("lab", metavar="LAB", help="see grader labs")
    example.add_argument(
        "folder",
        metavar="DIR",
        nargs="?",
        type=Path,
        help="an empty or new folder (default: list the mistakes that --mistake knows, and what they cost)",
    )
    example.add_argument("--mistake", metavar="NAME", help="with this mistake of students' in it")


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
    test.add_argument("--jobs", metavar="N", type=count, default=4, help="how many side by side (default: 4)")
    out_option(
        test, "keep everything in DIR/<mutant>/ (default: only what was not killed, in a temporary folder)"
    )
    test.add_argument(
        "--write",
        metavar="FILE",
        type=Path,
        help="try every operator and write a mutants file from what it cost",
    )
    sandbox_option(test)
    json_option(test)
