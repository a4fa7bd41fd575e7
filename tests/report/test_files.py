from __future__ import annotations

import errno
import io
import json
import os
from pathlib import Path

import pytest

from grader.classes.review.guard import REPORTS as SHOWN_IN_REVIEW
from grader.cli.display import REPORTS as SHOWN_AT_THE_END
from grader.errors import HostError, OutputError
from grader.files import atomic_write, check_writable
from grader.integrations.ci_systems import REPORT_NAMES
from grader.model.repair import Repair
from grader.model.result import ErrorInfo, Repaired
from grader.model.verdict import FileCitation, Mistake, Status
from grader.report.files import result_bytes, write_reports
from grader.report.forms import FORMS
from grader.report.losses import arrange
from grader.report.markdown import render_markdown
from grader.report.sentences import repair_words
from grader.report.terminal import Terminal, open_console
from grader.report.view import without_hidden
from grader.results import RESULT, RESULT_FILES
from tests.report.hostile import result, rubric
from tests.support.a_class import criterion

KEYS = [
    "schema",
    "submission",
    "rubric",
    "status",
    "points",
    "max_points",
    "criteria",
    "environment",
    "timing",
]
CRITERION_KEYS = [
    *("id", "title", "check", "scenario", "status", "points", "max_points"),
    *("message", "expected", "measured", "hint", "reproduce", "citations"),
]


def hiding(*names: str):
    plain = rubric()
    criteria = [
        c.model_dump(by_alias=True) | {"visibility": "hidden" if c.id in names else "visible"}
        for c in plain.criteria
    ]
    return rubric(criteria=tuple(criteria))


def test_result_has_exactly_the_fixed_keys_in_order():
    data = json.loads(result_bytes(result()))
    assert list(data) == KEYS
    assert data["schema"] == "grader.result/1"
    assert list(data["criteria"][0]) == CRITERION_KEYS
    assert list(data["submission"]) == ["id", "source", "commit", "digest", "package"]
    assert data["criteria"][1]["citations"] == [
        {"file": "src/numeric_talker.py", "line": 17},
        {
            "evidence": "real.mcap",
            "topic": "/chatter",
            "from_ns": 1_700_000_000_000_000_000,
            "to_ns": 1_700_000_006_000_000_000,
        },
    ]


def test_error_is_there_only_where_there_is_one():
    failed = result(status="error", error=ErrorInfo(kind="host", message="m", hint="h"))
    assert list(json.loads(result_bytes(failed))) == [*KEYS, "error"]


def test_all_files_are_written_and_nothing_beside_them(tmp_path):
    paths = write_reports(result(), tmp_path / "a" / "b", console="x\x1b[2J\ny", rubric=rubric())
    assert sorted(p.name for p in paths) == [
        "console.log",
        "junit.xml",
        "report.html",
        "report.md",
        "result.json",
    ]
    assert sorted(p.name for p in (tmp_path / "a" / "b").iterdir()) == sorted(p.name for p in paths)
    assert (tmp_path / "a/b/console.log").read_text() == "x\\x1b[2J\ny"


def test_hidden_criteria_are_left_out_everywhere(tmp_path):
    write_reports(result(), tmp_path, console="", rubric=hiding("talker-node", "build"), keep_hidden=False)
    for name in ("result.json", "junit.xml"):
        assert "the node printed" not in (tmp_path / name).read_text()
    assert "1 of 9 visible checks passed; 2 more run at grading." in (tmp_path / "report.md").read_text()


def test_without_hidden_recounts():
    shown = without_hidden(result(), hiding("build", "launch", "style"))
    assert (shown.points, shown.max_points, shown.status) == (12.5, 60, "graded")
    assert without_hidden(result(), rubric()) == result()


def test_blocked_ones_are_folded_under_their_root():
    view = arrange(result(), rubric())
    folded = {loss.criterion.id: [b.id for b in loss.blocked] for loss in view.lost}
    assert folded == {
        "talker-node": ["counter-start", "counter-step", "counter-wrap"],
        "chatter-rate": [],
        "listener-chatter": [],
    }
    assert [loss.criterion.id for loss in view.open] == ["build", "launch", "style"]
    assert [c.id for c in view.advice] == ["talker-name"]


