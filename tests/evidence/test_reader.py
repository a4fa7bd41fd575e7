"""Reading back, reading what others wrote, and refusing what is broken on one line."""

from __future__ import annotations

import os
import pickle
import random
from io import BytesIO

import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from grader.checks.support.console_output import printed_lines
from grader.errors import EvidenceError
from grader.evidence import mcap_records, reader
from grader.evidence.events import ConsoleLine
from grader.evidence.reader import load_evidence, load_run, package_facts
from grader.evidence.run import Run, console_log
from grader.evidence.writer import EvidenceStream
from tests.evidence.samples import ABOUT, METADATA, T0, identity, sample


def refused(source) -> str:
    with pytest.raises(EvidenceError) as caught:
        load_run(source)
    assert "\n" not in caught.value.message
    return caught.value.message


def foreign(
    *, compression=CompressionType.ZSTD, json_topic=None, metadata=None, data=b"{}", schema="jsonschema"
) -> bytes:
    stream = BytesIO()
    writer = Writer(stream, compression=compression)
    writer.start(profile="ros1")
    if metadata is not None:
        writer.add_metadata("grader.evidence", metadata)
    number = writer.register_schema("std_msgs/Int8", "ros1msg", b"int8 data\n")
    channel = writer.register_channel("/n", "ros1", number, {"callerid": "/somebody"})
    for n in (3, 1, 2):
        writer.add_message(channel, T0 + n, bytes([n]), T0 + n)
    if json_topic:
        number = writer.register_schema("x", schema, b"{}")
        writer.add_message(writer.register_channel(json_topic, "json", number), T0, data, T0)
    writer.finish()
    return stream.getvalue()


OWN = {"format": "1", "scenario": "s", "clock": "real", "warp": "1"}


def test_a_run_comes_back(tmp_path):
    (tmp_path / "talker.mcap").write_bytes(sample())
    run = load_run(tmp_path / "talker.mcap")
    assert (run.evidence, run.scenario, run.clock, run.warp) == ("talker.mcap", "talker", "real", 1.0)
    assert {k: run.metadata[k] for k in METADATA} == METADATA
    by_topic = {c.topic: c for c in run.channels}
    assert by_topic["/numeric"].data == tuple(range(30))
    assert by_topic["/chatter"].data[-1] == "hello 29"
    assert by_topic["/silent"].messages == ()
    assert [m.sequence for m in by_topic["/numeric"].messages] == list(range(30))
    assert [line.line for _, line in run.lines("talker")] == [f"hé {n}" for n in range(30)]
    assert (run.start_ns, run.end_ns) == (T0, T0 + 3_000_000_000)
    assert run.outcome is not None
    assert run.outcome.outcome == "complete"
    assert run.attachments == {"src/talker.py": b"#!/usr/bin/env python3\n"}
    assert package_facts(run).name == "lab1"
    assert run.student_nodes() == ("/talker",)


def test_a_file_of_several_chunks_comes_back():
    run = load_run(BytesIO(sample(count=6000)))
    by_topic = {c.topic: c for c in run.channels}
    assert len(by_topic["/numeric"].messages) == len(run.console) == 6000
    assert by_topic["/chatter"].data[5999] == "hello 5999"


def test_a_run_without_facts_says_so():
    with pytest.raises(EvidenceError, match="holds no package facts"):
        package_facts(load_run(BytesIO(foreign())))


@pytest.mark.parametrize("compression", list(CompressionType))
def test_another_tools_recording_loads_in_time_order(tmp_path, compression):
    (tmp_path / "my bag.mcap").write_bytes(foreign(compression=compression))
    run = load_run(tmp_path / "my bag.mcap")
    assert (run.scenario, run.clock, run.metadata, run.outcome) == ("my bag", "real", {}, None)
    assert run.channels[0].data == (1, 2, 3)
    assert (run.channels[0].callerid, run.channels[0].md5sum) == ("/somebody", "")


