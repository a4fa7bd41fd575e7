from __future__ import annotations

import pytest

from grader.authoring.mutation.faulty_packages import (
    LoadedMutants,
    plan_all,
    plan_declared,
    refuse_unfit,
    select_mutants,
)
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Solution, TreeFile, unified_diff
from grader.errors import RubricError, UsageError
from grader.model.mutants import Mutant
from grader.rubric.yaml_lines import Source
from tests.authoring.mutation.samples import other_solution, tree_of

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
