"""Recordings that are made to get points, or to get at the grader's memory and time. `tests/fuzz` has many more."""

from __future__ import annotations

import json
import time
from io import BytesIO
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from grader.arena.limits import SUBMISSION_MESSAGE_BYTES
from grader.cli.main import run as grader
from grader.errors import EvidenceError
from grader.evidence.decode import Decoder
from grader.evidence.events import EVIDENCE_VERSION, METADATA_NAME, ActorEvent
from grader.evidence.inspect import inspect_run
from grader.evidence.reader import load_evidence, load_run
from grader.evidence.run import HELD_BYTES_MAX, BudgetExceeded, MemoryBudget
from grader.evidence.writer import EvidenceStream
from grader.judging import judge
from grader.model.verdict import Status
from grader.rubric.load import load_rubric
from tests.evidence.bags import CHATTER, COUNT, mcap_bytes
from tests.evidence.samples import ABOUT, T0, identity, sample

LAB = "leeds-comp3631-lab1"
RUBRIC = """\
schema: grader.rubric/1
id: bags
title: A recording
version: "1"
package: none
scenarios:
  mine: {title: The student's recording, recording: "*.mcap"}
criteria:
  - id: type
    title: Text on /chatter
    points: 100
    check: topic-type
    with: {topic: /chatter, type: std_msgs/String}
    scenario: mine
"""


@pytest.fixture(autouse=True)
def _no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRADER_ROS_SETUP", "none")


@pytest.fixture
def rubric(tmp_path: Path) -> Path:
    path = tmp_path / "bags.yaml"
    path.write_text(RUBRIC)
    return path


def graded(tmp_path: Path, source: Path, rubric: Path | str) -> tuple[int, dict]:
    code = grader(["grade", str(source), "--rubric", str(rubric), "--out", str(tmp_path / "out")])
    (folder,) = (tmp_path / "out").iterdir()
    return code, json.loads((folder / "result.json").read_text())


def recording(definition: str, *messages: bytes, type_: str = "demo/A", topic: str = "/chatter") -> BytesIO:
    stream = BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile="ros1")
    schema = writer.register_schema(type_, "ros1msg", definition.encode())
    channel = writer.register_channel(topic, "ros1", schema, {"callerid": "/talker"})
    for number, data in enumerate(messages):
        writer.add_message(channel, T0 + number, data, T0 + number)
    writer.finish()
    stream.seek(0)
    return stream


def with_events(name: str, version: str) -> bytes:
    """A recording that claims to be the grader's, with a run that went well."""
    stream = BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros1")
    writer.add_metadata(name, {"format": version, "scenario": "talker", "clock": "real", "warp": "1"})
    schema = writer.register_schema("grader.ScenarioEvent", "jsonschema", b"{}")
    channel = writer.register_channel("/grader/scenario", "json", schema)
    writer.add_message(channel, T0, b'{"event": "end", "outcome": "complete"}', T0)
    schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data\n")
    channel = writer.register_channel("/chatter", "ros1", schema, {"callerid": "/talker"})
    writer.add_message(channel, T0, b"\2\0\0\0hi", T0)
    writer.finish()
    return stream.getvalue()


FORGED = {
    "made-by-hand": with_events(METADATA_NAME, EVIDENCE_VERSION),
    "of-another-format": with_events(METADATA_NAME, "2"),
    "a-real-run": sample(),
}


@pytest.mark.parametrize("case", sorted(FORGED))
def test_evidence_of_the_graders_that_is_handed_in_earns_nothing(tmp_path, rubric, case):
    (tmp_path / "lab.mcap").write_bytes(FORGED[case])
    code, result = graded(tmp_path, tmp_path / "lab.mcap", LAB)
    assert (code, result["status"], result["points"]) == (3, "error", 0)
    assert {c["points"] for c in result["criteria"]} == {0}
    folder = tmp_path / "ada"
    folder.mkdir()
    (tmp_path / "lab.mcap").rename(folder / "lab.mcap")
    (tmp_path / "out").rename(tmp_path / "first")
    code, result = graded(tmp_path, folder, rubric)
    assert (code, result["points"], result["criteria"][0]["status"]) == (4, 0, "inconclusive")
    kept = load_evidence([tmp_path / "out" / "ada"])
    assert kept["mine"].student_channels() == ()


def test_events_in_a_recording_count_for_nothing_without_the_graders_metadata(tmp_path):
    (tmp_path / "lab.mcap").write_bytes(with_events("grader.evidence2", EVIDENCE_VERSION))
    run = load_run(tmp_path / "lab.mcap")
    assert (run.foreign, run.course, run.package_json, run.attachments) == (True, (), None, {})


