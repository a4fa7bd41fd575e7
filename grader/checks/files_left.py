"""The files that a run leaves: recordings, tables, maps."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import PurePosixPath
from typing import Annotated

from pydantic import Field, model_validator

from grader.checks.registry import ProcessName, Refers, check
from grader.checks.support.clocks import excused, why_late
from grader.checks.support.exit_causes import explain_early_end
from grader.checks.support.fields import bounds_text, is_within, refuse_disorder
from grader.checks.support.launch import bag_not_made, recorders
from grader.checks.support.processes import GlobalName, TypeName, lives, not_started, plain_type
from grader.checks.support.text import near_names, shown
from grader.checks.support.topics import cite
from grader.errors import EvidenceError
from grader.evidence.run import Channel, LeftFile, Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, failed, failed_or_blocked, inconclusive, passed
from grader.wording import first_few, join_words, plural

IN_PACKAGE = re.compile(r"~/catkin_ws/src/[^/]+/")
WORKING_FOLDERS = ("~/.ros/", "~/")
"""Of nodes that roslaunch starts, and of scripts."""
ACTIVE = ".active"
"""Ends the name of a bag while rosbag writes it."""
RECORDINGS = (".bag", ".mcap")
# The numbers at the head of a PGM may have comments between them.
_GAP = rb"\s+(?:#[^\n]*\n\s*)*"
PGM = re.compile(rb"P[25]" + _GAP + rb"(\d{1,6})" + _GAP + rb"(\d{1,6})" + _GAP + rb"\d{1,5}\s")
PGM_HEAD_BYTES = 1_000
ENDS_IT = re.compile(r"(?<!\S)(?:--(?:duration|limit)[= ]|-l ?)(\d{1,6})([smh]?)(?!\S)")
SECONDS = {"": 1, "s": 1, "m": 60, "h": 3600}
NAMES_SHOWN = 4
TABLE_BYTES_MAX = 4 << 20


class TopicLeft(Record):
    """What a recording has to contain on a topic."""

    type: Annotated[TypeName, Refers("message")] | None = None
    """As `rostopic info` gives it: `std_msgs/String`; null: any."""
    at_least: Annotated[int, Field(ge=1)] = 1
    """The least number of messages."""


class ColumnBounds(Record):
    """Between which values the numbers of a column have to be."""

    min: float | None = None
    """The least value, in the column's own unit; null: no bound."""
    max: float | None = None
    """The greatest value, in the column's own unit; null: no bound."""

    @model_validator(mode="after")
    def _in_order(self) -> ColumnBounds:
        refuse_disorder(self.min, self.max)
        return self


class FileLeftParams(Record):
    """A file, and what has to be in it."""

    file: Annotated[str, Field(min_length=1), Refers("kept")]
    """A name or pattern (`run.bag`, `results/*.csv`), from the process's working folder or from the
    package; one of the scenario's `keeps` has to match it."""
    process: ProcessName = ""
    """The process that leaves it, by the scenario's name; empty: any of the student's."""
    min_bytes: Annotated[int, Field(ge=1)] = 1
    """The least size, in bytes."""
    topics: dict[GlobalName, TopicLeft] = Field(default_factory=dict)
    """Topics that a recording (`.bag`, `.mcap`) has to hold."""
    columns: tuple[str, ...] = ()
    """Names that have to be in the first row of a table (CSV)."""
    rows_at_least: Annotated[int, Field(ge=0)] = 0
    """The least number of rows of a table, not counting the first if it has `columns`."""
    bounds: dict[str, ColumnBounds] = Field(default_factory=dict)
    """Bounds for the numbers of columns, by their names."""

    @model_validator(mode="after")
    def _one_kind(self) -> FileLeftParams:
        if self.topics and not self.file.endswith(RECORDINGS):
            raise ValueError("topics are for a file that ends in .bag or .mcap")
        if self.topics and self._is_table:
            raise ValueError("give topics (of a recording), or columns, rows_at_least, bounds (of a table)")
        if unknown := [name for name in self.bounds if name not in self.columns]:
            raise ValueError(f"bounds: {join_words(unknown)} is not among the columns")
        return self

    @property
    def _is_table(self) -> bool:
        return bool(self.columns or self.rows_at_least or self.bounds)

    @property
    def words(self) -> str:
        """What is expected, in words."""
        topics = [f"{plural(t.at_least, 'message')} on {name}" for name, t in self.topics.items()]
        columns = [f"the columns {join_words(self.columns)}"] if self.columns else []
        rows = [plural(self.rows_at_least, "row")] if self.rows_at_least else []
        size = [f"{self.min_bytes} bytes"] if self.min_bytes > 1 else []
        least = join_words([*topics, *columns, *rows, *size])
        return f"{self.file} with at least {least}" if least else self.file

    def fits(self, path: str, ending: str = "") -> bool:
        """Return whether the file lies where it should, by one of the folders that count."""
        places = {path, IN_PACKAGE.sub("", path)} | {path.removeprefix(f) for f in WORKING_FOLDERS}
        pattern = PurePosixPath(self.file + ending)
        found = [PurePosixPath(place) for place in places]
        # `match` alone would take a file of that name in any folder.
        return any(p.match(str(pattern)) and len(p.parts) == len(pattern.parts) for p in found)

    def finding(self, file: LeftFile, run: Run) -> Verdict | None:
        """Return what is wrong with a file; None for nothing."""
        data = file.data or b""
        if len(data) < self.min_bytes:
            wanted = f", not {self.min_bytes}" if data else ""
            what = f"holds only {plural(len(data), 'byte')}{wanted}" if data else "was left empty"
            return failed(f"{file.path} {what}", hint="write to it, and close it").if_repeated()
        if self.file.endswith(RECORDINGS):
            return _recording(file, self.topics, run)
        if self._is_table:
            return _table(file, self, run)
        if self.file.endswith(".pgm"):
            return _map(file)
        return None


