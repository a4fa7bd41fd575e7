from __future__ import annotations

import hashlib

import pytest

from grader.errors import RubricError
from grader.judging.judge import MANUAL
from grader.rubric.find import rubric_ids, texts_at
from grader.rubric.load import all_rubrics, find_rubric_for_package, load_rubric
from tests.rubric.samples import SOUND, faults, spoiled

NAME = "must be lower-case letters, digits and hyphens, beginning with a letter"


def test_a_sound_rubric_loads(tmp_path):
    path = spoiled(tmp_path)
    loaded = load_rubric(str(path))
    assert loaded.rubric.criteria[1].parameters == {"topic": "/chatter", "rate_hz": 10}
    assert loaded.path == path
    assert loaded.digest == hashlib.sha256(SOUND.encode()).hexdigest()


def test_three_faults_are_all_named_with_file_and_line(tmp_path):
    path = spoiled(
        tmp_path,
        ("points: 40", "points: many"),
        ("check: rate\n    with:\n", "check: rat\n    with:\n"),
        ("[talker-node]", "[talker]"),
    )
    assert faults(path) == [
        'lab.yaml:15: criteria[0].points: must be a number, not "many"',
        'lab.yaml:22: criteria[1].check: there is no check "rat" (did you mean "rate"?)',
        'lab.yaml:27: criteria[1].requires[0]: there is no criterion "talker" (did you mean "talker-node"?)',
    ]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            "      rate_hz: 10\n",
            "      rate_hz: ten\n",
            '25: criteria[1].with.rate_hz: must be a number, not "ten"',
        ),
        ("      rate_hz: 10\n", "", "23: criteria[1].with.rate_hz: is missing"),
        (
            "      rate_hz: 10\n",
            "      rate_hz: -1\n      x: 1\n",
            "26: criteria[1].with.x: is not known here",
        ),
        (
            "rate_hz: 10}",
            "rate_hertz: 10, rate_hz: 10}",
            '17: criteria[0].with.rate_hertz: is not known here (did you mean "rate_hz"?)',
        ),
        ('version: "1"', "version: 1.0", "4: version: must be text, not 1.0: put it in quotes"),
        (
            'version: "1"',
            "version: 2026-01-02",
            "4: version: must be text or a number: put 2026-01-02 in quotes",
        ),
        ("points: 60", "points: 50", "12: criteria: the points add up to 90, not to 100"),
        ("points: 60", "points: .nan", "21: criteria[1].points: must be finite, not .nan"),
        ("points: 60", "points: true", "21: criteria[1].points: must be a number, not true"),
        ("points: 60", 'points: "60"', '21: criteria[1].points: must be a number, not "60": write 60'),
        ("points: 60", "points: -60", "21: criteria[1].points: must be at least 0, not -60"),
        (
            "id: chatter-rate",
            "id: talker-node",
            '19: criteria[1].id: "talker-node" is the id of criteria[0] already',
        ),
        (
            "id: chatter-rate",
            "id: Chatter Rate",
            f'19: criteria[1].id: {NAME}, not "Chatter Rate"',
        ),
        ("title: 10 Hz\n", "title: 10 Hz\n    zzz: yes\n", "21: criteria[1].zzz: is not known here"),
        (
            "with: {topic: /chatter, rate_hz: 10}",
            "with: {topic: /chatter, rate_hz: 10, in real time}",
            "17: criteria[0].with.in real time: is not known here: between { and }, text with a comma needs quotes",
        ),
        (
            "title: 10 Hz\n",
            "title: 10 Hz\n    titel: x\n",
            '21: criteria[1].titel: is not known here (did you mean "title"?)',
        ),
        (
            "title: 10 Hz\n",
            "title: 10 Hz\n    title: x\n",
            "20: criteria[1].title: is given twice, again on line 21",
        ),
        ("    scenario: real\n", "", '13: criteria[0].scenario: is missing: "rate" judges a run'),
        (
            "    scenario: real\n",
            "    scenario: rael\n",
            '18: criteria[0].scenario: there is no scenario "rael" (did you mean "real"?)',
        ),
        (
            "script: src/talker.py",
            "script: a.py, launch: b",
            (
                "10: scenarios.real.start[0]: give one of script, launch, load, program, built and tests: "
                "script and launch are there"
            ),
        ),
        (
            ", script: src/talker.py",
            "",
            "10: scenarios.real.start[0]: give one of script, launch, load, program, built and tests: none is there",
        ),
        (
            "    start:",
            "    warp: 20\n    start:",
            '9: scenarios.real.warp: only a scenario with "clock: warped" has a warp',
        ),
        (
            "    start:",
            "    clock: warpd\n    start:",
            '9: scenarios.real.clock: must be "real" or "warped", not "warpd" (did you mean "warped"?)',
        ),
        (
            "[/chatter]}",
            "[chatter]}",
            '11: scenarios.real.until.topics[0]: a topic begins with a slash: "/chatter"',
        ),
        (
            "window_s: 5",
            "window_s: 90",
            "11: scenarios.real.until.window_s: 90 s can never pass within limit_s, 60 s",
        ),
        (
            "window_s: 5",
            "heard: true",
            "11: scenarios.real.until.heard: needs probes or steps that publish: there is nothing to hear",
        ),
        (
            "window_s: 5",
            "messages: {/chatter: 0}",
            "11: scenarios.real.until.messages./chatter: must be at least 1, not 0",
        ),
        ("package: lab1\n", "", "1: package: is missing"),
        (
            "package: lab1\n",
            "package: lab1\npass_mark: 101\n",
            "6: pass_mark: 101 is more than all the points, 100",
        ),
        ("package: lab1\n", "package: lab1\ndigits: 9\n", "6: digits: must be at most 3, not 9"),
        (
            "package: lab1\n",
            "package: lab1\n12: x\n",
            "1: 12 on line 6 is not a string: put the key in quotes",
        ),
        (
            "package: lab1\n",
            "package: [1]\n",
            "5: package: must be text, not a list, or must be text, not 1: put it in quotes",
        ),
        (
            "  real:\n",
            "  Real Run:\n",
            f'7: scenarios.Real Run: {NAME}, not "Real Run"',
        ),
    ],
)
def test_each_fault_in_plain_words(old, new, fault, tmp_path):
    assert f"lab.yaml:{fault}" in faults(spoiled(tmp_path, (old, new)))