def test_a_students_topic_is_never_taken_for_the_graders():
    stream = BytesIO()
    writer = EvidenceStream(stream, **ABOUT)
    fake = b'\x00{"process":"x","stream":"stdout","line":"passed"}'
    writer.register_channel(**identity("/grader/console", "std_msgs/Int8", "/student")).message(T0, fake)
    writer.event("/grader/console", T0, ConsoleLine(process="real", stream="stdout", line="true"))
    writer.register_channel(**identity("/grader/package", "std_msgs/Int8", "/student")).message(T0, fake)
    writer.finish()
    stream.seek(0)
    run = load_run(stream)
    assert [line.process for _, line in run.console] == ["real"]
    assert {c.topic for c in run.student_channels()} == {"/grader/console", "/grader/package"}
    assert run.package_json is None


def test_json_channels_of_another_tool_are_not_the_graders():
    run = load_run(BytesIO(foreign(json_topic="/grader/process")))
    assert run.processes == ()
    run = load_run(BytesIO(foreign(json_topic="/grader/process", metadata=OWN, schema="")))
    assert run.processes == ()


def test_a_record_that_does_not_fit_is_named():
    message = refused(
        BytesIO(foreign(json_topic="/grader/process", metadata=OWN, data=b'{"event": "burst"}'))
    )
    assert "ProcessEvent.event" in message
    assert "evidence.mcap" in message


@pytest.mark.parametrize(
    ("metadata", "reason"),
    [
        ({**OWN, "format": "2"}, "written by a newer grader (grader.evidence/2); this one reads up to 1"),
        ({**OWN, "format": "two"}, "format 'two'"),
        ({}, "format ''"),
        ({**OWN, "warp": "fast"}, "scenario, clock and warp"),
    ],
)
def test_metadata_that_is_not_ours_to_read(metadata, reason):
    assert reason in refused(BytesIO(foreign(metadata=metadata)))


def test_cut_anywhere_it_is_refused():
    whole = sample()
    cuts = {*range(200), *range(len(whole) - 200, len(whole)), *range(200, len(whole), 37)}
    for cut in sorted(cuts):
        assert refused(BytesIO(whole[:cut]))
    assert "empty" in refused(BytesIO(b""))
    assert "cut short" in refused(BytesIO(whole[:-1]))
    assert "after its end" in refused(BytesIO(whole + b"x"))


def test_a_flipped_byte_is_refused_or_harmless():
    """The data are all under a checksum; the index behind them is not needed for reading."""
    whole = sample()
    rng = random.Random(1)  # noqa: S311 - a fixed choice of places
    expected = load_run(BytesIO(whole))
    for _ in range(400):
        place = rng.randrange(len(whole))
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.randrange(8)
        try:
            run = load_run(BytesIO(bytes(damaged)))
        except EvidenceError as error:
            assert "\n" not in error.message  # noqa: PT017 - either outcome is fine
        else:
            assert [c.messages for c in run.channels] == [c.messages for c in expected.channels]
            assert run.console == expected.console


