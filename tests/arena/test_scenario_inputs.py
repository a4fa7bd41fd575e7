"""What the grader gives to a run: texts and numbers for a listener, and files of the package, within bounds."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from grader.arena.process_environment import TEXT_BYTES_MAX, ProcessEnvironment
from grader.arena.recording_files import (
    ATTACHED_BYTES_MAX,
    ATTACHED_FILES_MAX,
    attachments,
    left_out_events,
)
from grader.arena.run_scenario import set_params
from grader.arena.scenario_inputs import FILE_BYTES_MAX, made_up, make_shots, settings
from grader.arena.source_waits import IDLE, NAPS, SLEEPING, gives_up, naps, polled, sleeps_elsewhere
from grader.evidence.events import ActorEvent
from grader.files import read_untrusted
from grader.package.facts import read_package
from grader.rubric.scenario import Param, Probe
from tests.package.trees import CMAKE, MANIFEST, make_package

CHATTER = Probe(topic="/chatter", type="std_msgs/String", text=8)


def test_one_text_comes_twice_running_neither_first_nor_last() -> None:
    for _ in range(50):
        values = [shot.value for shot in make_shots((CHATTER,))]
        same = [i for i, (a, b) in enumerate(pairwise(values)) if a == b]
        assert len(values) == 8
        assert len(set(values)) == 7
        assert len(same) == 1
        assert 0 < same[0] < 6


def test_the_first_of_the_two_has_time_to_be_printed() -> None:
    shots = make_shots((CHATTER,))
    for shot, following in pairwise(shots):
        assert shot.pause_s == pytest.approx(0.3 if shot.value == following.value else 0.1)


def test_few_texts_and_numbers_come_once() -> None:
    texts = [shot.value for shot in make_shots((CHATTER.model_copy(update={"text": 3}),))]
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=3, among=(-128, 0, 127))
    values = [shot.value for shot in make_shots((numbers,))]
    assert len(set(texts)) == len(texts) == 3
    assert len(set(values)) == len(values) == 6


def test_one_of_many_numbers_comes_twice_in_a_row() -> None:
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=20, among=(-128, 0, 127))
    values = [shot.value for shot in make_shots((numbers,))]
    assert len(values) == 23
    assert len(set(values)) == 22
    assert sum(a == b for a, b in pairwise(values)) == 1
    assert {-128, 0, 127} <= set(values)


@pytest.mark.parametrize(("kind", "largest"), [("Int8", 127), ("Int16", 10_000), ("UInt64", 10_000)])
def test_the_sum_and_the_double_of_made_up_numbers_fit_a_wide_type(kind: str, largest: int) -> None:
    numbers = Probe(topic="/n", type=f"std_msgs/{kind}", integers=100)
    values = [shot.value for shot in make_shots((numbers,))]
    assert largest // 2 < max(values) <= largest
    assert -largest - 1 <= min(values)  # an Int8 goes from -128 on


def test_topics_take_turns() -> None:
    numbers = Probe(topic="/n", type="std_msgs/Int8", integers=3)
    shots = make_shots((CHATTER, numbers))
    assert [shot.topic for shot in shots[:4]] == ["/chatter", "/n", "/chatter", "/n"]
    assert sorted({shot.topic for shot in shots[6:]}) == ["/chatter"]


def test_a_text_that_is_cut_is_noticed() -> None:
    texts = [str(shot.value) for shot in make_shots((CHATTER,))]
    for cut in (
        lambda t: t[:18],
        lambda t: t.split(",")[0],
        lambda t: t.split(":")[0],
        lambda t: t.rstrip("0123456789"),
    ):
        assert any(cut(text) != text for text in texts)


@pytest.mark.parametrize("like", ["12 Station Road, Mumbai", "Asha", "+91 98-76", "a\nb: c\n", "Al", "", "7"])
def test_what_is_made_up_has_the_shape_of_the_original(like: str) -> None:
    found = {made_up(like) for _ in range(20)}
    assert len(found) >= 18, "two of 20 may be alike by chance"
    for text in found:
        rest = "".join("x" if c.isalnum() else c for c in text)
        assert rest.startswith("".join("x" if c.isalnum() else c for c in like).rstrip())
        assert [c.isdigit() for c in text][: len(like.rstrip())] == [c.isdigit() for c in like.rstrip()]
        assert sum(c.isalnum() for c in text) >= 5


GOOD = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE}


def test_files_that_the_evidence_does_not_hold_are_named(tmp_path: Path) -> None:
    files = {f"src/{number:03}.py": "x = 1\n" for number in range(ATTACHED_FILES_MAX)}
    package = make_package(tmp_path / "lab1", {**GOOD, **files, "a.txt": "y" * (ATTACHED_BYTES_MAX + 1)})
    facts = read_package(package)
    held = dict(attachments(package.folder, facts))
    assert len(held) == ATTACHED_FILES_MAX
    assert len(held["a.txt"]) == ATTACHED_BYTES_MAX
    assert [(event.action, event.actor) for event in left_out_events(facts)] == [
        ("limit", "a.txt"),
        ("limit", "the package"),
    ]
    assert list(left_out_events(read_package(make_package(tmp_path / "lab2", GOOD)))) == []


def test_a_readme_is_held_and_takes_no_codes_place(tmp_path: Path) -> None:
    few = make_package(tmp_path / "lab1", {**GOOD, "README.md": "# Lab 1"})
    assert dict(attachments(few.folder, read_package(few)))["README.md"] == b"# Lab 1"
    files = {f"src/{number:03}.py": "x = 1\n" for number in range(ATTACHED_FILES_MAX)}
    many = make_package(tmp_path / "lab2", {**files, "package.xml": MANIFEST, "README.md": "# Lab 1"})
    assert "README.md" not in dict(attachments(many.folder, read_package(many)))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a: 1\n" * (FILE_BYTES_MAX // 5 + 1), "too large"),
        ("\n".join(f"a{number}: 1" for number in range(2_000)), "too much in it"),
        ("a: " + "[" * 50 + "]" * 50, "too much in it"),
        ("a: &a [1, 1]\n" + "".join(f"b{n}: *a\n" for n in range(30)), "too much in it"),
    ],
)
def test_parameters_that_are_too_much_are_named(text: str, why: str, tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(text)
    arena = SimpleNamespace(place=SimpleNamespace(package_file=lambda _: file))
    noted, arena.send = list[ActorEvent](), lambda **_: None
    arena.note = noted.append
    set_params((Param(file="p.yaml", also=("/a",)),), arena)  # type: ignore[arg-type] # as much as it looks at
    assert [(event.action, event.detail) for event in noted] == [("limit", f"p.yaml: {why}")]


def test_what_a_file_has_in_another_place_keeps_its_shape(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text("details:\n  - name: {first: Asha}\n  - contact: {phone: 77777}\n")
    params = (Param(file="p.yaml", also=("/details/contact/phone", "/details/name/first")),)
    found, remarks = settings(params, lambda _: file)
    _, phone, first = (one.value for one in found)
    assert isinstance(phone, int)
    assert isinstance(first, str)
    assert remarks == []


def test_a_service_text_that_is_too_large_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "lab" / "msg"
    folder.mkdir(parents=True)
    place = SimpleNamespace(workspace=SimpleNamespace(repaired=tmp_path), share_folders=())
    (folder / "Odd.msg").write_text("int8 x\n" * (TEXT_BYTES_MAX // 7))
    find = partial(ProcessEnvironment.type_text, place)  # type: ignore[arg-type] # as much of a place as it looks at
    assert find("lab/Odd", "msg") is not None
    (folder / "Odd.msg").write_text("int8 x\n" * (TEXT_BYTES_MAX // 7 + 1))
    with pytest.raises(ValueError, match=r"Odd\.msg is larger than 64 kB"):
        find("lab/Odd", "msg")


def test_what_is_read_is_a_regular_file_and_no_longer_than_the_limit(tmp_path: Path) -> None:
    file = tmp_path / "a"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)
    assert read_untrusted(file, 100) == bytes(100)
    assert read_untrusted(tmp_path, 100) is None


@pytest.mark.parametrize(
    ("text", "only_sleeps"),
    [
        ("while True:\n    time.sleep(1)\nrospy.init_node('a')\n", True),
        (
            "def f():\n    while not rospy.is_shutdown():\n        print('x')\n\n        rospy.sleep(1)\n    g()\n",
            True,
        ),
        ("while 1: sleep(1)", True),
        ("while True:\n    # not yet\n    time.sleep(1)\n# now\n\nrospy.spin()\n", True),
        ("while True:\n    time.sleep(1)\n\n\n    work()\n", False),
        ("while True:\n    time.sleep(1)\n# and\n    work()\n", False),
        ("while True: time.sleep(1); work()\n", False),
        ("while not ready:\n    time.sleep(1)\n", False),
        ("while True:\n    pub.publish(1)\n    rate.sleep()\n", False),
    ],
)
def test_a_loop_that_only_sleeps_is_known_by_its_lines(text: str, only_sleeps: bool) -> None:
    assert bool(SLEEPING.search(text.encode())) == only_sleeps


def test_who_sleeps_elsewhere_too_may_go_on() -> None:
    """A node that waits for five seconds at its start, and sleeps at its end in place of `rospy.spin()`."""
    end = "while not rospy.is_shutdown():\n    rospy.sleep(1)\n"
    assert not sleeps_elsewhere(f"while True: time.sleep(1)\nrate.sleep()\n{end}".encode())
    for before in (
        "for i in range(5):\n    time.sleep(1)",
        "time.sleep (1)",
        "rospy.wait_for_service('/spawn')",
    ):
        assert sleeps_elsewhere(f"{before}\nrospy.init_node('a')\n{end}".encode())


@pytest.mark.parametrize("text", ["while{}x", "while True{}x", "while(True{}x", "while not{}x", "sleep{}x"])
def test_blanks_without_end_are_read_in_linear_time(text: str) -> None:
    blanks = text.format(" " * 200_000).encode()
    assert not any(pattern.search(blanks) for pattern in (SLEEPING, IDLE, NAPS))
    assert not gives_up(blanks)


def test_loops_within_loops_are_read_in_linear_time() -> None:
    assert not gives_up(b"\n".join([b"while True:", *[b" while True:" + b" " * 300] * 5000]))


RETRYING = """def ask():
    while not rospy.is_shutdown():
        try:
            rospy.wait_for_service('/add', timeout=1)
            break
        except rospy.ROSException as error:
            rospy.logwarn('not yet')  # again
            rospy.sleep(0.5)

    print('there')
