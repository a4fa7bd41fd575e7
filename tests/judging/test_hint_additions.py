"""What is added to verdicts: advice, hints in the language of a node, and unchanged files."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from grader.checks import CHECKS
from grader.checks.support.exceptions import SLIPS
from grader.checks.support.text import CAUSES, LOOP, in_language, init, publisher, set_param
from grader.integrations.platform_exports import Bundle, add_lab
from grader.judging import judge
from grader.judging.facts import Facts, try_facts
from grader.judging.hint_additions import (
    add_advice,
    allow_typing,
    choose_hint_language,
    fill_slots,
    keep_other_names,
    name_connections,
    name_other_imports,
    name_other_lines,
    name_other_parameters,
    name_rospy,
    name_same_file,
    with_own_name,
)
from grader.judging.judge import judge_files
from grader.model.package import PackageFacts
from grader.model.repair import ASKED, TYPED, Repair
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, Status, failed, machine_lacks
from grader.package.facts import read_package
from grader.rubric.load import load_rubric, read_beside_rubric
from grader.wording import NOTHING_TO_DO
from tests.package.trees import CMAKE, MANIFEST, NODE, make_package
from tests.rubric.samples import faults, spoiled
from tests.support.a_class import criterion as criterion_of
from tests.support.rubrics import (
    ALL,
    CHATTER,
    CMAKE_CHECK,
    EXECUTABLE,
    GOOD_RUN,
    RATE,
    SCENARIO,
    SCRIPT,
    rubric,
)
from tests.support.rubrics import NODE as LIVES
from tests.support.timeline import build_runs

pytestmark = pytest.mark.usefixtures("without_processes")

OTHER = [{"name": "other", "script": "src/other.py"}]
OUT = "roslaunch leaves a <node> out: launch/x.launch, line 2:"
NODES = """<launch>
<node pkg="lab1" type="talker" name="a"/>
<node pkg="lab1" type="plain.py" name="b"/>
<node pkg="lab1" type="plain.py" name="c"/>
</launch>"""


def facts(folder, **files: str) -> PackageFacts:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, **files}
    return read_package(make_package(folder / "lab1", tree, executable={"src/plain.py": False}))


def test_a_loss_names_the_other_script_that_has_the_same_code(tmp_path: Path) -> None:
    heard = rubric(*ALL, scenarios={"talker": SCENARIO, "other": {**SCENARIO, "start": OTHER}})
    asked = heard.criteria[0].model_copy(update={"scenario": "talker"})
    lost = failed("no message came")

    def said(**files: str) -> str:
        return name_same_file(
            lost, asked, Facts(package=facts(tmp_path, **files), rubric=heard, runs={})
        ).message

    same = {SCRIPT["path"]: NODE, "src/other.py": NODE}
    assert said(**same).startswith(
        "no message came; src/numeric_talker.py holds the same code as src/other.py"
    )
    assert said(**{**same, "src/other.py": f"{NODE}#\n", "src/third.py": NODE}) == "no message came"


def test_commands_have_the_name_that_the_package_has_as_handed_in(tmp_path: Path) -> None:
    renamed = facts(tmp_path).model_copy(update={"name": "my_lab"})
    shown = criterion().model_copy(
        update={"reproduce": "`rosrun lab1 talker.py` beside `roslaunch lab1 lab1.launch`"}
    )
    asked = rubric(*ALL)
    told = with_own_name(shown, asked, renamed).reproduce
    assert told == "`rosrun my_lab talker.py` beside `roslaunch my_lab lab1.launch`"
    assert with_own_name(shown, asked, facts(tmp_path)) == shown


def criterion(
    hint: str = "", *, status: Status = Status.PASS, scenario: str | None = None
) -> CriterionResult:
    return criterion_of("cmake", status, 0, 1, check="cmake", hint=hint, scenario=scenario)


@pytest.mark.parametrize(
    ("visibility", "hint"),
    [
        (
            "visible",
            (
                'write `"hello world %s" % rospy.get_time()` in place of `input()`, and pause in the loop: '
                "write `rate = rospy.Rate(5)` above it and `rate.sleep()` as its last line"
            ),
        ),
        (
            "hidden",
            (
                "write a value in the code in place of `input()`, and pause in the loop: "
                "write `rate = rospy.Rate(10)` above it and `rate.sleep()` as its last line"
            ),
        ),
    ],
)
def test_a_node_that_asks_for_input_is_told_what_the_lab_wants_of_it(visibility: str, hint: str) -> None:
    message = {"topic": "/chatter", "template": "hello world {seconds}"}
    lab = rubric(
        CHATTER,
        LIVES,
        EXECUTABLE,
        {**RATE, "with": {"topic": "/chatter", "rate_hz": 5}, "visibility": visibility},
        {"id": "words", "check": "message", "with": message, "scenario": "talker", "visibility": visibility},
    )
    lost = failed("talker ended before", hint=CAUSES["EOFError"][1])
    chatter = next(c for c in lab.criteria if c.id == "chatter")
    assert fill_slots(lost, chatter, lab).hint == hint
    other = failed("no message came", hint="publish in the loop")
    assert fill_slots(other, chatter, lab) == other


LOOPED = "loop with `while not rospy.is_shutdown():` and `rospy.Rate(5)`"


@pytest.mark.parametrize(
    ("imports", "hint"),
    [
        ("import rospy", LOOPED),
        ("import sys, rospy", LOOPED),
        ("import sys", LOOPED),
        ("import rospy as ros  # short", LOOPED.replace("rospy", "ros")),
        ("from rospy import *", LOOPED.replace("rospy.", "")),
        ("from rospy import is_shutdown, Rate", LOOPED.replace("rospy.", "")),
        (
            "from rospy import is_shutdown, Rate as Beat",
            "loop with `while not is_shutdown():` and `Beat(5)`",
        ),
        (
            "import sys\nfrom rospy import Publisher, Rate",
            LOOPED.replace("rospy.", "") + "; add `is_shutdown` to what line 2 imports",
        ),
        ("from rospy import Rate\nimport rospy", LOOPED),
        ("from rospy import (\n    Rate)", LOOPED),
        ("from rospy import Rate\nfrom rospy import spin", LOOPED),
    ],
)
def test_a_hint_has_what_is_rospys_as_the_script_imports_it(imports: str, hint: str, tmp_path: Path) -> None:
    package = facts(tmp_path, **{"src/numeric_talker.py": f"{imports}\n"})
    build = {"attachments": {"src/numeric_talker.py": f"{imports}\n"}}
    known = Facts(rubric=rubric(*ALL), runs=build_runs({"runs": {"package": build}}), package=package)
    lost = failed("the node ended", hint=LOOPED)
    assert name_rospy(lost, known.rubric.criteria[0], known).hint == hint
    other = failed("the node ended", hint=f"write `import rospy`, and {LOOPED}")
    assert name_rospy(other, known.rubric.criteria[0], known) == other


def test_what_does_not_start_is_told_where_nothing_is_lost(tmp_path) -> None:
    script = "#!/usr/bin/env python3\n"
    files = {
        "src/old.py": "print 'a'\n",
        "src/talker.py": script,
        "src/plain.py": script,
        "launch/x.launch": NODES,
    }
    package = facts(tmp_path, **files)
    (told,) = add_advice([criterion()], package, rubric(CMAKE_CHECK))
    assert told.hint.split("; ") == [
        "src/old.py has a syntax error on line 1: `print` has no brackets, as in Python 2: write `print(...)`",
        "line 1: write `print('a')`",
        f'{OUT} there is no talker in the package: type="talker" lacks the .py of src/talker.py',
        'write type="talker.py"',
        "src/plain.py is not executable, so roslaunch does not find it (launch/x.launch, line 3)",
        "chmod +x src/plain.py, then git add --chmod=+x src/plain.py, commit and push",
    ]
    assert add_advice([told], package, rubric(CMAKE_CHECK)) == (told,)
    lost = criterion(status=Status.FAIL)
    assert add_advice([lost], package, rubric(CMAKE_CHECK)) == (lost,)


def test_advice_on_a_file_is_told_where_the_file_is_judged(tmp_path) -> None:
    package = facts(tmp_path, **{"src/talker.py": "print 'a'\n", "src/old.py": "print 'b'\n"})
    own = {
        "id": "bit",
        "title": "t",
        "points": 0,
        "check": "executable",
        "with": {"path": "scripts/talker.py"},
    }
    results = [criterion(), criterion().model_copy(update={"id": "bit"})]
    of_package, of_talker = add_advice(results, package, rubric(CMAKE_CHECK, own))
    assert of_package.hint.startswith("src/old.py has")
    assert of_talker.hint.startswith("src/talker.py has")


def test_all_faults_are_told_up_to_a_limit(tmp_path) -> None:
    files = {f"src/old{number}.py": "print 'a'\n" for number in range(13)}
    (told,) = add_advice([criterion()], facts(tmp_path, **files), rubric(CMAKE_CHECK))
    assert told.hint.count(" has a syntax error") == 10
    assert told.hint.endswith("; there are 3 more of the kind")


def test_a_value_that_is_given_to_a_misspelt_name_is_told_unless_a_loss_names_its_line(tmp_path) -> None:
    package = facts(
        tmp_path, **{"src/a.py": "changed = False\nuo = up = 1\nif changed: f()\nchnaged = True\n"}
    )
    (told,) = add_advice([criterion()], package, rubric(CMAKE_CHECK))
    why = "src/a.py, line 4: nothing reads `chnaged`, to which a value is given here: `changed` is meant"
    assert told.hint == f"{why}: write `changed` in place of `chnaged`"
    cited = FileCitation(file="src/a.py", line=4)
    lost = criterion(status=Status.FAIL).model_copy(update={"citations": (cited,)})
    assert add_advice([criterion(), lost], package, rubric(CMAKE_CHECK)) == (criterion(), lost)


def test_a_program_that_reads_what_is_typed_is_told_unless_a_step_types_it(tmp_path) -> None:
    source = "#include <ros/ros.h>\nint main(int argc, char **argv) {\n  std::cin >> name;\n}\n"
    files = {"CMakeLists.txt": f"{CMAKE}add_executable(ask src/ask.cpp)\n", "src/ask.cpp": source}
    start = [{"name": "asks", "script": "ask"}]
    alone = {**SCENARIO, "start": start}
    package = facts(tmp_path, **files)
    (told,) = add_advice([criterion()], package, rubric(CMAKE_CHECK, scenarios={"talker": alone}))
    why = "src/ask.cpp, line 3, reads what is typed, and a graded node gets no input"
    assert told.hint == f"{why}; write a value in the code in place of what line 3 of src/ask.cpp reads"
    steps = [{"type": {"process": "asks", "line": "12"}}]
    typed = {"title": "t", "start": start, "steps": steps}
    assert add_advice([criterion()], package, rubric(CMAKE_CHECK, scenarios={"talker": typed})) == (
        criterion(),
    )
    assert add_advice([criterion()], package, rubric(CMAKE_CHECK)) == (criterion(),)


def test_raw_input_is_to_be_input_where_a_step_types_the_answer(tmp_path) -> None:
    cause, fix = SLIPS["name 'raw_input' is not defined"]
    package, start = facts(tmp_path), [{"name": "asks", "script": "ask"}]
    for steps, said in (
        ([], (cause, fix)),
        ([{"type": {"process": "asks", "line": "12"}}], ("`raw_input` is Python 2", TYPED)),
    ):
        lab = rubric(CMAKE_CHECK, scenarios={"talker": {**SCENARIO, "start": start, "steps": steps}})
        asked = lab.criteria[0].model_copy(update={"scenario": "talker"})
        found = allow_typing(failed(cause, hint=fix), asked, Facts(rubric=lab, runs={}, package=package))
        assert (found.message, found.hint) == said
    repair = Repair(kind="python-syntax", file="a.py", line=1, before="", after="", message="", fix=ASKED)
    assert repair.of_typing().fix == TYPED


def test_an_angle_that_no_run_has_shown_to_be_wrong_is_told(tmp_path) -> None:
    text = "import math\nwhile a > math.pi:\n    a -= 3 * math.pi\nb = math.atan2(dx, dy)\n"
    (told,) = add_advice([criterion()], facts(tmp_path, **{"src/a.py": text}), rubric(CMAKE_CHECK))
    assert "src/a.py, line 3: a whole turn is `2 * math.pi`" in told.hint
    assert "src/a.py, line 4: `atan2` takes y first, and then x" in told.hint


def test_a_node_of_nearly_the_packages_name_is_told(tmp_path) -> None:
    nodes = [f'<node pkg="{name}" type="a.py" name="{name}"/>' for name in ("lab11", "rospy", "other")]
    files = {
        "src/a.py": "#!/usr/bin/env python3\n",
        "launch/x.launch": "\n".join(["<launch>", *nodes, "</launch>"]),
    }
    (told,) = add_advice([criterion()], facts(tmp_path, **files), rubric(CMAKE_CHECK))
    assert told.hint == f'{OUT} there is no a.py in a package lab11; write pkg="lab1"'


def test_a_node_of_the_name_that_the_lab_asks_for_is_right(tmp_path) -> None:
    """The manifest is what is wrong then, which its own criterion tells."""
    launch = '<launch>\n<node pkg="lab11" type="a.py" name="a"/></launch>'
    files = {"src/a.py": "#!/usr/bin/env python3\n", "launch/x.launch": launch}
    for name, hint in (
        ("lab11", ""),
        ("lab1", f'{OUT} there is no a.py in a package lab11; write pkg="lab1"'),
    ):
        asked = rubric(CMAKE_CHECK, package=name)
        (told,) = add_advice([criterion()], facts(tmp_path / name, **files), asked)
        assert told.hint == hint


CMAKE_CPP = CMAKE + "\nadd_executable(talker src/talker.cpp)\n"
LAUNCH = (
    '<launch>\n<node pkg="lab1" type="talker" name="sender"/>\n'
    '<node pkg="lab1" type="listener.py" name="hearer"/>\n</launch>\n'
)
MIXED = {
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE_CPP,
    "src/talker.cpp": "int main() {}\n",
    "src/listener.py": "#!/usr/bin/env python3\n",
    "launch/both.launch": LAUNCH,
}
PYTHON = MIXED | {"CMakeLists.txt": CMAKE, "src/talker.py": ""}
del PYTHON["src/talker.cpp"]
STARTS = [{"name": "talker", "script": "src/talker"}, {"name": "listener", "script": "src/listener.py"}]
GRAPH = {
    "nodes": ["/sender", "/hearer"],
    "topic_types": {"/numbers": "std_msgs/Int8"},
    "publishers": {"/numbers": ["/sender"]},
    "subscribers": {"/numbers": ["/hearer"]},
    "services": {},
}


def hint(
    folder: Path,
    files: dict[str, str],
    starts: list[dict[str, str]],
    message: str = "",
    processes: dict[str, str] | None = None,
    **asked: str,
) -> str:
    """What a student reads of `LOOP`, in a criterion with these parameters."""
    package = read_package(make_package(folder / "lab1", files))
    scenario = {"title": "t", "start": starts, "until": {"window_s": 6, "topics": ["/numbers"]}}
    criterion: dict[str, Any] = {"id": "c", "check": "some", "with": asked, "scenario": "run"}
    known = rubric(criterion, scenarios={"run": scenario})
    runs = build_runs({"runs": {"run": {"graph": [{"at_s": 0, **GRAPH, "processes": processes or {}}]}}})
    facts = Facts(rubric=known, runs=runs, package=package)
    return choose_hint_language(failed(message, hint=LOOP), known.criteria[0], facts).hint


ROSPY, ROSCPP = "while not rospy.is_shutdown():", "while (ros::ok())"
OF_SCRIPTS = {"/sender": "talker", "/hearer": "listener"}


@pytest.mark.parametrize(
    ("said", "asked", "wanted"),
    [
        ("", {"process": "talker"}, ROSCPP),
        ("", {"process": "listener"}, ROSPY),
        ("", {"topic": "/numbers"}, ROSCPP),
        ("/hearer never subscribes to /numbers", {"topic": "/numbers"}, ROSPY),
        ("/sender ended", {"publisher": "sender", "subscriber": "hearer"}, ROSCPP),
        ("nothing was published", {"topic": "/other"}, f"{ROSPY} (in C++: {ROSCPP})"),
    ],
)
@pytest.mark.parametrize("launched", [False, True])
def test_each_node_of_a_mixed_package(tmp_path, said, asked, wanted, launched) -> None:
    starts = [{"name": "both", "launch": "both.launch"}] if launched else STARTS
    if launched and asked.get("process"):
        asked, said = {}, f"/{'sender' if asked['process'] == 'talker' else 'hearer'} ended"
    processes = dict.fromkeys(OF_SCRIPTS, "both") if launched else OF_SCRIPTS
    assert hint(tmp_path, MIXED, starts, said, processes, **asked) == wanted


@pytest.mark.parametrize(
    ("files", "starts", "wanted"),
    [
        (PYTHON, STARTS[1:], ROSPY),
        (PYTHON, [{"name": "both", "launch": "both.launch"}], ROSPY),
        (MIXED, STARTS[:1], ROSCPP),
        (MIXED, [{"name": "all", "built": True}], ROSCPP),
        (MIXED, [{"name": "talker", "script": "src/absent.py"}], ROSPY),
    ],
)
def test_what_a_scenario_starts_says_it_alone(tmp_path, files, starts, wanted) -> None:
    assert hint(tmp_path, files, starts, topic="/nothing") == wanted


@pytest.mark.parametrize(
    ("said", "python", "cpp"),
    [
        (init("a"), "rospy.init_node('a')", 'ros::init(argc, argv, "a")'),
        (
            init("a", anonymous=True),
            "rospy.init_node('a', anonymous=True)",
            'ros::init(argc, argv, "a", ros::init_options::AnonymousName)',
        ),
        (
            publisher("/n", "Int8, queue_size=10", type="std_msgs::Int8"),
            "rospy.Publisher('/n', Int8, queue_size=10)",
            'nh.advertise<std_msgs::Int8>("/n", 10)',
        ),
        (set_param("/on", True), "rospy.set_param('/on', True)", 'ros::param::set("/on", true)'),
        ("nothing of code", "nothing of code", "nothing of code"),
    ],
)
def test_what_is_written_in_each(said, python, cpp) -> None:
    assert in_language(said, "python") == python
    assert in_language(said, "cpp") == cpp
    assert in_language(said, None) == (python if python == cpp else f"{python} (in C++: {cpp})")


TALKER_FILE = "src/numeric_talker.py"
HANDED_OUT = "a" * 64
SAID = f"; {TALKER_FILE} is still as the course handed it out"
DIED = {"processes": [{"name": "talker", "exit_s": 0.3, "exit_code": 1}], "outcome": "ended"}


def told(
    digest: str, run: dict[str, Any] = GOOD_RUN, *, executable: bool = True
) -> dict[str, tuple[str, bool]]:
    """Each criterion's status, and whether its message ends with what is said of the script of this content."""
    files = [{**SCRIPT, "sha256": digest, "executable": executable}]
    runs = build_runs({"runs": {"talker": run}, "package": {"files": files}})
    results = judge(rubric(*ALL), runs, CHECKS, {HANDED_OUT})
    return {c.id: (c.status.value, c.message.endswith(SAID)) for c in results}


