"""`grader verify` and `grader sign`: what was forged is named, whoever forged it."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from grader.cli.main import run
from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.judging.settle import settle
from grader.model.result import GradingResult, Override
from grader.report.files import write_reports
from grader.results import SIGNATURE, SUMS, Results
from grader.rubric.load import load_rubric
from grader.verification import read_signature
from tests.support.a_class import judged_result

RECORDINGS = Path(__file__).parent / "data" / "recordings"
LAB = "leeds-comp3631-lab1"


def graded(folder: Path, recording: str = "correct", **decided: float) -> Path:
    """A result of a recording that is kept, with what a person decided."""
    rubric = load_rubric(LAB)
    shutil.copytree(RECORDINGS / recording, folder / "evidence")
    runs = load_evidence([folder / "evidence"])
    result = judged_result(folder.name, rubric, judge(rubric.rubric, runs, rubric.checks))
    about = next(iter(runs.values())).metadata
    whose = {"commit": about.get("submission.commit") or None, "digest": about.get("submission.digest", "")}
    result = result.model_copy(update={"submission": result.submission.model_copy(update=whose)})
    overrides = {name: Override(points=points, author="Ann") for name, points in decided.items()}
    if overrides:
        result = settle(result, rubric.rubric, overrides=overrides, handed_in=None)
    write_reports(result, folder, console="", rubric=rubric.rubric)
    return folder


def edit(folder: Path, change: Callable[[dict], None]) -> None:
    file = folder / "result.json"
    data = json.loads(file.read_text())
    change(data)
    file.write_text(json.dumps(data))


def new_key(folder: Path, name: str) -> tuple[Path, str]:
    """A key without a passphrase, and its line in a file of allowed signers."""
    key = folder / name
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", name, "-f", str(key)], check=True)  # noqa: S607
    return key, f'{name}@course.example namespaces="grader" {key.with_suffix(".pub").read_text()}'


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str]]:
    def verify(*words: str | Path) -> tuple[int, str]:
        code = run(["verify", *map(str, words)])
        return int(code), capsys.readouterr().out

    return verify


def test_the_evidence_gives_what_the_result_says(tmp_path, told) -> None:
    decided = graded(tmp_path / "class" / "ann", **{"chatter-rate": 3.0})
    before = (decided / "result.json").read_bytes()
    graded(tmp_path / "class" / "bob")
    code, out = told(tmp_path / "class")
    assert code == 0, out
    assert out.count(": ok\n") == 2
    assert "people decided 1 criterion: Ann" in out
    assert f"rubric: {LAB}" in out
    assert "signature: not signed" in out
    assert told(decided / "result.json")[0] == 0
    assert (decided / "result.json").read_bytes() == before


def test_what_being_late_cost_in_a_course_is_said(tmp_path, told) -> None:
    """The lab's own rubric knows no deadline."""
    folder = graded(tmp_path / "ann")
    late = {"late_s": 3600, "points_before": 100.0, "points": 90.0, "text": "1 day late", "by": "roster"}
    edit(folder, lambda data: data.update(points=90.0, late=late))
    code, out = told(folder)
    assert code == 0, out
    assert "1 day late (100 points before, 90 after), by a deadline that this rubric does not have" in out
    edit(folder, lambda data: data.update(points=99.0))
    assert told(folder)[0] == 1


def more_points(data: dict) -> None:
    lost = next(c for c in data["criteria"] if c["points"] < c["max_points"])
    lost |= {"status": "pass", "points": lost["max_points"], "message": "all is well"}


def more_in_all(data: dict) -> None:
    data["points"] = data["max_points"]


def other_words(data: dict) -> None:
    data["criteria"][0]["measured"] = "9.99 Hz"


def without_one(data: dict) -> None:
    del data["criteria"][0]


def other_automatic(data: dict) -> None:
    data["overrides"][0]["automatic"] |= {"status": "fail", "points": 0.0}


def other_code(data: dict) -> None:
    data["submission"]["digest"] = "f" * 64