def test_what_is_open_for_one_reason_is_one_entry():
    no_ros = [
        criterion(n, Status.INCONCLUSIVE, 0, 5, hint="install ROS")
        for n in ("build", "launch", "talker-node")
    ]
    (entry,) = arrange(result(criteria=tuple(no_ros)), rubric()).open
    assert [entry.criterion.id, *(c.id for c in entry.alike)] == ["build", "launch", "talker-node"]
    assert entry.points == 15


@pytest.mark.parametrize(
    ("messages", "mistakes"),
    [
        (("the path is mirrored", "the path is mirrored"), 1),
        (("/chatter comes in bursts: 11.5 Hz", "/numeric_chatter comes in bursts: 11.49 Hz"), 1),
        (("no message came on /chatter", "no message came on /numeric_chatter"), 2),
        (("it ends 0.4 m from (3, 2)", "it ends 0.43 m from (8, 8)"), 1),
    ],
)
def test_one_mistake_is_told_once(messages, mistakes):
    names = ("talker-node", "chatter-rate")
    same = [
        criterion(name, Status.FAIL, 0, 5, hint="do this", message=message)
        for name, message in zip(names, messages, strict=True)
    ]
    assert len(arrange(result(criteria=tuple(same)), rubric()).lost) == mistakes


def not_executable(name, path):
    message, hint = f"{path} is not executable; rosrun answers: no", f"chmod +x {path}, then git add it"
    mistake = Mistake(kind="not-executable", name=path)
    return criterion(name, Status.FAIL, 0, 5, check="executable", message=message, hint=hint, mistake=mistake)


BITS = (not_executable("talker-executable", "src/a.py"), not_executable("listener-executable", "src/b.py"))


def test_one_chmod_is_told_once_and_names_both_scripts():
    (loss,) = arrange(result(criteria=BITS), rubric()).lost
    assert loss.criterion.message == "src/a.py and src/b.py are not executable"
    assert loss.criterion.hint == "chmod +x src/a.py src/b.py, then git add it"
    assert (loss.points, [c.id for c in loss.alike]) == (10, ["listener-executable"])


def test_scripts_that_the_build_would_make_executable_are_told_with_their_installation():
    message = "CMakeLists.txt: catkin_install_python(…) does not name src/a.py and src/b.py"
    install = criterion(
        "install", Status.FAIL, 0, 10, check="cmake-install", message=message, hint="write src/a.py src/b.py"
    )
    (loss,) = arrange(result(criteria=(*BITS, install)), rubric()).lost
    assert (loss.criterion.id, loss.points) == ("install", 20)
    assert (
        loss.criterion.hint
        == "write src/a.py src/b.py; the build then makes src/a.py and src/b.py executable"
    )
    assert (
        loss.criterion.message == message
    )  # that a bit is missing is no more than what the build makes up for
    lines = tuple(
        one.model_copy(
            update={
                "message": f"{one.mistake.name} cannot be run: there is no `#!` line; rosrun answers: import",
                "mistake": one.mistake.model_copy(update={"kind": "cannot-be-run"}),
            }
        )
        for one in BITS
        if one.mistake
    )
    (loss,) = arrange(result(criteria=(*lines, install)), rubric()).lost
    assert loss.criterion.message == f"{message}; src/a.py and src/b.py cannot be run: there is no `#!` line"
    both = (one.model_copy(update={"hint": f"write #!/bin/x; {one.hint}"}) for one in lines)
    (loss,) = arrange(result(criteria=(*both, install)), rubric()).lost
    end = "makes programs of src/a.py and src/b.py; in src/a.py and src/b.py, write #!/bin/x"
    assert loss.criterion.hint == f"write src/a.py src/b.py; the build then {end}"
    other = install.model_copy(update={"message": "catkin_install_python(…) does not name src/a.py"})
    told = arrange(result(criteria=(*BITS, other)), rubric()).lost
    assert [(one.criterion.id, one.points) for one in told] == [("install", 15), ("listener-executable", 5)]