def test_a_lost_criterion_names_its_unchanged_file() -> None:
    assert told(HANDED_OUT, executable=False)["executable"] == ("fail", True)
    assert told("b" * 64, executable=False)["executable"] == ("fail", False)
    assert told(HANDED_OUT)["executable"] == ("pass", False)


def test_the_program_of_a_run_is_named_and_what_is_blocked_names_nothing() -> None:
    assert told(HANDED_OUT, DIED) == {
        "rate": ("blocked", False),
        "chatter": ("blocked", False),
        "node": ("fail", True),
        "executable": ("pass", False),
    }


def test_a_verdict_from_the_files_alone_names_it_too(tmp_path: Path) -> None:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, TALKER_FILE: NODE}
    facts = read_package(make_package(tmp_path / "lab1", tree, executable={TALKER_FILE: False}))
    (found,) = judge_files(rubric(EXECUTABLE), facts, CHECKS, {sha256(NODE.encode()).hexdigest()})
    assert found.criterion.message.endswith(SAID)


def with_starter(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / "handed_out" / "src" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return spoiled(folder, ("package: lab1\n", "package: lab1\nstarter: handed_out\n"))


def test_the_starter_belongs_to_the_rubric(tmp_path: Path) -> None:
    path = with_starter(tmp_path, talker="# TODO\n", empty="")
    loaded = load_rubric(str(path))
    assert loaded.handed_out == {sha256(b"# TODO\n").hexdigest()}  # what is empty says nothing
    names = {"handed_out/src/talker.py", "handed_out/src/empty.py"}
    assert read_beside_rubric(loaded).keys() == names
    bundle = Bundle()
    add_lab(bundle, loaded, "lab")
    assert {name for name, _, _ in bundle.entries()} == {"lab/lab.yaml", *(f"lab/{name}" for name in names)}
    with_starter(tmp_path, talker="# TO DO\n")
    assert load_rubric(str(path)).digest != loaded.digest


@pytest.mark.parametrize("files", [{}, {"empty": ""}])
def test_a_starter_without_files_is_a_fault(tmp_path: Path, files: dict[str, str]) -> None:
    (fault,) = faults(with_starter(tmp_path, **files))
    assert fault == "lab.yaml:6: starter: there is no folder handed_out with files in it beside the rubric"


@pytest.mark.parametrize(
    ("below", "params", "added"),
    [
        ("n = rospy.get_param('/number')", [], ", and one to '/number' on line 3"),
        ("n = rospy.get_param('~number')\nm = rospy.get_param( 'm' )  # get_param('x')", [],
         ", and one to '~number' on line 3 and 'm' on line 4"),
        ("n = rospy.get_param('/number', 2)", [], ""),
        ("n = rospy.get_param('/hz')", [], ""),
        ("n = rospy.get_param(name)", [], ""),
        ("rospy.set_param('/number', 2)\nn = rospy.get_param('number')", [], ""),
        ("n = rospy.get_param('~number')", [{"name": "/talker/number", "value": 2}], ""),
    ],
)  # fmt: skip
def test_parameters_that_are_not_set_either_are_named(
    below: str, params: list[dict[str, Any]], added: str
) -> None:
    lab = rubric(RATE, scenarios={"talker": {**SCENARIO, "params": params}})
    source = f"#!\nrate = rospy.get_param('/hz')\n{below}\n"
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: source}}
    runs = build_runs({"runs": {"package": package}})
    message = f"ended before (KeyError: '/hz' ({SCRIPT['path']}, line 2): the parameter '/hz' is not set)"
    verdict = failed(message, hint="give it a default: `rospy.get_param('/hz', …)`")
    found = name_other_parameters(verdict, lab.criteria[0], try_facts(lab, runs))
    assert found.hint == f"{verdict.hint}{added}"
    # those behind a module that is not there, and that an `except` may be for
    lacks = message.replace("KeyError: '/hz'", "No module named 'serial'")
    hidden = machine_lacks(lacks, hint=f"{NOTHING_TO_DO}tell")
    found = name_other_parameters(hidden, lab.criteria[0], try_facts(lab, runs))
    first = (
        f"give a default to {added.removeprefix(', and one to ')}. For the rest, " if added else NOTHING_TO_DO
    )
    assert found.hint.removesuffix("tell") == first or "get_param('/hz')" in below
    caught = {
        **package,
        "attachments": {SCRIPT["path"]: f"{source}try:\n    a()\nexcept KeyError as e:\n    pass\n"},
    }
    facts = try_facts(lab, build_runs({"runs": {"package": caught}}))
    assert name_other_parameters(hidden, lab.criteria[0], facts) == hidden