@pytest.mark.parametrize(
    ("forge", "words"),
    [
        (more_points, "result.json says pass, "),
        (more_in_all, "points: result.json says 100"),
        (without_one, "it is missing in result.json"),
        (other_automatic, "before a person decided, result.json says fail, 0; the evidence gives "),
        (other_code, "evidence: it is of a submission with the digest "),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_forged_result_is_named(forge, words, tmp_path, told) -> None:
    recording = next(p.name for p in sorted(RECORDINGS.iterdir()) if p.is_dir() and p.name != "correct")
    folder = graded(
        tmp_path / "ann", recording, **({"chatter-rate": 3.0} if forge is other_automatic else {})
    )
    assert told(folder)[0] == 0
    edit(folder, forge)
    code, out = told(folder)
    assert code == 1, out
    assert words in out


def test_words_that_cost_nothing_are_named_and_are_no_fault(tmp_path, told) -> None:
    folder = graded(tmp_path / "ann")
    edit(folder, other_words)
    code, out = told(folder)
    assert code == 0
    first = GradingResult.read_json((folder / "result.json").read_bytes()).criteria[0].id
    assert f"+ result: worded otherwise, by another build of the grader or by hand: {first}\n" in out


def test_a_forged_rubric_is_named(tmp_path, told, capsys) -> None:
    folder = graded(tmp_path / "ann")
    edit(
        folder,
        lambda data: data.update(rubric_origin="submission", rubric=data["rubric"] | {"digest": "f" * 64}),
    )
    code, out = told(folder)
    assert code == 1
    digest = load_rubric(LAB).digest
    words = (
        f"it was judged by {LAB} with digest sha256:{'f' * 64} (from the student's repository), not by {LAB}"
    )
    assert f"x rubric: {words} with digest sha256:{digest}" in out
    edit(folder, lambda data: data["rubric"].update(id="../../etc/passwd"))
    assert told(folder)[0] == 2
    edit(folder, lambda data: data.update(schema="grader.result/1", rubric=3))
    assert told(folder)[0] == 3


def test_who_signed_is_said_and_what_changed_since_is_named(tmp_path, told) -> None:
    folder = graded(tmp_path / "ann")
    staff, line = new_key(tmp_path, "staff")
    other, others_line = new_key(tmp_path, "mallory")
    allowed, others = tmp_path / "allowed", tmp_path / "others"
    allowed.write_text(f"# of the course\nboss@course.example,{line}")
    others.write_text(others_line)

    assert told(folder, "--allowed-signers", allowed)[0] == 1  # not signed
    assert run(["sign", str(folder), "--key", str(staff)]) == 0
    sums = (folder / SUMS).read_text().splitlines()
    assert [row.partition("  ")[2] for row in sums][-1] == "result.json"
    code, out = told(folder, "--allowed-signers", allowed)
    assert (code, "+ signature: signed by boss@course.example" in out) == (0, True), out
    assert "signed with the ED25519 key SHA256:" in told(folder)[1]
    code, out = told(folder, "--allowed-signers", others)
    assert code == 1
    assert "x signature: signed with the ED25519 key SHA256:" in out
    assert "none of the allowed signers" in out

    (folder / "evidence" / "package.mcap").write_bytes(b"forged")
    (folder / "evidence" / "new.mcap").write_bytes(b"")
    edit(folder, more_in_all)
    code, out = told(folder, "--allowed-signers", allowed)
    assert code == 1
    for words in (
        "x evidence: evidence/package.mcap was changed since it was signed",
        "x evidence: evidence/new.mcap was added since it was signed",
        "x result: result.json was changed since it was signed",
        "package.mcap",
    ):
        assert words in out
    assert run(["sign", str(folder), "--key", str(other)]) == 0  # the forger signs it
    code, out = told(folder, "--allowed-signers", allowed)
    assert code == 1
    assert "none of the allowed signers" in out


def test_somebody_elses_result_is_named(tmp_path, told) -> None:
    ann = graded(tmp_path / "class" / "ann")
    key, line = new_key(tmp_path, "staff")
    (tmp_path / "allowed").write_text(line)
    assert run(["sign", str(ann), "--key", str(key)]) == 0
    bob = shutil.copytree(ann, ann.with_name("bob"))
    words = "result: it is the result of ann, in the folder bob\n"
    code, out = told(bob, "--allowed-signers", tmp_path / "allowed")
    assert (code, f"+ {words}" in out) == (0, True)  # a folder of its own can have any name
    (tmp_path / "class" / "run.json").write_text("{}")
    code, out = told(tmp_path / "class", "--allowed-signers", tmp_path / "allowed")
    assert (code, f"x {words}" in out, out.count(": ok\n")) == (1, True, 1)


def test_a_key_that_is_not_there_or_open_to_all_says_so(tmp_path, capsys) -> None:
    folder = graded(tmp_path / "ann")
    assert run(["sign", str(folder), "--key", str(tmp_path / "nokey")]) == 2
    assert "nokey: there is no such file" in capsys.readouterr().err
    key, _ = new_key(tmp_path, "staff")
    key.chmod(0o644)
    assert run(["sign", str(folder), "--key", str(key)]) == 2
    assert f"hint: chmod 600 {key}" in capsys.readouterr().err


def test_changed_sums_and_a_broken_signature_are_named(tmp_path, told) -> None:
    folder = graded(tmp_path / "ann")
    staff, _ = new_key(tmp_path, "staff")
    assert run(["sign", str(folder), "--key", str(staff)]) == 0
    (folder / SUMS).write_text((folder / SUMS).read_text().replace("a", "b"))
    code, out = told(folder)
    assert (code, "x signature: SHA256SUMS is not what was signed" in out) == (1, True), out
    (folder / SIGNATURE).write_text("no signature")
    assert read_signature(folder, None).state == "bad"
    assert run(["sign", str(folder), "--key", str(tmp_path / "nowhere")]) == 2


def test_a_new_result_has_no_old_signature(tmp_path) -> None:
    folder = graded(tmp_path / "ann")
    staff, _ = new_key(tmp_path, "staff")
    assert run(["sign", str(folder), "--key", str(staff)]) == 0
    with Results(folder) as results:
        (results.new / "result.json").write_bytes((folder / "result.json").read_bytes())
        results.commit(keep=("evidence",))
    assert not (folder / SUMS).exists()
    assert not (folder / SIGNATURE).exists()
    assert (folder / "evidence").is_dir()


def test_an_own_run_is_compared_with_the_official_one(tmp_path, told) -> None:
    recording = next(p.name for p in sorted(RECORDINGS.iterdir()) if p.is_dir() and p.name != "correct")
    own, official = graded(tmp_path / "own"), graded(tmp_path / "official", recording)
    edit(own, lambda data: data["submission"].update(digest="a" * 64, commit="b" * 40))
    code, out = told(own, "--against", official)
    assert code == 1
    assert "x code: other files were graded (bbbbbbbbbbbb and " in out
    result = GradingResult.read_json((official / "result.json").read_bytes())
    lost = [c.id for c in result.criteria if c.points < c.max_points]
    assert lost
    assert all(f"x result: {name}: own run pass" in out for name in lost)
    code, out = told(own, "--against", own)
    assert (code, "+ code: the same files were graded" in out) == (0, True)
    assert told(own, "--against", own, "--rubric", LAB)[0] == 2
    assert told(tmp_path / "nowhere")[0] == 3
