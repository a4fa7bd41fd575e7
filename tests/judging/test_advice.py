"""What hints say of the package as a whole: what does not start and costs nothing."""

from __future__ import annotations

from grader.judging.annotate import add_advice
from grader.model.package import PackageFacts
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.package.facts import read_package
from tests.judging.rubrics import rubric
from tests.package.trees import CMAKE, MANIFEST, make_package

CMAKE_CHECK = {"id": "cmake", "check": "cmake", "with": {"name": "lab1"}}
OUT = "roslaunch leaves a <node> out: launch/x.launch, line 2:"
NODES = '<launch>\n<node pkg="lab1" type="talker" name="a"/>\n<node pkg="lab1" type="plain.py" name="b"/></launch>'


def facts(folder, **files: str) -> PackageFacts:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, **files}
    return read_package(make_package(folder / "lab1", tree, executable={"src/plain.py": False}))


def criterion(
    hint: str = "", *, status: Status = Status.PASS, scenario: str | None = None
) -> CriterionResult:
    return CriterionResult(
        id="cmake",
        title="",
        check="cmake",
        scenario=scenario,
        status=status,
        points=0,
        max_points=1,
        message="",
        expected="",
        measured="",
        hint=hint,
        reproduce="",
        citations=(),
    )


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
        "src/old.py does not parse: this is Python 2: `print` needs brackets, `print(...)`",
        "line 1: write `print('a')`",
        f'{OUT} there is no talker in the package: type="talker" lacks the .py of src/talker.py',
        'write type="talker.py"',
        "src/plain.py has no executable bit, so that roslaunch does not find it (launch/x.launch, line 3)",
        "chmod +x src/plain.py, then git add --chmod=+x src/plain.py, commit and push",
    ]
    assert add_advice([told], package, rubric(CMAKE_CHECK)) == (told,)
    lost = criterion(status=Status.FAIL)
    assert add_advice([lost], package, rubric(CMAKE_CHECK)) == (lost,)