@check("file-left", params=FileLeftParams, of_callbacks=True)
def file_left(package: PackageFacts, run: Run, params: FileLeftParams) -> Verdict:
    """The run leaves a file, with what has to be in it.

    What it checks
        That a bag, a table, a map or any other file exists once the program has ended, in the place that
        the handout names, and contains what it should.

    Why it matters on a robot
        Only what a robot wrote down shows later what it saw and did. You notice that a recording was not
        closed, or lacks a topic, only after the robot is back in its cupboard.

    How it is measured
        All files that the program left are listed after Ctrl-C, and the file is read: the messages of each
        topic of a bag, each row of a table, the size of a map. The file may be in the working folder (`~`
        for scripts, `~/.ros` for nodes that roslaunch starts) or in the package. A file that was handed in
        and has not changed does not count.

    How to fix
        Write to the path that the handout names; in a launch file, `$(find <package>)/…` says where. End
        `rosbag record` with Ctrl-C, not with `kill -9`, and close your own files, with `with open(…) as file:`.
        `rosbag info <file>` shows what a bag holds.
    """
    if run.metadata.get("sandbox", "").startswith("none"):
        told = "files are only kept from runs in a sandbox"
        verdict = inconclusive(told, hint="grade on a machine that has bubblewrap")
        return verdict.about(expected=params.words)
    files = [file for file in run.left_files if params.process in {"", file.process}]
    # A pattern may fit several files: of those that can be read, the largest.
    found = sorted((f for f in files if params.fits(f.path)), key=lambda f: (f.data is None, -f.size_bytes))
    started = [one for one in lives(run) if params.process in {"", one.name}]
    if not started:
        verdict = not_started(params.process or "the program")
    elif not found:
        missing = (f"{run.scenario}: no {params.file}",)
        verdict = _not_left(files, package, run, params).based_on(lost_to=missing)
    elif found[0].data is None:
        message = f"{found[0].path} is too large to be read: {found[0].size_bytes >> 20} MB"
        verdict = failed(message, hint="write only what the handout asks for")
    else:
        verdict = params.finding(found[0], run) or passed(f"{found[0].path} was written")
        verdict = _cut_short(verdict, package, run)
    return verdict.about(
        expected=params.words,
        measured=verdict.measured
        or (f"{found[0].size_bytes} bytes" if found else plural(len(files), "file")),
        citations=verdict.citations or (cite(run, "/grader/actor"),),
    )