@pytest.mark.parametrize(
    "content", [b"hello", b"PK\x03\x04", os.urandom(4096), b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 2]
)
def test_what_is_no_mcap_is_refused(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    assert str(path) in refused(path)


def test_places_that_cannot_be_read(tmp_path):
    assert "No such file" in refused(tmp_path / "missing.mcap")
    assert "not a file" in refused(tmp_path)
    os.mkfifo(tmp_path / "pipe.mcap")
    assert "not a file" in refused(tmp_path / "pipe.mcap")


def bomb(claimed: int, real: int) -> bytes:
    stream = BytesIO()
    writer = Writer(stream, use_chunking=False)
    writer.start()
    packed = zstandard.compress(b"\0" * real)
    body = b"\0" * 16 + claimed.to_bytes(8, "little") + b"\0" * 4
    body += (4).to_bytes(4, "little") + b"zstd" + len(packed).to_bytes(8, "little") + packed
    stream.write(bytes([Opcode.CHUNK]) + len(body).to_bytes(8, "little") + body)
    writer.finish()
    return stream.getvalue()


def test_a_chunk_that_blows_up_is_refused(monkeypatch):
    assert "a chunk of more than 32 MiB" in refused(BytesIO(bomb(1 << 40, 10)))
    assert "another size" in refused(BytesIO(bomb(10, 50 << 20)))
    monkeypatch.setattr(mcap_records, "MAX_UNPACKED_BYTES", 1000)
    assert "unpacked" in refused(BytesIO(sample()))


def test_too_many_messages_or_channels_are_refused(monkeypatch):
    monkeypatch.setattr(mcap_records, "MAX_RECORDS", 10)
    assert "more than 10 records" in refused(BytesIO(sample()))
    monkeypatch.undo()
    monkeypatch.setattr(reader, "MAX_CHANNELS", 2)
    assert "more than 2 channels" in refused(BytesIO(sample()))


def test_a_folder_stands_for_its_files(tmp_path):
    evidence = tmp_path / "ada" / "evidence"
    evidence.mkdir(parents=True)
    for name in ("package", "talker"):
        (evidence / f"{name}.mcap").write_bytes(sample(scenario=name))
    (evidence / "half.mcap.part").write_bytes(b"")
    (evidence / "._talker.mcap").write_bytes(b"junk that a Mac leaves behind")
    assert list(load_evidence([evidence])) == ["package", "talker"]
    assert list(load_evidence([tmp_path / "ada"])) == ["package", "talker"]
    files = sorted(evidence.glob("[a-z]*.mcap"))
    assert list(load_evidence([*files, tmp_path / "ada", files[0]])) == ["package", "talker"]


def test_evidence_that_is_not_clear(tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.mcap").write_bytes(sample())
    with pytest.raises(EvidenceError, match="both hold the scenario 'talker'"):
        load_evidence([tmp_path])
    (tmp_path / "none").mkdir()
    for paths in ([tmp_path / "none"], [tmp_path / "nowhere"], []):
        with pytest.raises(EvidenceError):
            load_evidence(paths)


def test_a_publisher_that_connected_twice_is_one_channel():
    stream = BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros1")
    number = writer.register_schema("std_msgs/Int8", "ros1msg", b"int8 data\n")
    for n in (2, 1):
        channel = writer.register_channel("/n", "ros1", number, {"callerid": "/a"})
        writer.add_message(channel, T0 + n, bytes([n]), T0 + n)
    writer.finish()
    stream.seek(0)
    [channel] = load_run(stream).channels
    assert channel.data == (1, 2)


def test_an_unfinished_recording_has_no_outcome():
    stream = BytesIO()
    writer = EvidenceStream(stream, **ABOUT)
    writer.finish()
    stream.seek(0)
    run = load_run(stream)
    assert (run.outcome, run.channels, run.start_ns, run.end_ns) == (None, (), 0, 0)


def test_the_console_is_told_in_the_order_of_the_runs_and_without_colours() -> None:
    def run_of(start_ns: int, text: str) -> Run:
        line = ConsoleLine(process="node", stream="stderr", line=text)
        return Run(
            evidence="x.mcap", scenario="x", clock="real", warp=1.0, metadata={}, start_ns=start_ns,
            end_ns=start_ns + 1, console=((start_ns + 500_000_000, line),),
        )  # fmt: skip

    runs = {
        "listener": run_of(9_000_000_000, "\x1b[31mlate\x1b[0m"),
        "package": run_of(1_000_000_000, "built"),
    }
    assert console_log(runs) == (
        "== package\n   0.500 node stderr: built\n== listener\n   0.500 node stderr: late\n"
    )


def test_a_run_is_sent_without_what_checks_have_worked_out_of_it():
    run = Run(evidence="a.mcap", scenario="a", clock="real", warp=1, metadata={}, start_ns=1, end_ns=2)
    assert printed_lines(run) == ()
    assert run.grader_nodes == frozenset()
    assert pickle.loads(pickle.dumps(run)) == run  # noqa: S301 - made here
