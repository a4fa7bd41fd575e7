"""The file as a whole: its size, its policy, what an anonymous one does not say, and its links."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import resource
import shlex
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.cli.main import run
from grader.errors import OutputError
from grader.model.batch import Entry, RosterFault
from grader.model.result import AppliedOverride, Automatic, GradingResult
from grader.model.verdict import Status
from grader.report.class_page.page import write_class_page
from grader.report.class_page.submissions import pseudonyms, salt_in
from tests.classes.batch.a_class import CORRECT, ROOT, RUBRIC, WRONG_NAME, batch, handed_in, roster_of
from tests.report.class_page.made_up import FAULTS, made_up_rows, made_up_run


def data_of(page: Path) -> dict:
    text = page.read_text(encoding="utf-8")
    return json.loads(
        re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1]
    )


def test_each_script_is_named_by_the_policy_and_nothing_else_may_run(tmp_path) -> None:
    page = tmp_path / "index.html"
    write_class_page(made_up_run(3), made_up_rows(3), page)
    text = page.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(one.encode()).digest()).decode() for one in scripts]
    assert re.findall(r"sha256-([^']*)'", policy) == digests != []
    assert "default-src 'none'" in policy
    assert "script-src 'unsafe" not in policy


def test_it_is_the_same_each_time(tmp_path) -> None:
    first, second = tmp_path / "a.html", tmp_path / "b.html"
    for page in (first, second):
        write_class_page(made_up_run(40), made_up_rows(40), page)
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.full
def test_ten_thousand_fit(tmp_path) -> None:
    page = tmp_path / "index.html"
    before = time.process_time()
    write_class_page(made_up_run(10_000), made_up_rows(10_000), page)
    assert page.stat().st_size < 6_000_000
    assert len(data_of(page)["rows"]) == 10_000
    assert time.process_time() - before < 60  # made up and written; a page alone takes some two seconds


def test_results_are_not_kept_in_memory(tmp_path) -> None:
    def rows() -> Iterator[tuple[Entry, GradingResult]]:
        for entry, result in made_up_rows(300):
            long = tuple(c.model_copy(update={"measured": "x" * 100_000 + entry.id}) for c in result.criteria)
            yield entry, result.model_copy(update={"criteria": long})

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    write_class_page(made_up_run(300), rows(), tmp_path / "index.html")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # of 510 MB


def test_where_it_cannot_be_written_that_is_said(tmp_path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError):
        write_class_page(made_up_run(1), made_up_rows(1), tmp_path / "file" / "index.html")


def test_who_has_no_report_has_no_link(tmp_path) -> None:
    page = tmp_path / "index.html"
    write_class_page(made_up_run(10), made_up_rows(10, missing=4), page)
    assert [row[3] for row in data_of(page)["rows"]][-4:] == [0, 0, 0, 0]


OWN = ("zebulon", "quagmire", "Xanthippe", "O'Hara-Smythe", "bluebirds", "vault")


def anonymous_rows(count: int = 40) -> Iterator[tuple[Entry, GradingResult]]:
    """Everybody's name is in all texts where it can come from."""
    for i, (_, result) in enumerate(made_up_rows(count, missing=2)):
        own = f"zebulon{i:02}"
        entry = Entry(
            id=f"{own}@quagmire.edu",
            name=f"Xanthippe O'Hara-Smythe {i}",
            group="the bluebirds",
            source=f"https://vault.example/{own}/lab.git",
            ref=own,
        )
        text = f"{own} said at /home/{own}/x.py: 'Xanthippe' of the bluebirds cannot {entry.source} {own}"
        criteria = tuple(c.model_copy(update={"message": f"{text} {c.id}"}) for c in result.criteria)
        said = Automatic(status=Status.FAIL, points=0, message=text)
        override = AppliedOverride(
            points=1, author="Xanthippe", comment=text, criterion="manifest", automatic=said, was=said
        )
        error = result.error and result.error.model_copy(update={"message": text, "hint": text})
        submission = result.submission.model_copy(update={"id": own, "source": entry.source})
        update = {"criteria": criteria, "overrides": (override,), "error": error, "submission": submission}
        yield entry, result.model_copy(update=update)