def test_why_a_script_cannot_be_run_is_told_where_the_build_makes_up_for_it():
    unusable = criterion(
        "talker-executable",
        Status.FAIL,
        0,
        5,
        check="executable",
        message="src/a.py cannot be run: there is no `#!` line at the top; rosrun answers: no",
        hint="write #!/usr/bin/env python3",
        citations=(FileCitation(file="src/a.py", line=1),),
        mistake=Mistake(kind="cannot-be-run", name="src/a.py"),
    )
    install = criterion(
        "install", Status.FAIL, 0, 10, check="cmake-install", message="nothing installs src/a.py", hint="do"
    )
    (loss,) = arrange(result(criteria=(unusable, install)), rubric()).lost
    assert loss.criterion.message == (
        "nothing installs src/a.py; src/a.py cannot be run: there is no `#!` line at the top"
    )
    assert loss.criterion.hint == (
        "do; the build then makes a program of src/a.py; in src/a.py, write #!/usr/bin/env python3"
    )
    assert loss.criterion.citations == unusable.citations


def test_files_that_are_missing_are_all_named_in_markdown():
    paths = {"talker-executable": "src/a.py", "launch": "launch/a.launch"}
    criteria = tuple(
        criterion(
            name,
            Status.FAIL,
            0,
            5,
            message=f"{path.rpartition('/')[2]} is not in the package; there is other.txt",
            expected=f"{path}, with a node",
            hint=f"write {path}, and push it; then add msg/A.msg",
            mistake=Mistake(kind="file-missing", name=path),
        )
        for name, path in paths.items()
    )
    text = render_markdown(result(criteria=criteria), rubric())
    assert "to fix: 2 files are not in the package: `src/a.py` and `launch/a.launch`" in text
    for name, path in paths.items():
        assert f"- `{path}` (`{name}` 0/5): with a node; there is `other.txt`" in text
    assert "- Hint: write these files, and push them; then add `msg/A.msg`\n" in text
    assert "The same holds for" not in text


def copied(name, status, points, *, charged=False, **fields):
    """A criterion of 5 points that was judged on a copy without a mistake in its indentation."""
    repair = Repair(kind="python-syntax", file="a.py", line=1, message="line 1 of a.py: tabs", fix="spaces")
    use = Repaired(repairs=(repair,), share=0.5, charged=charged)
    return criterion(name, status, points, 5, repaired=use, **fields)


def test_what_is_lost_on_the_repaired_copy_too_is_told_by_itself():
    on_copy = "judged on a copy with a.py line 1 repaired: "
    criteria = (
        copied("talker-node", Status.FAIL, 0, charged=True, message="tabs"),
        copied("chatter-rate", Status.PARTIAL, 2.5, message=f"{on_copy}half of the points; 10 Hz"),
        copied("counter-start", Status.FAIL, 0, message=f"{on_copy}/a begins with 1", hint="add later"),
        copied("counter-step", Status.FAIL, 0, message=f"{on_copy}/b begins with 2", hint="add later"),
    )
    lost = arrange(result(criteria=criteria), rubric()).lost
    told = [(loss.criterion.id, [c.id for c in loss.alike]) for loss in lost]
    assert told == [("counter-start", ["counter-step"]), ("talker-node", ["chatter-rate"])]


def test_repairs_of_one_loss_are_told_together():
    bits = [
        Repair(kind="executable-bit", file=name, message=f"{name} is not executable", fix=f"chmod +x {name}")
        for name in ("src/a.py", "src/b.py")
    ]
    use = Repaired(repairs=tuple(bits), share=1, charged=True)
    lost = criterion("launch", Status.FAIL, 0, 5, repaired=use)
    free = criterion("advice", Status.FAIL, 0, 0, repaired=use.model_copy(update={"repairs": (bits[0],)}))
    assert repair_words(result(criteria=(lost,))) == (
        "src/a.py and src/b.py are not executable: this costs you 5 points (launch)",
    )
    assert repair_words(result(criteria=(free,))) == ()
    of_no_use = criterion("build", Status.FAIL, 0, 5, repaired=use.model_copy(update={"charged": False}))
    assert repair_words(result(criteria=(of_no_use,))) == ()