"""


@pytest.mark.parametrize(
    ("old", "new", "gives"),
    [
        ("", "", False),
        ("            rospy.sleep(0.5)\n", "        rate.sleep()\n", False),
        ("            break\n", "            break\n        except KeyError:\n            pass\n", False),
        ("            break\n", "            break\n        except KeyError:\n            return\n", True),
        (
            "            break\n",
            "            break\n        except rospy.ROSInterruptException:\n            return\n",
            False,
        ),
        ("            break\n", "            print(rospy.ServiceProxy('/add', Add)(1, 2))\n", False),
        ("            break\n", "            there = True\n", False),
        ("while not rospy.is_shutdown()", "while not there and not rospy.is_shutdown()", False),
        ("while not rospy.is_shutdown()", "while there is False", False),
        ("while not rospy.is_shutdown()", "while not rospy.is_shutdown() and time.time() < end", True),
        ("while not rospy.is_shutdown()", "for _ in range(5)", True),
        ("        try:\n", "        tries += 1\n        try:\n", True),
        (
            "            rospy.wait_for_service('/add', timeout=1)\n            break\n",
            "            rospy.wait_for_service('/add', timeout=1)\n        else:\n            break\n",
            True,
        ),
        ("rospy.sleep(0.5)", "break", True),
        (
            "            rospy.logwarn('not yet')  # again\n            rospy.sleep(0.5)\n",
            "            return\n",
            True,
        ),
        ("rospy.sleep(0.5)", "self.exit_or_sleep()", True),
        ("rospy.sleep(0.5)", "raise", True),
        ("rospy.sleep(0.5)", "tries += 1", True),
        ("            rospy.sleep(0.5)\n", "        if late():\n            break\n", True),
        (
            "rospy.sleep(0.5)\n",
            "rospy.sleep(0.5)\n\n        tries += 1\n        if tries > 5:\n            break\n",
            True,
        ),
        ("not rospy.is_shutdown()", "tries < 5", True),
        ("    print('there')", "    rospy.wait_for_service('/sub', 5)", True),
        (", timeout=1", "", False),
    ],
)
def test_a_client_that_asks_again_without_end_does_not_give_up(old: str, new: str, gives: bool) -> None:
    assert old in RETRYING
    assert gives_up(RETRYING.replace(old, new, 1).encode()) is gives


@pytest.mark.parametrize(
    ("caught", "gives"),
    [
        ("rospy.ROSInterruptException as e", False),
        ("(rospy.ROSInterruptException, KeyboardInterrupt)", False),
        ("(rospy.ROSInterruptException, rospy.ROSException)", True),
        ("(KeyboardInterrupt, Exception) as e", True),
    ],
)
def test_only_a_handler_of_ctrl_c_ends_no_wait(caught: str, gives: bool) -> None:
    handled = RETRYING.replace(
        "            break\n", f"            break\n        except {caught}:\n            return\n"
    )
    assert gives_up(handled.encode()) is gives


@pytest.mark.parametrize(
    ("loop", "gives"),
    [
        ("while not client.wait_for_server(rospy.Duration(1)):\n    rospy.loginfo('waiting')\n", False),
        ("while not client.wait_for_server(rospy.Duration(1)) and tries < 5:\n    rospy.loginfo('waiting')\n", True),
        ("while not client.wait_for_server(rospy.Duration(1)):\n    sys.exit(1)\n", True),
        ("while True:\n    if client.wait_for_server(rospy.Duration(1)):\n        break\n    print('no')\n", False),
        ("while True:\n    if not client.wait_for_server(rospy.Duration(1)):\n        break\n    print('no')\n", True),
        ("while True:\n    if not c.wait_for_server(D(1)):\n        continue\n    else:\n        break\n", False),
        ("while True:\n    client.wait_for_server(rospy.Duration(1))\n    client.send_goal(goal)\n", True),
    ],
)  # fmt: skip
def test_a_client_of_an_action_that_asks_again_does_not_give_up(loop: str, gives: bool) -> None:
    assert gives_up(loop.encode()) is gives


@pytest.mark.parametrize(
    ("loop", "names"),
    [
        ("while '/add' not in rosservice.get_service_list():\n    rospy.sleep(0.5)\n", {"/add"}),
        (
            'while not rospy.is_shutdown() and "/add" not in get_service_list():  # wait\n\trate.sleep()\n',
            {"/add"},
        ),
        ("while '/add' not in rosservice.get_service_list():\n    tries += 1\n", set()),
        (
            "while '/add' not in rosservice.get_service_list() and late():\n    rate.sleep()\n    tries += 1\n",
            set(),
        ),
        ("if '/add' not in rosservice.get_service_list():\n    rate.sleep()\n", set()),
    ],
)
def test_the_services_that_a_client_looks_for_in_the_list_are_known(loop: str, names: set[str]) -> None:
    assert polled(loop.encode()) == names


def test_who_sleeps_between_two_questions_has_no_timer() -> None:
    assert not naps(RETRYING.encode())
    assert naps(RETRYING.encode() + b"    rospy.sleep(0.5)\n")
    assert naps(RETRYING.replace("not rospy.is_shutdown()", "tries < 5").encode())
    assert not naps(b"while '/add' not in rosservice.get_service_list():\n    rospy.sleep(0.5)\n")
    assert naps(b"while pose is None:\n    rospy.sleep(0.5)\n")
    assert naps(b"while not rospy.is_shutdown():\n    rospy.sleep(0.5)\n")