def test_a_misspelt_key_of_the_criteria_is_named_without_what_follows_from_it(tmp_path):
    named = faults(spoiled(tmp_path, ("criteria:", "criterias:")))
    assert len(named) == 2
    assert named[0].endswith("criteria: is missing")
    assert named[1].endswith('criterias: is not known here (did you mean "criteria"?)')


def test_a_circle_is_named_once(tmp_path):
    path = spoiled(tmp_path, ("    scenario: real\n", "    scenario: real\n    requires: [chatter-rate]\n"))
    assert faults(path) == [
        "lab.yaml:19: criteria[0].requires: goes in a circle: talker-node → chatter-rate → talker-node"
    ]


def test_a_criterion_that_requires_another_twice(tmp_path):
    path = spoiled(tmp_path, ("[talker-node]", "[talker-node, talker-node]"))
    assert faults(path) == ['lab.yaml:27: criteria[1].requires[1]: "talker-node" is listed already']


def test_a_criterion_that_requires_itself(tmp_path):
    path = spoiled(tmp_path, ("[talker-node]", "[chatter-rate]"))
    assert faults(path) == [
        "lab.yaml:27: criteria[1].requires: goes in a circle: chatter-rate → chatter-rate"
    ]


@pytest.mark.full
@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", "lab.yaml:1: the file is empty"),
        (b"# nothing\n", "lab.yaml:1: the file is empty"),
        (b"- a\n", "lab.yaml:1: a rubric is a map of keys and values"),
        (b"id: a\n\tb: c\n", "lab.yaml:2: a tab: YAML is indented with spaces only"),
        (b"id: x\ntitle: \xff\n", "lab.yaml:2: the file is not UTF-8: save it as UTF-8"),
        (b"id: x\ntitle: \x07\n", "lab.yaml:2: a character that YAML does not allow (U+0007)"),
        (b"a: 1\n---\nb: 2\n", "lab.yaml:2: "),
        (b"a: [1\nb: 2\n", "lab.yaml:"),
        (b"a: !!python/object/apply:os.system [x]\n", "lab.yaml:1: "),
        (b"a: " + b"[" * 5000, "lab.yaml:1: is nested too deeply"),
        (b"a: 2026-13-45\n", "lab.yaml:1: 2026-13-45 cannot be read"),
        (b"a: &a [*a]\n", "lab.yaml:1: "),
        (b"a" * 1_000_001, "lab.yaml: is larger than 1 MB"),
    ],
)
def test_what_is_no_rubric_at_all_is_one_clear_line(content, fault, tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_bytes(content)
    found = faults(path)
    assert len(found) == 1
    assert found[0].startswith(fault)


@pytest.mark.timeout(20)
@pytest.mark.parametrize(
    "item",
    ["[*{0},*{0},*{0},*{0},*{0},*{0},*{0},*{0},*{0}]", "{{<<: [*{0},*{0},*{0},*{0},*{0},*{0},*{0},*{0}]}}"],
)
def test_an_explosion_of_aliases_is_refused(item, tmp_path):
    lines = ["a0: &a0 {x: 1}"] + [f"a{i}: &a{i} " + item.format(f"a{i - 1}") for i in range(1, 40)]
    path = tmp_path / "lab.yaml"
    path.write_text("\n".join(lines))
    found = faults(path)
    assert len(found) == 1
    assert "aliases multiply" in found[0] or "nested too deeply" in found[0]


def test_anchors_and_merges_are_fine_in_measure(tmp_path):
    path = spoiled(
        tmp_path,
        ("with: {topic", "with: &rate {topic"),
        ("    with:\n      topic: /chatter\n      rate_hz: 10\n", "    with: {<<: *rate, rate_hz: 5}\n"),
    )
    assert load_rubric(str(path)).rubric.criteria[1].parameters == {"topic": "/chatter", "rate_hz": 5}


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + SOUND.replace("\n", "\r\n").encode())
    assert load_rubric(str(path)).rubric.id == "sample"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere", 'there is no rubric "nowhere"'),
        ("no/such.yaml", "no/such.yaml: there is no such file"),
        ("/", "/: is a folder, not a rubric file"),
    ],
)
def test_a_rubric_that_is_not_there(name, message):
    with pytest.raises(RubricError) as caught:
        load_rubric(name)
    assert caught.value.faults == [message]