def test_an_anonymous_page_names_nobody(tmp_path) -> None:
    page = tmp_path / "quagmire" / "index.html"
    fault = RosterFault(where="zebulon.csv:3", id="zebulon99", text="source: no folder /home/zebulon99")
    run = made_up_run(
        40, roster="/home/xanthippe/zebulon.csv", faults=(*FAULTS, fault), cluster="tcp://vault:1"
    )
    write_class_page(run, anonymous_rows(), page, anonymous=True)
    text = page.read_text(encoding="utf-8")
    assert [word for word in OWN if word.casefold() in text.casefold()] == []
    assert not any(result.submission.commit[:7] in text for _, result in anonymous_rows())
    assert "report.html" not in re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert "--rubric" not in text
    assert len(data_of(page)["rows"]) == 40
    assert "package-not-found" not in text


def test_the_same_class_by_name_shows_that_the_words_could_be_there(tmp_path) -> None:
    page = tmp_path / "index.html"
    write_class_page(made_up_run(40), anonymous_rows(), page)
    text = page.read_text(encoding="utf-8").casefold()
    assert [word for word in OWN if word.casefold() in text or word == "O'Hara-Smythe"] == list(OWN)


def test_a_salt_keeps_pseudonyms_and_none_gives_new_ones(tmp_path) -> None:
    def points(name: str, salt: bytes | None) -> list[float]:
        write_class_page(made_up_run(60), made_up_rows(60), tmp_path / name, anonymous=True, salt=salt)
        return [row[5] for row in data_of(tmp_path / name)["rows"]]

    salt = salt_in(tmp_path)
    assert salt == salt_in(tmp_path)
    assert points("a.html", salt) == points("b.html", salt)
    assert points("c.html", None) != points("a.html", salt)
    assert points("a.html", salt) != [result.points for _, result in made_up_rows(60)]
    assert base64.b64encode(salt) not in (tmp_path / "a.html").read_bytes()
    assert salt.hex() not in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert (tmp_path / ".anonymous-salt").stat().st_mode & 0o77 == 0


def test_no_pseudonym_looks_like_an_id() -> None:
    assert pseudonyms(["s001", "x2"]) == ["P001", "P002"]
    assert pseudonyms(["sara", "paul"]) == ["S001", "S002"]
    assert len(set(pseudonyms([str(i) for i in range(1234)]))) == 1234


@pytest.mark.full
def test_a_batch_writes_the_page_beside_the_gradebook(tmp_path, capsys) -> None:
    handed_in(tmp_path, ["bob"], WRONG_NAME)
    rows = [f"ada,{CORRECT},Ada", "b b,bob,Bob", f"zoe,{tmp_path}/nowhere/at/all,Zoe"]
    roster, out = roster_of(tmp_path, rows, "id,source,name"), tmp_path / "out"
    batch(roster, out, "--allow-local", str(ROOT))
    data = data_of(out / "index.html")
    assert [(row[0], row[1], row[4]) for row in data["rows"]] == [
        ("ada", "Ada", "graded"),
        ("b b", "Bob", "graded"),
        ("zoe", "Zoe", "error"),
    ]
    links = [f"{row[0]}/report.html" if row[3] == 1 else row[3] for row in data["rows"]]
    assert links[1] == "b-b/report.html"
    assert all((out / link).is_file() for link in links[:2])
    assert str(out / "index.html") in capsys.readouterr().out
    page = (out / "index.html").read_text(encoding="utf-8")
    asked = ["--rubric", str(RUBRIC), "--out", str(out), "--allow-local", str(ROOT), "--only", "failed"]
    command = shlex.join(["grader", "batch", str(roster), *asked])
    assert html.escape(command) in page
    assert "This batch" not in page


@pytest.mark.full
def test_a_regrade_writes_it_again(tmp_path) -> None:
    out = tmp_path / "out"
    batch(roster_of(tmp_path, [f"ada,{CORRECT}"]), out, "--allow-local", str(ROOT))
    before = data_of(out / "index.html")
    (out / "index.html").write_text("old")
    assert run(["regrade", str(out), "--rubric", str(RUBRIC)]) == 0
    assert data_of(out / "index.html")["rows"][0][:7] == before["rows"][0][:7]
