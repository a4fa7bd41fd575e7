"""The commands for a whole class."""

from __future__ import annotations

import argparse
from pathlib import Path

from grader.cli.parsing.base import Adder
from grader.cli.parsing.exit_codes import CLASS_EXIT_CODES
from grader.cli.parsing.options import (
    count,
    json_option,
    out_option,
    percent,
    port,
    rubric_option,
    sandbox_option,
)
from grader.cli.parsing.reports import add_report


def add_classes(add: Adder) -> None:
    """Add `batch` and what works on its `--out`."""
    _batch(add("batch", "grade a class, and go on where an earlier batch stopped"))
    _regrade(add("regrade", "judge a class again from its evidence; nothing is run, needs no ROS"))
    _gradebook(add("gradebook", "write a class's gradebook for people, programs or a learning platform"))
    add_report(add("report", "write the reports of a result or of a class again; needs no ROS"))
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
    rubric_option(batch, required=True)
    out_option(
        batch, "results go to DIR/<id>/, with gradebook.csv and results.jsonl (default: ./grader-results)"
    )
    batch.add_argument(
        "--jobs",
        metavar="N",
        type=count,
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
    batch.add_argument(
        "--allow-local",
        metavar="DIR",
        action="append",
        default=[],
        type=Path,
        help="the roster may name paths below it, too, not only below its own folder; may be given several times",
    )
    batch.add_argument(
        "--remote-only", action="store_true", help="the roster may name no path of this machine at all"
    )
    batch.add_argument("--static", action="store_true", help="look at the files only, run nothing")
    batch.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="hand the submissions to a Dask cluster: tls://HOST:8786, or local",
    )
    batch.add_argument(
        "--cluster-insecure",
        action="store_true",
        help="take a cluster without certificates (tcp://): all who reach it can run programs there",
    )
    batch.add_argument(
        "--exchange",
        metavar="URL",
        help="where a cluster's workers leave results (default: in the folder of --out)",
    )
    sandbox_option(batch)
    json_option(batch)


def _regrade(regrade: argparse.ArgumentParser) -> None:
    regrade.epilog = CLASS_EXIT_CODES
    regrade.add_argument("folder", metavar="DIR", type=Path, help="the --out of `grader batch`")
    rubric_option(regrade, required=False)
    regrade.add_argument(
        "--run-missing",
        action="store_true",
        dest="run_missing_too",
        help="run the submissions of which a scenario was not recorded",
    )
    regrade.add_argument("--jobs", metavar="N", type=count, help="how many side by side")
    sandbox_option(regrade)
    json_option(regrade)


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
        "--port", metavar="N", type=port, default=0, help="the page's port (default: any that is free)"
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
        type=percent,
        default=80.0,
        help="how much of one's own code must be in the other's (default: 80)",
    )
    json_option(similar)