def test_a_recording_that_is_named_like_a_run_is_a_recording(tmp_path):
    for name in ("package", "launch", "listener"):
        (tmp_path / f"{name}.mcap").write_bytes(mcap_bytes(CHATTER, COUNT))
    loaded = load_rubric(LAB)
    for criterion in judge(loaded.rubric, load_evidence([tmp_path]), loaded.checks):
        earned = criterion.status in {Status.PASS, Status.PARTIAL}
        assert not earned or loaded.checks[criterion.check].messages_only


def test_a_node_cannot_take_the_schema_of_the_graders_records():
    """A definition that is the text of the grader's own schema, sent before the first record of that kind."""
    stream = BytesIO()
    writer = EvidenceStream(stream, **ABOUT)
    text = json.dumps(ActorEvent.model_json_schema(), sort_keys=True)
    about = {
        **identity("/chatter", "std_msgs/String"),
        "type": "grader.ActorEvent",
        "definition": text,
    }
    writer.register_channel(**about).message(T0, b"")
    writer.event("/grader/actor", T0, ActorEvent(action="refused", actor="talker", detail="asked too much"))
    writer.finish()
    stream.seek(0)
    assert [event.action for _, event in load_run(stream).actors] == ["refused"]


def test_few_bytes_that_stand_for_many_objects_are_not_decoded():
    definition = f"B[] a\n{'=' * 80}\nMSG: demo/B\nuint8 x\n"
    count = 1 << 20
    data = count.to_bytes(4, "little") + bytes(count)
    assert Decoder("demo/A", definition).decode(data) is None
    assert Decoder("demo/A", definition).decode(b"\2\0\0\0\1\2") == {"a": [{"x": 1}, {"x": 2}]}


def test_large_arrays_of_an_honest_node_are_decoded():
    image = Decoder("sensor_msgs/A", "uint32 width\nuint8[] data\n")
    assert len(image.decode(bytes(4) + (4 << 20).to_bytes(4, "little") + bytes(4 << 20))["data"]) == 4 << 20
    scan = Decoder("sensor_msgs/B", "float32[] ranges\n")
    assert len(scan.decode((20_000).to_bytes(4, "little") + bytes(80_000))["ranges"]) == 20_000


def test_a_topic_that_is_too_much_to_decode_costs_no_mark_and_earns_none(tmp_path):
    many = [bytes([250, 0, 0, 0]) + bytes(1000)] * 2000
    (tmp_path / "lab.mcap").write_bytes(recording("float32[] x\n", *many, topic="/chatter").getvalue())
    run = load_run(tmp_path / "lab.mcap")
    assert len(run.channels[0].values) == 2000
    tight = load_run(tmp_path / "lab.mcap", MemoryBudget(decoded_bytes=1 << 20))
    with pytest.raises(EvidenceError, match=r"/chatter: its messages come to more than 1 MiB"):
        _ = tight.channels[0].values
    loaded = load_rubric(LAB)
    statuses = {c.id: c.status for c in judge(loaded.rubric, {"lab": tight}, loaded.checks)}
    assert statuses["chatter-rate"] is not Status.ERROR
    assert Status.ERROR not in statuses.values()


def test_zeros_that_pack_well_do_not_fill_the_memory():
    with pytest.raises(EvidenceError, match="holds more than 96 MiB of messages"):
        load_run(recording("uint8[] x\n", *[bytes(20 << 20)] * 6))


def test_what_the_arena_may_record_of_one_submission_can_be_read_again():
    assert HELD_BYTES_MAX > SUBMISSION_MESSAGE_BYTES
    shared = MemoryBudget()
    for _ in range(10):
        shared.hold(SUBMISSION_MESSAGE_BYTES // 10, foreign=False)
    with pytest.raises(BudgetExceeded):
        shared.hold(SUBMISSION_MESSAGE_BYTES // 10, foreign=True)


@pytest.mark.full
def test_thousands_of_definitions_are_inspected_within_seconds():
    stream = BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros1")
    for number in range(900):
        schema = writer.register_schema(f"demo/A{number}", "ros1msg", b"int8 data\n")
        channel = writer.register_channel(f"/n{number}", "ros1", schema)
        writer.add_message(channel, T0, b"\1", T0)
    writer.finish()
    stream.seek(0)
    run = load_run(stream)
    began_s = time.process_time()
    assert len(inspect_run(run).channels) == 900
    assert time.process_time() - began_s < 5
