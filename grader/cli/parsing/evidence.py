"""The commands for recorded evidence."""

from __future__ import annotations

from pathlib import Path

from grader.cli.parsing.base import Adder, Parser
from grader.cli.parsing.options import count, json_option, out_option, rubric_option, sandbox_option
from grader.cli.parsing.platforms import add_platforms


def add_evidence(add: Adder) -> None:
    """Add `judge`, `record`, `export` and `inspect`."""
    judge = add("judge", "judge recorded evidence again; needs no ROS")
    judge.add_argument(
        "evidence",
        metavar="EVIDENCE",
        nargs="+",
        type=Path,
        help=".mcap and .bag files, or folders of them; of a folder of results, every submission in it",
    )
    rubric_option(judge, required=True)
    judge.add_argument(
        "--out", metavar="FILE", default="-", help="where the criteria go as JSON (default: -)"
    )
    judge.add_argument(
        "--jobs", metavar="N", type=count, help="how many submissions side by side (default: one a core)"
    )

    record = add("record", "record evidence without grading")
    record.add_argument("source", metavar="SOURCE")
    rubric_option(record, required=False)
    record.add_argument("--package", metavar="NAME", help="the package, where there are several")
    record.add_argument("--script", metavar="FILE", action="append", default=[], help="a script to run")
    record.add_argument("--launch", metavar="FILE", action="append", default=[], help="a launch file to run")
    record.add_argument("--seconds", metavar="N", type=float, default=10.0, help="how long (default: 10)")
    out_option(record, "evidence goes to DIR/<submission id>/evidence/", required=True)
    sandbox_option(record)

    export = add("export", "write evidence in another form, or the grader for another platform")
    forms = export.add_subparsers(metavar="FORM", required=True, title="forms", parser_class=Parser)
    form = Adder(forms, add.common)
    add_platforms(form)
    bag = form("bag", "write recorded evidence as a ROS 1 bag", "export_bag")
    bag.add_argument("evidence", metavar="EVIDENCE", type=Path, help="a recording, or a folder of them")
    bag.add_argument("--out", metavar="FILE", type=Path, help="the bag, or a folder (default: here)")
    bag.add_argument(
        "--all", action="store_true", dest="everything", help="the grader's own records too, as JSON text"
    )

    inspect = add("inspect", "say what is in an evidence file or a bag: rates, gaps, nodes")
    inspect.add_argument("file", metavar="FILE", type=Path)
    json_option(inspect)