def test_every_rubric_that_comes_along_is_sound_and_named_like_its_file():
    assert [loaded.rubric.id for loaded in all_rubrics()] == list(rubric_ids())
    assert {loaded.rubric.max_points for loaded in all_rubrics()} <= {100}


def test_the_rubric_of_a_package():
    for loaded in all_rubrics():
        assert find_rubric_for_package(loaded.rubric.package.upper()) == loaded.rubric.id
    assert find_rubric_for_package("no_such_package") is None


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a: {package: no}\nb: [package, x]\nc: package\npackage: lab1\nrest: {", ("lab1",)),
        ("package: [a, b]\nrest: {", ("a", "b")),
        ("package:\n  - a\n  - b\n", ("a", "b")),
        ("package: {name: lab1}\n", ()),
        ("? [package]\n: x\n? package\n: lab1\n", ("lab1",)),
        ("- package\n- lab1\n", ()),
        ("", ()),
    ],
)
def test_one_key_is_read_without_the_rest_of_the_file(text, found, tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_text(text)
    assert texts_at(path, path.name, "package") == found


def test_a_file_that_is_no_yaml_up_to_the_key_says_so(tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_text("a: [\n")
    with pytest.raises(RubricError, match=r"lab\.yaml: is not YAML"):
        texts_at(path, path.name, "package")


def test_a_person_may_give_the_points(tmp_path):
    path = spoiled(
        tmp_path,
        ("    check: rate\n    with:\n      topic: /chatter\n      rate_hz: 10\n", f"    check: {MANUAL}\n"),
    )
    assert load_rubric(str(path)).rubric.criteria[1].check == MANUAL


RECORDED = (
    "    start:\n      - {name: talker, script: src/talker.py}\n"
    "    until: {window_s: 5, topics: [/chatter]}\n"
)


def test_a_recording_takes_the_place_of_what_is_started(tmp_path):
    path = spoiled(tmp_path, (RECORDED, '    recording: "*.bag"\n'))
    assert load_rubric(str(path)).rubric.scenarios["real"].recording == "*.bag"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([(RECORDED, "    clock: real\n")], ["scenarios.real.start: is missing: give start, or recording"]),
        (
            [(RECORDED, RECORDED.splitlines(keepends=True)[0] + "      - {name: a, script: b}\n")],
            ["scenarios.real.until: is missing"],
        ),
        (
            [(RECORDED, f'    recording: "*.bag"\n    clock: warped\n{RECORDED}')],
            [
                f"scenarios.real.{key}: is not for a scenario with a recording: nothing is run"
                for key in ("clock", "start", "until")
            ],
        ),
        (
            [
                (RECORDED, '    recording: "*.bag"\n'),
                (
                    "check: rate\n    with: {topic: /chatter, rate_hz: 10}",
                    "check: node-lives\n    with: {process: talker}",
                ),
            ],
            ['criteria[0].check: "node-lives" judges more than messages, and a recording holds no more'],
        ),
    ],
)
def test_a_scenario_starts_something_or_names_a_recording(tmp_path, changes, expected):
    path = spoiled(tmp_path, *changes)
    with pytest.raises(RubricError) as caught:
        load_rubric(str(path))
    assert [fault.split(": ", 1)[1] for fault in caught.value.faults] == expected
