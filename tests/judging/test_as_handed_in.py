import pytest

from grader.judging.repeats_and_repairs import with_lines_as_handed_in
from grader.model.repair import Repair
from grader.model.verdict import FileCitation, failed

IMPORT = Repair(
    kind="missing-import",
    file="a.py",
    line=2,
    before="import rospy",
    after="import rospy\nfrom std_msgs.msg import Int8",
    message="",
    fix="",
)
GLOBAL = Repair(
    kind="python-syntax",
    file="a.py",
    line=5,
    before="    if x:\n        global x\n        x = 1\n        global y",
    after="    global x, y\n    if x:\n        x = 1",
    message="",
    fix="",
)
RENAME = Repair(kind="file-name", file="a.py", before="a.py", after="b.py", message="", fix="")


@pytest.mark.parametrize(
    ("repairs", "file", "on_copy", "as_handed_in"),
    [
        ((IMPORT,), "a.py", 1, 1),
        ((IMPORT,), "a.py", 2, 2),
        ((IMPORT,), "a.py", 9, 8),
        ((IMPORT,), "other.py", 9, 9),
        ((GLOBAL,), "a.py", 6, 5),
        ((GLOBAL,), "a.py", 7, 7),
        ((GLOBAL,), "a.py", 8, 9),
        ((IMPORT, RENAME), "b.py", 9, 8),
        ((RENAME,), "b.py", 9, 9),
    ],
)
def test_lines_of_the_copy_are_told_as_they_were_handed_in(repairs, file, on_copy, as_handed_in):
    place = FileCitation(file=file, line=on_copy)
    verdict = failed(f"{file}, line {on_copy} asks", hint=f"on line {on_copy}, write it", citations=(place,))
    told = with_lines_as_handed_in(verdict, repairs)
    assert told.message == f"{file}, line {as_handed_in} asks"
    assert told.hint == f"on line {as_handed_in}, write it"
    assert told.citations == (FileCitation(file=file, line=as_handed_in),)


def test_several_lines_and_those_of_other_files_in_one_text():
    cited = (FileCitation(file="a.py", line=9), FileCitation(file="c.py", line=9))
    hint = "write it on lines 8, 9 and 12 of a.py, and on line 9 of c.py; line 3"
    told = with_lines_as_handed_in(failed("", hint=hint, citations=cited), (IMPORT,))
    assert told.hint == "write it on lines 7, 8 and 11 of a.py, and on line 9 of c.py; line 3"
