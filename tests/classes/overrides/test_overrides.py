"""What people write into overrides.yaml, every fault of it by its line, and the examples of the guide."""

from __future__ import annotations

import re
from datetime import date, datetime, timedelta, timezone
from pathlib import Path

import pytest

from grader.classes.overrides import FILE, Overrides, read_overrides
from grader.errors import RubricError
from grader.intake.names import safe_name
from grader.model.result import Override
from grader.rubric.load import load_rubric
from grader.rubric.model import Late
from tests.classes.overrides.samples import IDS, rubric
from tests.rubric.samples import spoiled

TIME = "must be a time with its zone, such as 2026-11-20T23:59:00+01:00"


def read(folder: Path, text: str) -> Overrides:
    path = folder / FILE
    path.write_bytes(text.encode())
    return read_overrides(path, rubric(), IDS)


def faults(folder: Path, text: str) -> list[str]:
    with pytest.raises(RubricError) as caught:
        read(folder, text)
    assert all("\n" not in fault and "pydantic" not in fault for fault in caught.value.faults)
    return [fault.replace(f"{folder}/{FILE}:", "") for fault in caught.value.faults]


def test_both_ways_to_write_one(tmp_path):
    text = """\
schema: grader.overrides/1
alice:
  style: {points: 7, comment: "clear names", author: A. Miller, date: 2026-11-02}
  chatter-rate:
    points: 10
    comment: the lab machine was broken
    author: A. Miller
    date: 2026-11-02T14:30:00+01:00
"""
    afternoon = datetime(2026, 11, 2, 14, 30, tzinfo=timezone(timedelta(hours=1)))
    assert read(tmp_path, text) == {
        "alice": {
            "style": Override(points=7, comment="clear names", author="A. Miller", date=date(2026, 11, 2)),
            "chatter-rate": Override(
                points=10, comment="the lab machine was broken", author="A. Miller", date=afternoon
            ),
        }
    }


def test_no_file_is_no_override(tmp_path):
    assert read_overrides(tmp_path / FILE, rubric(), IDS) == {}


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "{}\n", "schema: grader.overrides/1\n", "alice:\n"])
def test_a_file_that_is_begun_is_no_override(tmp_path, text):
    assert read(tmp_path, text) == {}


def test_what_was_left_empty_is_not_there(tmp_path):
    text = "bob:\n  style:\n    points: 3\n    comment:\n    author:\n    date:\n"
    assert read(tmp_path, text) == {"bob": {"style": Override(points=3)}}


def test_ids_that_yaml_takes_for_something_else(tmp_path):
    text = "001234: {style: {points: 1}}\nno: {style: {points: 2}}\n"
    found = read(tmp_path, text)
    assert {name: found[name]["style"].points for name in found} == {"001234": 1, "no": 2}


@pytest.mark.parametrize("name", IDS)
def test_a_submission_goes_by_its_folder_too(tmp_path, name):
    assert set(read(tmp_path, f'"{safe_name(name)}": {{style: {{points: 1}}}}\n')) == {name}
    assert set(read(tmp_path, f'"{name}": {{style: {{points: 1}}}}\n')) == {name}


def test_a_file_from_windows(tmp_path):
    assert set(read(tmp_path, "\ufeffalice:\r\n  style: {points: 1}\r\n")) == {"alice"}