def _not_left(files: Sequence[LeftFile], package: PackageFacts, run: Run, params: FileLeftParams) -> Verdict:
    """Why: a recording that was not closed, another folder, a slip in the name, a program that failed, other files."""
    paths = list(dict.fromkeys(file.path for file in files))
    name = PurePosixPath(params.file).name
    if any(params.fits(path, ACTIVE) for path in paths):
        message = f"{name} was never closed: {name}{ACTIVE} was left behind, because rosbag record was killed"
        hint = "end rosbag record with Ctrl-C (SIGINT), or start it in the launch file"
        return failed(message, hint=hint)
    if elsewhere := [path for path in paths if PurePosixPath(path).match(name)]:
        message = f"{params.file} was written to another folder: {_list_paths(elsewhere)}"
        return failed(message, hint=f"write it to {params.file}, below ~ or below the package")
    names = [PurePosixPath(path).name for path in paths]
    alike = [one for one in names if PurePosixPath(one).suffix == PurePosixPath(name).suffix != ""]
    if near := near_names(name, names) or alike:
        hint = f"name the file {name}"
        # As `rosbag record` names a bag by itself, with date and time.
        if any(re.search(r"_\d{4}(-\d\d){5}\.bag$", one) for one in near):
            hint = f"write `-O {name}` in the call of `rosbag record`: `-o`, and a call without both, add the time"
        return failed(f"{params.file} was not written; {_list_paths(near)} was", hint=hint)
    what = f"{params.file} was not written"
    if end := explain_early_end(package, run):
        return end.verdict(failed_or_blocked, f"{what}: the program ended before ({end.cause})")
    hint = f"write {params.file} before the program ends"
    if unmade := bag_not_made(package, run):
        what, hint = f"{what}: {unmade.why}", unmade.hint
    elif paths:
        what = f"{what}; what it wrote is {_list_paths(paths)}"
    else:
        what = f"{what}, and no other file"
    verdict = failed(what, hint=hint, citations=unmade.citations if unmade else ())
    return verdict if unmade else verdict.if_repeated()


def _list_paths(paths: Iterable[str]) -> str:
    return first_few([shown(path) for path in paths], NAMES_SHOWN)


def _recording(file: LeftFile, topics: dict[str, TopicLeft], run: Run) -> Verdict | None:
    try:
        channels = file.recording().channels
    except EvidenceError as error:
        return failed(error.message, hint=error.hint or "close the recording: end rosbag record with Ctrl-C")
    for topic, wanted in topics.items():
        # rosbag writes a name as it was given: `rosbag record steps`, which is played back on /steps
        found = [channel for channel in channels if channel.topic in {topic, topic.lstrip("/")}]
        if wrong := _wrong_topic(file.path, topic, wanted, found, run):
            seen = list(dict.fromkeys(channel.topic for channel in channels if channel.messages))
            return wrong.about(measured=_list_paths(seen) or "no topic")
    return None


def _wrong_topic(
    path: str, topic: str, wanted: TopicLeft, found: Sequence[Channel], run: Run
) -> Verdict | None:
    count = sum(len(channel.messages) for channel in found)
    if not count:
        hint = f"rosbag record {topic} …: name the topic as rostopic list shows it"
        if not any(c.topic == topic and c.messages for c in run.channels):
            hint = f"publish on {topic}: nothing came on it while it was recorded"
        return failed(f"{path} holds no message on {topic}", hint=hint).if_repeated()
    types = {plain_type(channel.type) for channel in found}
    if wanted.type is not None and types != {wanted.type}:
        message = f"{path}: {topic} has the type {_list_paths(sorted(types))}, not {wanted.type}"
        return failed(message, hint=f"publish {wanted.type} on {topic}")
    if count < wanted.at_least:
        message = f"{path} holds {plural(count, 'message')} on {topic}, not {wanted.at_least}"
        verdict = failed(message, hint="record from the beginning to the end")
        return _short(verdict, run, count, wanted.at_least)
    return None


def _cut_short(verdict: Verdict, package: PackageFacts, run: Run) -> Verdict:
    """Return a loss of messages with the option of `rosbag record` that ends it before they come."""
    said = verdict.basis.excused or verdict.message
    for place, node in recorders(package) if verdict.status is not Status.PASS and " holds " in said else ():
        for option in ENDS_IT.finditer(node.args or ""):
            number, wrote = int(option[1]), option[0].strip()
            hint = f"take `{wrote}` out of the args"
            if "duration" not in wrote and f" holds {plural(number, 'message')} " in said:
                # as many as that, on any machine
                return failed(said, hint=hint).explained(f"`{wrote}` keeps no more", hint, (place,))
            is_short = number * SECONDS[option[2]] * 10**9 < run.end_ns - run.start_ns
            if "duration" in wrote and is_short and verdict.status is Status.FAIL:
                return verdict.explained(f"`{wrote}` ends the recording after that time", hint, (place,))
    return verdict


