"""The student's code beside a criterion: which files, the cited lines, what differs from the starter, highlighted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.classes.review.cards import CodeFile, code_of, highlighted
from grader.errors import RubricError
from grader.evidence.reader import load_run
from grader.rubric.load import load_rubric
from tests.classes.review.a_class import MANUAL, RECORDINGS, ROOT, a_rubric, result_of

LAB = ROOT / "rubrics" / "leeds-comp3631-lab1.yaml"


def shown(out: Path, key: str, criterion: str, starter=None, **given: object) -> list[CodeFile]:
    asked = next(c for c in load_rubric(str(out.parent / "lab.yaml")).rubric.criteria if c.id == criterion)
    asked = asked.model_copy(update={"parameters": given}) if given else asked
    result = next(c for c in result_of(out, key).criteria if c.id == criterion)
    return code_of(out / key, asked, result, starter or {})


@pytest.fixture
def out(out, made_class) -> Path:
    (out.parent / "lab.yaml").write_bytes((made_class.parent / "lab.yaml").read_bytes())
    return out


def test_what_a_criterion_cites_comes_first_with_its_lines(out) -> None:
    (file,) = shown(out, "dana", "counter-wrap")
    assert file.cited
    marked = [row for row in file.rows if row.marked]
    assert marked
    assert all(row.number and not row.kind for row in marked)


def test_a_criterion_for_people_shows_its_files_or_all_programs(out) -> None:
    every = [file.path for file in shown(out, "ada", "style")]
    assert every
    assert all(path.endswith(".py") for path in every)
    assert [file.path for file in shown(out, "ada", "style", files=["package.xml"])] == ["package.xml"]
    assert [file.path for file in shown(out, "ada", "style", files=["*/*.py"])] == every
    two = shown(out, "ada", "style", files=["package.xml", "README*"])
    assert [(file.path, file.told) for file in two] == [
        ("package.xml", ""),
        ("README*", "no such file is in the evidence"),
    ]
    assert [file.path for file in shown(out, "ada", "style", files=["README*"])] == ["README*"]


def test_what_differs_from_the_starter(out) -> None:
    (file, *_) = shown(out, "ada", "style")
    kept = load_run(out / "ada" / "evidence" / "package.mcap").attachments[file.path]
    first, second, *rest = kept.decode().splitlines()
    starter = {f"handout/lab1/{file.path}": "\n".join([first, "# TODO", *rest]).encode()}
    (changed, *_) = shown(out, "ada", "style", starter)
    assert changed.told == "1 new and 1 removed"
    assert [(row.number, row.kind) for row in changed.rows[:4]] == [
        (1, ""),
        (None, "minus"),
        (2, "plus"),
        (3, ""),
    ]
    assert changed.rows[2].text.unescape().endswith(f"{second}</span>")
    (same, *_) = shown(out, "ada", "style", {file.path: kept})
    assert same.told == "as the course handed it out"


def test_without_evidence_or_by_a_link_nothing_is_shown(out, tmp_path) -> None:
    (out / "ada" / "evidence" / "package.mcap").unlink()
    (out / "ada" / "evidence" / "package.mcap").symlink_to(RECORDINGS / "correct" / "package.mcap")
    assert shown(out, "ada", "style") == []


def test_the_page_shows_it_as_text(page) -> None:
    text = page.text("/s/dana/?c=counter-wrap")
    assert '<span class="hl-word">import</span>' in text
    assert "row marked" in text
    assert 'class="sources"' not in page.text("/s/dana/")


HOSTILE = ['"' * 100_000, "'''" * 30_000, "/*" * 50_000, "<!--" * 30_000, "#" * 90_000, "<a" * 50_000]


@pytest.mark.parametrize("suffix", [".py", ".cpp", ".xml", ".yaml"])
def test_hostile_text_stays_text(suffix) -> None:
    for text in HOSTILE if suffix == ".py" else HOSTILE[2:4]:
        (made,) = highlighted([text], suffix)
        assert "<script" not in made
        assert len(re.sub("<[^>]+>", "", made)) >= len(text)
    (made,) = highlighted(["<script>alert('x')</script> # </span>"], suffix)
    assert "<script" not in made
    assert made.count("<span") == made.count("</span>")


def test_a_rubric_names_files_for_a_person(tmp_path) -> None:
    more = MANUAL.replace("    hint: names", "    with: {files: [talker.py]}\n    hint: names")
    rubric = a_rubric(tmp_path / "lab.yaml", more).rubric
    assert next(c for c in rubric.criteria if c.id == "style").parameters == {"files": ["talker.py"]}


@pytest.mark.parametrize("given", ["{file: talker.py}", "{files: talker.py}", "{files: ['']}"])
def test_what_a_rubric_names_in_a_wrong_way_is_refused(tmp_path, given) -> None:
    with pytest.raises(RubricError, match="with"):
        a_rubric(
            tmp_path / "lab.yaml", MANUAL.replace("    hint: names", f"    with: {given}\n    hint: names")
        )