def test_two_faults_that_cost_the_same_criterion_are_told_in_one_sentence():
    bit = Repair(kind="executable-bit", file="src/a.py", message="src/a.py is not executable", fix="")
    tabs = Repair(kind="python-syntax", file="src/a.py", line=7, message="line 7 of src/a.py: tabs", fix="")
    both = Repaired(repairs=(bit, tabs), share=0.5, charged=True)
    one = both.model_copy(update={"repairs": (tabs,), "charged": False})
    criteria = (
        criterion("executable", Status.FAIL, 0, 5, repaired=both),
        criterion("rate", Status.PARTIAL, 5, 10, repaired=one),
    )
    blocked = criterion("step", Status.BLOCKED, 0, 10, repaired=one, blocked_by="rate")
    undecided = criterion("node", Status.INCONCLUSIVE, 0, 5, repaired=one)  # the machine lacks a package
    (words,) = repair_words(result(criteria=(*criteria, blocked, undecided)))
    assert words == (
        "src/a.py is not executable and line 7 of src/a.py: tabs: this costs you 5 points (executable); "
        "rate was judged with this repaired, for 50% of the points"
    )


def test_criteria_that_earn_other_shares_of_a_repaired_copy_are_told_apart():
    repair = Repair(kind="file-name", file="a.py", message="a.py should be b.py", fix="")
    use = Repaired(repairs=(repair,), share=1, charged=True)
    free = use.model_copy(update={"charged": False})
    criteria = (
        criterion("file", Status.FAIL, 0, 10, repaired=use),
        criterion("node", Status.PASS, 10, 10, repaired=free),
        criterion("build", Status.PARTIAL, 5, 10, repaired=free.model_copy(update={"share": 0.5})),
    )
    (words,) = repair_words(result(criteria=criteria))
    assert words == (
        "a.py should be b.py: this costs you 10 points (file); node was judged with this repaired; "
        "build was judged with this repaired, for 50% of the points"
    )


def test_a_blocked_criterion_whose_cause_is_not_there_is_told_by_itself():
    alone = result(criteria=(criterion("counter-step", Status.BLOCKED, 0, 5),))
    assert [loss.criterion.id for loss in arrange(alone, rubric()).lost] == ["counter-step"]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    target = tmp_path / "result.json"
    target.write_text("old")

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(HostError) as caught:
        atomic_write(target, b"new")
    assert caught.value.message == f"cannot write {target}: the disk is full"
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_interrupted_write_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(_descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        atomic_write(tmp_path / "x", b"new")
    assert list(tmp_path.iterdir()) == []


def test_new_files_are_their_owners_and_public_ones_follow_the_umask(tmp_path):
    (tmp_path / "there").touch(0o666)
    before = os.umask(0o027)
    try:
        for name in ("own/x", "there"):
            atomic_write(tmp_path / name, b"")
        atomic_write(tmp_path / "all" / "x", b"", public=True)
    finally:
        os.umask(before)
    modes = {
        name: (tmp_path / name).stat().st_mode & 0o777 for name in ("own", "own/x", "there", "all", "all/x")
    }
    assert modes == {"own": 0o700, "own/x": 0o600, "there": 0o600, "all": 0o750, "all/x": 0o640}


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nowhere", "/proc/1/x"])
def test_a_folder_that_cannot_be_written_is_told_before(place, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"^cannot write .*: [A-Z]") as caught:
        check_writable(tmp_path / place)
    assert "\n" not in caught.value.message


def test_the_look_leaves_nothing_behind(tmp_path):
    check_writable(tmp_path / "new" / "folder")
    check_writable(tmp_path)
    assert list(Path(tmp_path).iterdir()) == []


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
@pytest.mark.parametrize("number", ["7", "13"])
def test_carets_stand_below_what_is_meant_whatever_the_encoding(encoding, number):
    console = open_console(io.TextIOWrapper(io.BytesIO(), encoding))
    text, carets = Terminal(console)._code(f"{number} | …r, mgs.data)", f"{' ' * len(number)} |     ^^^")
    assert text.plain.index("mgs") == carets.plain.index("^")
    assert "\\u" not in text.plain


def test_files_beside_a_result_are_known_wherever_they_are_handled():
    written = {form.file for form in FORMS.values() if form.in_results}
    for names in (RESULT_FILES, SHOWN_AT_THE_END, SHOWN_IN_REVIEW, REPORT_NAMES):
        assert written | {RESULT} <= set(names)