@pytest.mark.parametrize(
    "given", [{"launch": "lab1.launch"}, {"script": SCRIPT["path"], "args": ["a", "_number:=3"]}]
)
def test_parameters_are_not_named_that_a_launch_file_may_set_or_an_argument_sets(
    given: dict[str, Any],
) -> None:
    start = [{"name": "talker", **given}]
    lab = rubric(RATE, scenarios={"talker": {**SCENARIO, "start": start}})
    source = "#!\nrate = rospy.get_param('/hz')\nn = rospy.get_param('~number')\n"
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: source}}
    runs = build_runs({"runs": {"package": package}})
    message = f"ended before (KeyError: '/hz' ({SCRIPT['path']}, line 2): the parameter '/hz' is not set)"
    verdict = failed(message, hint="give it a default: `rospy.get_param('/hz', …)`")
    assert name_other_parameters(verdict, lab.criteria[0], try_facts(lab, runs)) == verdict


@pytest.mark.parametrize(
    ("below", "added"),
    [
        ("y = int(sys.argv[2])", " on lines 2 and 3"),
        ("y = float(sys.argv[2])", ""),
        ("# y = int(sys.argv[2])\nn = int(count)", ""),
    ],
)
def test_the_other_arguments_that_are_made_whole_are_named(below: str, added: str) -> None:
    lab = rubric(RATE, scenarios={"talker": SCENARIO})
    source = f"#!\nx = int(sys.argv[1])\n{below}\n"
    package = {"package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: source}}
    facts = try_facts(lab, build_runs({"runs": {"package": package}}))
    why = f"ValueError: invalid literal for int() with base 10: '2.5' ({SCRIPT['path']}, line 2)"
    verdict = failed(
        f"it ended: {why}: '2.5' is no whole number", hint="write `float(…)` in place of `int(…)`"
    )
    assert name_other_lines(verdict, facts).hint == f"{verdict.hint}{added}"


@pytest.mark.parametrize(
    ("line", "other", "added"),
    [
        ("from laab.msg import Num as N", "", "; write `from lab.msg import Num as N` on line 3"),
        ("from laab.msg import Sum", "from laab.msg import Num, Sum",
         "; write `from lab.msg import Sum` on line 3; write `from lab.msg import Num, Sum` on line 2 of src/other.py"),
        ("import laab.msg as m", "    from laab.msg import Num",
         "; write `import lab.msg as m` on line 3; write `from lab.msg import Num` on line 2 of src/other.py"),
        ("from std_msgs.msg import Num", "from lab.msg import Num", ""),
        ("from lab.msg import Sum", "from lab.msg import Sum", ""),
        ("from laabs.msg import Num", "# from laab.msg import Num", ""),
    ],
)  # fmt: skip
def test_other_imports_from_the_same_wrong_module_are_named(line: str, other: str, added: str) -> None:
    lab, wrong = rubric(RATE, scenarios={"talker": SCENARIO}), "from laab.msg import Num"
    texts = {SCRIPT["path"]: f"#!\n{wrong}\n{line}\n", "src/other.py": f"#!\n{other}\n"}
    files = [{**SCRIPT, "path": path} for path in texts]
    made = [{"path": f"msg/{name}.msg", "fields": []} for name in ("Num", "Sum")]
    package = {"package": {"name": "lab", "files": files, "interfaces": made}, "attachments": texts}
    why = f"ModuleNotFoundError: No module named 'laab' ({SCRIPT['path']}, line 2): the build makes Num"
    verdict = failed(f"it ended: {why}", hint="write `from lab.msg import Num`")
    found = name_other_imports(
        verdict, lab.criteria[0], try_facts(lab, build_runs({"runs": {"package": package}}))
    )
    assert found.hint == f"{verdict.hint}{added}"


@pytest.mark.parametrize(
    ("line", "lines"),
    [
        ("    s = smtplib.SMTP('smtp.example.org', 587)", "line 3"),
        ("page = urlopen('http://example.org')\nrequests.get('https://example.org')", "lines 3 and 4"),
        ("s = smtplib.SMTP('localhost', 25)", ""),
        ("requests.get('http://127.0.0.1:8080/')", ""),
        ("# s = smtplib.SMTP('smtp.example.org', 587)", ""),
        ("requests.get(url)", ""),
        ("try:\n    urlopen('http://example.org')\nexcept OSError:\n    pass", ""),
        ("try:\n    urlopen('http://example.org')\nexcept rospy.ROSInterruptException:\n    pass", "line 4"),
    ],
)
def test_what_needs_the_network_behind_a_question_is_named(line: str, lines: str) -> None:
    lab = rubric(RATE, scenarios={"talker": SCENARIO})
    package = {
        "package": {"files": [SCRIPT]}, "attachments": {SCRIPT["path"]: f"#!\nname = input()\n{line}\n"},
    }  # fmt: skip
    facts = try_facts(lab, build_runs({"runs": {"package": package}}))
    why = (
        f"EOFError: EOF when reading a line ({SCRIPT['path']}, line 2): it waits for input, and a graded node"
    )
    verdict = failed(f"it ended: {why} gets no input", hint="write a value")
    told = f"; then leave out what connects to another machine on {lines}, as a graded node is offline"
    assert name_connections(verdict, facts).hint == f"write a value{told if lines else ''}"
    assert name_connections(failed(f"it ended: {why}", hint="write a value"), facts).hint == "write a value"


def test_no_topic_is_renamed_that_another_criterion_asks_for() -> None:
    lab = load_rubric("leeds-comp3631-lab1").rubric
    chatter = next(c for c in lab.criteria if c.id == "chatter")
    hint = "add a publisher, or rename {} if that is meant to be it"
    for others, left in (
        ("/numeric_chatter", "add a publisher"),
        ("/numeric_chatter or /wrods", hint.format("/wrods")),
        ("/chatter/text", "write /chatter in place of /chatter/text"),
        ("/chatter/text or /wrods", hint.format("/chatter/text or /wrods")),
    ):
        verdict = failed("no message came on /chatter", hint=hint.format(others))
        assert keep_other_names(verdict, chatter, lab).hint == left