def _short(verdict: Verdict, run: Run, count: int, least: int) -> Verdict:
    """A machine that is late makes a recording shorter, but not by half."""
    once = verdict.if_repeated()
    return excused(once, run, run.start_ns, run.end_ns, why_late) if 2 * count >= least else once


OTHER_SIGNS = (";", "\t", "|", " ")
"""What programs write between values in place of a comma."""


def _words_apart(names: Sequence[str], sign: str) -> set[str]:
    return {word.strip() for name in names for word in name.split(sign)}


def _table(file: LeftFile, params: FileLeftParams, run: Run) -> Verdict | None:
    data = file.data or b""
    if len(data) > TABLE_BYTES_MAX:
        return failed(f"{file.path} is larger than {TABLE_BYTES_MAX >> 20} MB", hint="write fewer rows")
    try:
        # Some programs begin a text with a mark of its encoding, which is no part of the first name.
        rows = [row for row in csv.reader(data.decode("utf-8-sig", errors="replace").splitlines()) if row]
    except csv.Error as error:
        return failed(f"{file.path} is not a table: {error}", hint="write it with csv.writer(file)")
    names = [name.strip() for name in rows[0]] if rows else []
    lacking = [name for name in params.columns if name not in names]
    if lacking:
        first = shown(",".join(names)) or "empty"
        message = f"{file.path} has no column {join_words(lacking)}; its first row is {first}"
        apart = next((sign for sign in OTHER_SIGNS if {*params.columns} <= _words_apart(names, sign)), "")
        hint = f"write a comma between the values, not {apart!r}" if apart else ""
        verdict = failed(message, hint=hint or f"begin with the row {','.join(params.columns)}")
        return verdict.seeking("quoted", *(one for one in names if one not in params.columns))
    values = rows[1:] if params.columns else rows
    if len(values) < params.rows_at_least:
        message = f"{file.path} has {plural(len(values), 'row')}, not {params.rows_at_least}"
        verdict = failed(message, hint="write one row each time, and close the file")
        return _short(verdict, run, len(values), params.rows_at_least)
    return _out_of_bounds(file.path, names, values, params)


def _out_of_bounds(
    path: str, names: Sequence[str], rows: Sequence[Sequence[str]], params: FileLeftParams
) -> Verdict | None:
    for number, row in enumerate(rows, 2):
        if len(row) < len(names):
            message = f"row {number} of {path} has {plural(len(row), 'value')}, not {len(names)}"
            return failed(message, hint="write a value for each column, and close the file")
        for name, bounds in params.bounds.items():
            text = row[names.index(name)].strip()
            try:
                right = is_within(float(text), bounds.min, bounds.max)
            except ValueError:
                right = False
            if not right:
                message = f"row {number} of {path}: {name} is {shown(text) or 'empty'}"
                hint = f"it should be {bounds_text(bounds.min, bounds.max)}"
                if fitting := [
                    one for one in names if one != name and _all_within(rows, names.index(one), bounds)
                ]:
                    hint += f", as each value of the column {shown(fitting[0])} is: keep to the order of the names"
                return failed(message, hint=hint)
    return None


def _all_within(rows: Sequence[Sequence[str]], column: int, bounds: ColumnBounds) -> bool:
    with suppress(ValueError, IndexError):
        return all(is_within(float(row[column]), bounds.min, bounds.max) for row in rows)
    return False


def _map(file: LeftFile) -> Verdict | None:
    data = file.data or b""
    head = PGM.match(data[:PGM_HEAD_BYTES])
    hint = "rosrun map_server map_saver -f <name> writes a map"
    if head is None:
        return failed(f"{file.path} is not a PGM map", hint=hint)
    width, height = int(head[1]), int(head[2])
    # A P5 has a byte for each cell; a P2 has text, of any length.
    if data.startswith(b"P5") and len(data) - head.end() < width * height:
        return failed(f"{file.path} is cut short: it has fewer than {width} by {height} cells", hint=hint)
    return None
