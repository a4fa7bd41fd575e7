"""A lab's file of faulty packages: read, written, documented, and which of them are built."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.authoring.mutation.faulty_packages import (
    LoadedMutants,
    load_mutants,
    mutants_text,
    parse_parameters,
    plan_all,
    plan_declared,
    refuse_unfit,
    select_mutants,
)
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Solution, TreeFile, unified_diff
from grader.errors import RubricError, UsageError
from grader.model.mutants import LostCriterion, Mutant, MutantResult
from grader.rubric.load import load_rubric
from grader.rubric.yaml_lines import Source
from scripts.reference.operators import EXAMPLE, operators_page
from tests.authoring.mutation.samples import LABS, ROOT, other_solution, tree_of
from tests.rubric.samples import spoiled

SOUND = """\
schema: grader.mutants/1
rubric: sample
anchors: [&talker src/talker.py]
mutants:
  half-rate:
    summary: The talker is slow.
    expect: {chatter-rate: fail}
    edits:
      - operator: other-rate
        at: {script: *talker}
        with: {factor: 2}
  two:
    expect: {talker-node: partial}
    edits:
      - operator: bit-removed
      - crlf: {file: *talker}
      - operator: no-shebang
"""


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SOUND
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "sample.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(folder: Path, *changes: tuple[str, str]) -> list[str]:
    path = written(folder, *changes)
    with pytest.raises(RubricError) as caught:
        load_mutants(path, load_rubric(str(spoiled(folder))).rubric)
    return [fault.replace(f"{folder}/", "") for fault in caught.value.faults]


def test_a_sound_file_loads(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path))).rubric
    mutants = load_mutants(written(tmp_path), rubric).mutants
    first, second = mutants["half-rate"], mutants["two"]
    assert first.expect == {"chatter-rate": "fail"}
    assert first.edits[0].at == {"script": "src/talker.py"}
    assert parse_parameters("other-rate", first.edits[0].parameters).model_dump() == {"factor": 2}
    assert second.operators == ("bit-removed", "no-shebang")
    assert [edit.kinds for edit in second.edits] == [["operator"], ["crlf"], ["operator"]]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("other-rate", "other-rat", '9: mutants.half-rate.edits[0].operator: there is no operator "other-rat"'),
        ("factor: 2", "factor: much", '11: mutants.half-rate.edits[0].with.factor: must be a number, not "much"'),
        ("factor: 2", "factor: 0", "11: mutants.half-rate.edits[0].with.factor: must be more than 0, not 0"),
        ("factor: 2", "factr: 2", "11: mutants.half-rate.edits[0].with.factr: is not known here (did you mean"),
        ("chatter-rate: fail", "chatter-rate: lost", '7: mutants.half-rate.expect.chatter-rate: must be "fail", "pa'),
        ("    expect: {chatter-rate: fail}\n", "", "5: mutants.half-rate.expect: is missing"),
        ("expect: {chatter", "expects: {chatter", '7: mutants.half-rate.expects: is not known here (did you mean "ex'),
        ("rubric: sample", "rubric: other", "2: rubric: these mutants are for other, not for sample"),
        ("mutants/1", "mutants/2", "1: schema: written by a newer grader (grader.mutants/2); this one reads up to 1"),
        ("operator: no-shebang", "operator: no-shebnag", '17: mutants.two.edits[2].operator: there is no operator "no'),
        ("script: *talker}", "script: [a]}", "10: mutants.half-rate.edits[0].at.script"),
        ("operator: bit-removed", "operator: 1", "15: mutants.two.edits[0].operator: must be text, not 1: put it in"),
        ("        with: {factor", "        with: {}\n        with: {factor", "11: mutants.half-rate.edits[0].with: is"),
        ("crlf: {file: *talker}", "crlf: {}", "16: mutants.two.edits[1].crlf.file: is missing"),
        ("crlf: {file: *talker}", "at: {script: a}", "16: mutants.two.edits[1]: an edit is exactly one of operator, r"),
        ("crlf: {file: *talker}", "crlf: {file: a}\n        bom: {file: a}", "16: mutants.two.edits[1]: an edit is"),
        ("crlf: {file: *talker}", "crlf: {file: a}\n        at: {script: a}", "16: mutants.two.edits[1]: `at` and"),
        ("half-rate:", "half/rate:", "5: mutants.half/rate"),
    ],
)  # fmt: skip
def test_a_fault_is_named_with_its_line(old, new, fault, tmp_path):
    found = faults(tmp_path, (old, new))
    assert any(line.startswith(f"sample.yaml:{fault}") for line in found), found


def test_all_faults_are_named_at_once(tmp_path):
    found = faults(
        tmp_path, ("factor: 2", "factor: much"), ("no-shebang", "no-shebnag"), ("rubric: sample", "rubric: s")
    )
    assert [line.split(":")[1] for line in found] == ["2", "11", "17"]


def test_the_same_mutant_twice(tmp_path):
    edits = "    edits:\n      - operator: bit-removed\n      - crlf: {file: *talker}\n      - operator: no-shebang\n"
    assert faults(tmp_path, ("  two:\n", f"  one:\n    expect: {{}}\n{edits}  two:\n")) == [
        "sample.yaml:18: mutants.two: has the same edits as mutants.one"
    ]


@pytest.mark.parametrize("text", ["", "[]", "just text", "mutants: 3", "- \t", "\x00", "{a: &x [*x]}"])
def test_what_is_no_mutants_file(text, tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(text)
    with pytest.raises(RubricError) as caught:
        load_mutants(path, load_rubric(str(spoiled(tmp_path))).rubric)
    assert all(fault.startswith(str(path)) for fault in caught.value.faults)


def test_a_criterion_that_the_rubric_lacks_is_no_fault_of_the_file(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path))).rubric
    path = written(tmp_path, ("chatter-rate: fail", "no-such: fail"))
    assert load_mutants(path, rubric).mutants["half-rate"].expect == {"no-such": "fail"}


def mutants_of(lab: str) -> list[Mutant]:
    rubric = load_rubric(lab).rubric
    return list(load_mutants(ROOT / "fixtures" / f"{lab}.yaml", rubric).mutants.values())


@pytest.mark.parametrize("lab", LABS)
def test_every_criterion_worth_points_is_lost_by_a_mutant(lab):
    worth = {c.id for c in load_rubric(lab).rubric.criteria if c.points > 0}
    lost = {
        name for mutant in mutants_of(lab) for name, status in mutant.expect.items() if status != "blocked"
    }
    assert worth <= lost


def test_every_criterion_of_the_first_lab_is_lost_alone():
    """Such a mutant would cost nothing, were the criterion taken out of the rubric."""
    lab = "leeds-comp3631-lab1"
    worth = {c.id for c in load_rubric(lab).rubric.criteria if c.points > 0}
    assert worth <= {name for mutant in mutants_of(lab) if len(mutant.expect) == 1 for name in mutant.expect}


def test_every_operator_has_sound_defaults():
    assert all(operator.params() is not None for operator in OPERATORS.values())


def lost(name: str, status: str) -> LostCriterion:
    return LostCriterion(id=name, status=status, message="")


def test_a_written_file_declares_what_was_lost(tmp_path):
    planned = plan_all(other_solution())
    results = [
        MutantResult(
            name=mutant.name,
            label=mutant.label,
            operator=mutant.mutant.operators[0],
            mistake="",
            state=("survived", "killed", "inconclusive")[index % 3],
            expected=None,
            lost=(
                (lost("chatter-rate", "fail"), lost("talker-node", "blocked"))
                if index % 3 == 1
                else (lost("dependencies", "fail"),) * (index % 6 == 3)
            ),
            diff="",
            wall_s=1,
        )
        for index, mutant in enumerate(planned)
    ]
    text = mutants_text("sample", {mutant.name: mutant.mutant for mutant in planned}, results)
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    loaded = load_mutants(path, load_rubric(str(spoiled(tmp_path))).rubric)
    assert len(loaded.mutants) == sum(result.state == "killed" for result in results)
    assert [m.edits for m in loaded.mutants.values()] == [
        p.mutant.edits for i, p in enumerate(planned) if i % 3 == 1
    ]
    assert all(
        m.expect == {"chatter-rate": "fail", "talker-node": "blocked"} for m in loaded.mutants.values()
    )
    assert text.count("# costs nothing: the rubric does not notice this mistake") == len(planned[::6])
    noticed = "# costs no points: the rubric notices it in dependencies, which is advice"
    assert text.count(noticed) == len(planned[3::6]) > 0


def test_the_example_is_sound(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path, ("id: sample", "id: my-lab")))).rubric
    (tmp_path / "m.yaml").write_text(EXAMPLE, encoding="utf-8")
    assert len(load_mutants(tmp_path / "m.yaml", rubric).mutants) == 2


def test_the_page_has_every_operator_and_lab():
    page = operators_page()
    assert all(page.count(f"| `{name}` |") == page.count(f"- `{name}`: ") == 1 for name in OPERATORS)
    assert all(f" {lab.split('-')[0]} |" in page for lab in LABS)


NODE = "#!/usr/bin/env python\nimport rospy\nrospy.init_node('a')\nrospy.spin()\n"


def two_nodes() -> Solution:
    return Solution(tree=tree_of({"src/a.py": NODE, "src/b.py": NODE}), folder="", name="lab")


def declared(*mutants: dict[str, object]) -> LoadedMutants:
    """Mutants `a`, `b`, … on lines 10, 20, …; each is given by its one edit, or whole."""
    records = {}
    for name, mutant in zip("abc", mutants, strict=False):
        whole = mutant if "edits" in mutant else {"edits": (mutant,)}
        records[name] = Mutant.model_validate({"expect": {"x": "fail"}, **whole})
    lines = {("mutants", name): 10 * (index + 1) for index, name in enumerate(records)}
    return LoadedMutants(mutants=records, source=Source(name="m.yaml", raw=b"", data=None, lines=lines))


def test_one_place_needs_no_at():
    planned, faults = plan_declared(declared({"operator": "yaml-key-misspelt"}), other_solution())
    assert faults == []
    assert planned[0].name == planned[0].label == "a"
    assert planned[0].costs == {"x": "fail"}


def test_a_part_of_the_place_is_enough():
    planned, _ = plan_declared(
        declared({"operator": "launch-name-changed", "at": {"node": "ear"}}), other_solution()
    )
    assert 'name="my_ear"' in unified_diff(other_solution().tree, planned[0].tree)


def test_several_places_have_to_be_told_apart():
    _, faults = plan_declared(declared({"operator": "crlf"}), two_nodes())
    assert faults == [
        "m.yaml:10: mutants.a: crlf fits in 2 places: say in `at` which: {script: src/a.py}; {script: src/b.py}"
    ]


def test_a_place_where_it_does_not_fit():
    mutant = {"operator": "crlf", "at": {"script": "src/c.py"}}
    _, faults = plan_declared(declared(mutant, {"operator": "burst"}), two_nodes())
    both = "{script: src/a.py}; {script: src/b.py}"
    assert faults == [
        f"m.yaml:10: mutants.a: crlf does not fit at {{script: src/c.py}}; it fits at {both}",
        f"m.yaml:20: mutants.b: burst fits nowhere in this package; it fits {OPERATORS['burst'].fits}",
    ]
    with pytest.raises(RubricError, match="fits nowhere"):
        refuse_unfit(faults)
    refuse_unfit([])


@pytest.mark.parametrize("name", OPERATORS)
def test_every_operator_says_where_it_would_fit(name):
    bare = Solution(tree=tree_of({"README": "nothing"}), folder="", name="lab")
    planned, faults = plan_declared(declared({"operator": name}), bare)
    assert planned == []
    assert faults == [
        f"m.yaml:10: mutants.a: {name} fits nowhere in this package; it fits {OPERATORS[name].fits}"
    ]


def test_two_mistakes_in_one_mutant():
    edits = (
        {"operator": "bit-removed", "at": {"script": "src/a.py"}},
        {"operator": "no-shebang", "at": {"script": "src/b.py"}},
    )
    (planned,), _ = plan_declared(declared({"edits": edits}), two_nodes())
    assert planned.mistake == "The student never makes the script executable and leaves out the shebang."
    assert not planned.tree["src/a.py"].executable
    assert planned.tree["src/b.py"].data.startswith(b"import rospy")


def test_lines_tell_apart_what_nothing_else_does():
    script = "import rospy\nr = rospy.Rate(10)\nwhile True:\n    rospy.sleep(0.1)\n    r.sleep()\n"
    solution = Solution(tree=tree_of({"a.py": script}), folder="", name="lab")
    sites = OPERATORS["other-rate"].sites(solution)
    assert [site.at for site in sites] == [{"script": "a.py", "line": 2}, {"script": "a.py", "line": 4}]
    planned, faults = plan_declared(declared({"operator": "other-rate", "at": {"line": 4}}), solution)
    assert faults == []
    assert b"rospy.sleep(0.2)" in planned[0].tree["a.py"].data


def test_all_operators_are_tried_with_names_of_their_own():
    planned = plan_all(other_solution())
    assert len({mutant.name for mutant in planned}) == len(planned)
    assert {mutant.mutant.operators[0] for mutant in planned} >= {"crlf", "burst", "yaml-key-missing"}
    assert all(mutant.name.strip("-.") and "/" not in mutant.name for mutant in planned)


def test_some_mutants_are_chosen_by_name_by_operator_and_by_pattern():
    planned = plan_all(two_nodes())
    assert [m.label for m in select_mutants(planned, ["crlf"])] == ["crlf: src/a.py", "crlf: src/b.py"]
    assert [m.label for m in select_mutants(planned, ["crlf-src-b.py"])] == ["crlf: src/b.py"]
    assert {m.mutant.operators[0] for m in select_mutants(planned, ["shebang-*"])} == {
        "shebang-typo", "shebang-commented", "shebang-python2"
    }  # fmt: skip
    assert select_mutants(planned, []) == planned
    with pytest.raises(UsageError, match="did you mean"):
        select_mutants(planned, ["clrf"])


def test_every_kind_of_edit():
    a, b = "src/a.py", "src/b.py"
    edits = (
        {"replace": {"file": a, "old": "'a'", "new": "'c'"}},
        {"append": {"file": a, "text": "# end\n"}},
        {"crlf": {"file": a}},
        {"bom": {"file": a}},
        {"mode": {"file": a, "executable": False}},
        {"write": {"file": b, "text": "new"}},
        {"write": {"file": "src/c.py", "text": "", "executable": True}},
        {"link": {"file": "src/d.py", "to": "c.py"}},
        {"move": {"old": "src/", "new": "scripts/"}},
        {"delete": {"file": "scripts/c.py"}},
    )
    (planned,), faults = plan_declared(declared({"edits": edits, "summary": "All of it."}), two_nodes())
    assert faults == []
    assert planned.mistake == "All of it."
    made = NODE.replace("'a'", "'c'").replace("\n", "\r\n") + "# end\r\n"
    assert planned.tree == {
        "scripts/a.py": TreeFile(data=b"\xef\xbb\xbf" + made.encode()),
        "scripts/b.py": TreeFile(data=b"new", executable=True),
        "scripts/d.py": TreeFile(data=b"", link="c.py"),
    }


@pytest.mark.parametrize(
    ("edit", "fault"),
    [
        (
            {"replace": {"file": "src/a.py", "old": "rospy", "new": ""}},
            "src/a.py has 'rospy' 3 times, not 1 times",
        ),
        (
            {"replace": {"file": "src/x.py", "old": "rospy", "new": ""}},
            "replace: there is no file 'src/x.py' (did you mean \"src/b.py\"?)",
        ),
        (
            {"replace": {"file": "lab/src/a.py", "old": "rospy", "new": ""}},
            "replace: there is no file 'lab/src/a.py' (did you mean \"src/a.py\"?)",
        ),
        (
            {"move": {"old": "lab/", "new": ""}},
            "move: there is no file 'lab/'; the solution has src/a.py, src/b.py",
        ),
        (
            {"delete": {"file": "manifest"}},
            "delete: there is no file 'manifest'; the solution has src/a.py, src/b.py",
        ),
    ],
)
def test_an_edit_that_does_not_fit(edit, fault):
    assert plan_declared(declared(edit), two_nodes()) == ([], [f"m.yaml:10: mutants.a: {fault}"])


def test_a_correct_package_is_not_a_mutant():
    assert plan_declared(
        declared({"edits": ({"crlf": {"file": "src/a.py"}},), "expect": {}}), two_nodes()
    ) == ([], [])
