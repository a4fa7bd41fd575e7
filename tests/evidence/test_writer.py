"""Files that are whole or absent, the same bytes for the same run, readable by tools that are not ours."""

from __future__ import annotations

import errno
from io import BytesIO

import pytest
from mcap.reader import make_reader
from mcap_ros1.decoder import DecoderFactory

from grader.errors import HostError, OutputError
from grader.evidence import writer as writer_module
from grader.evidence.events import ConsoleLine, ParamEvent, ProcessEvent
from grader.evidence.reader import load_run
from grader.evidence.writer import EvidenceStream, EvidenceWriter
from tests.evidence.samples import ABOUT, METADATA, MS, T0, fill, identity, sample


def test_the_same_run_gives_the_same_bytes(tmp_path):
    for name in ("a.mcap", "b.mcap"):
        with EvidenceWriter(tmp_path / name, **ABOUT) as writer:
            fill(writer)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes() == sample()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap", "b.mcap"]


def test_another_reader_decodes_every_ros_channel():
    reader = make_reader(BytesIO(sample()), validate_crcs=True, decoder_factories=[DecoderFactory()])
    header, summary = reader.get_header(), reader.get_summary()
    assert (header.profile, header.library) == ("ros1", "ros-lab-grader 0.1.0")
    ros = {c.topic: c for c in summary.channels.values() if c.message_encoding == "ros1"}
    assert ros["/numeric"].metadata == {
        "callerid": "/talker",
        "md5sum": "27ffa0c9c4b8fb8492252bcad9e5c57b",
        "latching": "0",
        "topic": "/numeric",
    }
    assert ros["/chatter"].metadata["md5sum"] == "992ce8a1687cec8c8bd883ec73ca41d1"
    assert set(ros) == {"/silent", "/numeric", "/chatter"}
    decoded = [*reader.iter_decoded_messages(topics=["/numeric", "/chatter"])]
    numbers = [one for one in decoded if one.channel.topic == "/numeric"]
    assert [one.decoded_message.data for one in numbers] == list(range(30))
    assert [one.message.sequence for one in numbers] == list(range(30))
    assert [one.message.log_time for one in numbers] == [T0 + n * 100 * MS for n in range(30)]
    texts = [one.decoded_message.data for one in decoded if one.channel.topic == "/chatter"]
    assert texts == [f"hello {n}" for n in range(30)]
    assert {one.schema.encoding for one in decoded} == {"ros1msg"}


def test_json_channels_carry_their_schema_and_the_metadata_its_version():
    reader = make_reader(BytesIO(sample()))
    schemas = {c.topic: s for s, c, _ in reader.iter_messages() if c.message_encoding == "json"}
    assert {s.encoding for s in schemas.values()} == {"jsonschema"}
    assert b'"exit_code"' in schemas["/grader/process"].data
    [metadata] = reader.iter_metadata()
    assert metadata.name == "grader.evidence"
    own = {"format": "1", "scenario": "talker", "clock": "real", "warp": "1"}
    assert metadata.metadata == {**METADATA, **own}
    [attachment] = reader.iter_attachments()
    assert (attachment.name, attachment.media_type) == ("src/talker.py", "text/x-python")


def test_an_abort_leaves_nothing(tmp_path):
    def interrupted():
        with EvidenceWriter(tmp_path / "a.mcap", **ABOUT) as writer:
            fill(writer)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_an_abort_keeps_the_file_that_was_there(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"before")
    EvidenceWriter(tmp_path / "a.mcap", **ABOUT).abort()
    assert (tmp_path / "a.mcap").read_bytes() == b"before"
    with EvidenceWriter(tmp_path / "a.mcap", **ABOUT) as writer:
        fill(writer)
        assert (tmp_path / "a.mcap").read_bytes() == b"before"
    assert (tmp_path / "a.mcap").read_bytes() == sample()


def test_a_folder_that_is_a_file_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot write .*evidence\.mcap") as caught:
        EvidenceWriter(tmp_path / "file" / "evidence.mcap", **ABOUT)
    assert "\n" not in caught.value.message


def test_a_full_disk_is_the_machine_not_the_submission():
    class Full(BytesIO):
        def write(self, _data):
            raise OSError(errno.ENOSPC, "No space left on device")

    guarded = writer_module._Guarded(Full(), ABOUT["scenario"])
    with pytest.raises(HostError, match="the disk is full"):
        EvidenceStream(guarded, **ABOUT)


def test_a_disk_that_fills_up_while_recording_leaves_nothing(tmp_path, monkeypatch):
    def fails(_descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(writer_module.os, "fsync", fails)
    with (
        pytest.raises(HostError, match="the disk is full"),
        EvidenceWriter(tmp_path / "a.mcap", **ABOUT) as writer,
    ):
        fill(writer)
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_text_is_still_written():
    stream = BytesIO()
    writer = EvidenceStream(stream, **{**ABOUT, "metadata": {"source": "caf\udce9"}})
    strange = {
        **identity("/c", "std_msgs/String"),
        "callerid": "/n\udcff",
        "definition": "string data # \udcff\n",
    }
    writer.register_channel(**strange).message(T0, b"\x01\0\0\0a")
    writer.event(
        "/grader/process", T0, ProcessEvent(event="start", name="a", role="student", argv=("caf\udce9",))
    )
    writer.event("/grader/console", T0, ConsoleLine(process="a", stream="stdout", line="\0\x1b[31m\ud800"))
    writer.finish()
    stream.seek(0)
    run = load_run(stream)
    assert run.channels[0].data == ("a",)
    assert run.processes[0][1].argv == ("caf?",)
    assert run.console[0][1].line == "\0\x1b[31m?"
    assert run.metadata["source"] == "caf?"


def nested(depth):
    value = 1
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(
    "value", [nested(5), nested(150), nested(600), {1: 2}, 10**400, float("nan"), "\ud800", b"\xff"]
)
def test_no_parameter_makes_the_file_unreadable(value):
    stream = BytesIO()
    writer = EvidenceStream(stream, **ABOUT)
    writer.event("/grader/param", T0, ParamEvent(action="set", name="/p", caller_id="/n", value=value))
    writer.finish()
    stream.seek(0)
    assert load_run(stream).params[0][1].name == "/p"


def test_an_event_belongs_on_its_own_channel():
    writer = EvidenceStream(BytesIO(), **ABOUT)
    with pytest.raises(TypeError, match="does not belong"):
        writer.event("/grader/process", T0, ConsoleLine(process="a", stream="stdout", line=""))