def test_every_fault_at_once(tmp_path):
    text = """\
schema: grader.override/1
alic:
  style: {points: 7}
alice:
  sytle: {points: 7}
  chatter-rate: {points: 91}
bob:
  style: {points: -1, when: monday}
  chatter-rate: 10
Alice:
  style: {points: seven, comment: 12, date: soon}
  style: {points: 8}
no: 7
zoe-muller:
  style: {comment: names, points: }
  chatter-rate: {author: Kim, comment: ""}
"""
    assert faults(tmp_path, text) == [
        '1: schema: must be "grader.overrides/1", not "grader.override/1"',
        '2: alic: there is no submission "alic" (did you mean "alice"?)',
        '5: alice.sytle: there is no criterion "sytle" (did you mean "style"?)',
        "6: alice.chatter-rate.points: 91 is more than the criterion has: 90",
        "8: bob.style.points: must be at least 0, not -1",
        "8: bob.style.when: is not known here",
        "9: bob.chatter-rate: must be a map of keys and values, not 10",
        "10: Alice: is the submission on line 4 already, alice",
        "11: Alice.style: is given twice, again on line 12",
        '11: Alice.style.points: must be a number, not "seven"',
        "11: Alice.style.comment: must be text, not 12: put it in quotes",
        f'11: Alice.style.date: must be a day such as 2026-11-02, not "soon", or {TIME}, not "soon"',
        "13: no: must be a map from criteria to points, not 7",
        "15: zoe-muller.style.points: must be a number, not empty",
        "16: zoe-muller.chatter-rate.points: is missing",
    ]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("- alice\n", "1: must be a map from submissions to criteria, not a list"),
        ("alice\n", '1: must be a map from submissions to criteria, not "alice"'),
        ("alice: {style: {points: 7}\nbob: 1\n", "2: "),
        ("alice:\n\tstyle: 1\n", "2: a tab: YAML is indented with spaces only"),
        ("alice: !!python/object/apply:os.system [id]\n", "1: the tag"),
        ("alice: {style: {points: .nan}}\n", "1: alice.style.points: must be finite, not .nan"),
        ("alice: {style: {points: .inf}}\n", "1: alice.style.points: must be finite, not .inf"),
        ("alice: {style: {points: true}}\n", "1: alice.style.points: must be a number, not true"),
        ('alice: {style: {points: "7"}}\n', '1: alice.style.points: must be a number, not "7": write 7'),
        ("alice: {style: {points: 1, date: 2026-02-30}}\n", "1: 2026-02-30 cannot be read"),
        (
            "alice: {style: {points: 1, author: 2026-02-03}}\n",
            "1: alice.style.author: must be text or a number",
        ),
        ('alice: {style: {points: 1, comment: "\\ud800"}}\n', "1: alice.style: "),
        (
            f"alice: {{style: {{points: 1, comment: {'x' * 2001}}}}}\n",
            "1: alice.style.comment: has at most 2000",
        ),
        (f"alice: {{style: {{points: 1, author: {'x' * 201}}}}}\n", "1: alice.style.author: has at most 200"),
    ],
)
def test_what_is_none(tmp_path, text, fault):
    (found,) = faults(tmp_path, text)
    assert found.startswith(fault)


def test_a_folder_and_a_broken_link(tmp_path):
    (tmp_path / FILE).mkdir()
    with pytest.raises(RubricError, match="is a folder, not an overrides file"):
        read_overrides(tmp_path / FILE, rubric(), IDS)
    (tmp_path / "link.yaml").symlink_to("nowhere")
    with pytest.raises(RubricError, match="there is no such file") as caught:
        read_overrides(tmp_path / "link.yaml", rubric(), IDS)
    assert "grader labs" not in caught.value.hint


def test_a_file_without_an_end_is_not_read_to_it(tmp_path):
    (tmp_path / FILE).symlink_to("/dev/zero")
    with pytest.raises(RubricError, match="larger than 20 MB"):
        read_overrides(tmp_path / FILE, rubric(), IDS)


PAGE = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "deadlines.md"
DEADLINE, OVERRIDES = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_deadline_and_the_policy(tmp_path):
    found = load_rubric(str(spoiled(tmp_path, ("package: lab1\n", f"package: lab1\n{DEADLINE}")))).rubric
    assert found.late == Late(lost=10, grace_minutes=15, cap=50, cut_off_days=7)
    assert set(Late.model_fields) == {line.split(":")[0].strip() for line in DEADLINE.splitlines()[2:]}


def test_the_overrides(tmp_path):
    (tmp_path / FILE).write_text(OVERRIDES, encoding="utf-8")
    assert set(read_overrides(tmp_path / FILE, rubric(), IDS)["alice"]) == {"style", "chatter-rate"}
