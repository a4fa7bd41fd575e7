"""The parsers of the grader's side, each as a function of bytes, with the exceptions that it promises.

They work in the current folder, which is empty when the process starts.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

from grader.arena.limits import RunLimits
from grader.arena.sandbox import Sandbox
from grader.arena.scenario_inputs import settings
from grader.arena.session import ArenaSession
from grader.arena.workspace import read_archive, read_member
from grader.authoring.mutation.faulty_packages import load_mutants
from grader.classes.gradebook import write_gradebook
from grader.classes.gradebook.template import read_sheet
from grader.classes.roster import read_roster
from grader.errors import EvidenceError, GraderError, OutputError, RubricError, SubmissionError, UsageError
from grader.evidence.bag import export_bag
from grader.evidence.decode import Decoder
from grader.evidence.inspect import inspect_run
from grader.evidence.message_values import ServiceTypes
from grader.evidence.reader import load_run, package_facts
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceStream
from grader.intake.candidates import manifest_name
from grader.intake.limits import IntakeLimits
from grader.intake.names import safe_name
from grader.intake.open import open_submission
from grader.intake.repository import choose_ref, parse_refs
from grader.intake.source import parse_source
from grader.model.message_definitions import parse_interface
from grader.model.package import CMakeFacts
from grader.model.record import Record
from grader.package.cmake import read_cmake, refine_cmake
from grader.package.facts import _text_facts
from grader.package.launch import parse_launch, parse_launch_files
from grader.package.manifest import parse_manifest, read_manifest
from grader.package.python import read_syntax_report, reason_of
from grader.rubric.load import load_rubric
from grader.rubric.model import Rubric
from grader.rubric.scenario import Param
from grader.rubric.yaml_lines import read_source
from tests.classes.gradebook.made import BOOK, row
from tests.support.timeline import build_runs

Read = Callable[[bytes], None]
Promised = tuple[type[Exception], ...]

PACKAGE = "lab1"
PART = b"%%% "
SMALL = IntakeLimits(total_bytes=8 << 20, entries=500)
RECORD_BYTES_MAX = 24 << 20
LINE_MAX = 2000
PLACE = SimpleNamespace(sandbox=Sandbox(bubblewrap=True, uid=None), limits=RunLimits())
ENVELOPE = {"scenario": "talker", "clock": "real", "warp": 1.0, "metadata": {}}


def parts(data: bytes, first: str) -> dict[str, bytes]:
    """Several files in one: a line `%%% path` begins each but the first."""
    found: dict[str, bytes] = {}
    name = first
    for number, piece in enumerate((b"\n" + data).split(b"\n" + PART)):
        if number:
            line, _, piece = piece.partition(b"\n")  # noqa: PLW2901 - the rest of it
            name = line.decode(errors="replace").strip()
        found[name] = piece
    found[first] = found[first].removeprefix(b"\n")
    return found


def tree(data: bytes, first: str) -> Path:
    """The files in a new folder; those whose names lead out of it are left out."""
    folder = fresh("tree")
    for name, content in parts(data, first).items():
        path = Path(os.path.normpath(folder / name.replace("\0", "")))
        if path.is_relative_to(folder) and len(name) < 100 and not path.exists() and path != folder:
            write(path, content)
    return folder


def fresh(name: str) -> Path:
    folder = Path(name).absolute()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def write(path: Path, data: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    except (FileExistsError, NotADirectoryError):
        pass  # a name that is a file's and a folder's at once
    return path


def comes_back(record: Record | None) -> None:
    """A record that is written down can be read again, and is not many times what it was made of."""
    if record is None:
        return
    text = record.model_dump_json()
    assert len(text) < RECORD_BYTES_MAX, f"a record of {len(text)} bytes"
    assert type(record).model_validate_json(text) == record


def one_line(error: GraderError, given: bytes = b"") -> None:
    """What the user gave may be repeated in it."""
    assert "\n" not in error.message, f"more than one line: {error.message!r}"
    assert len(error.message) < LINE_MAX + 4 * len(given), f"a line of {len(error.message)} characters"


def manifest(data: bytes) -> None:
    for record in parse_manifest(data):
        comes_back(record)
    folder = fresh("tree")
    write(folder / "package.xml", data)
    read_manifest(folder)
    manifest_name(folder, root=folder)


def launch(data: bytes) -> None:
    comes_back(parse_launch(data, "launch/a.launch"))


def launch_loader(data: bytes) -> None:
    for record in parse_launch_files(parts(data, "launch/a.launch"), (PACKAGE,)):
        comes_back(record)


def cmake(data: bytes) -> None:
    comes_back(read_cmake(tree(data, "CMakeLists.txt"), PACKAGE))


def cmake_trace(data: bytes) -> None:
    trace = write(Path("trace.json"), data)
    facts = CMakeFacts(file="CMakeLists.txt", source="parser", calls=(), last_line=40)
    for root in (None, f"/home/student/catkin_ws/src/{PACKAGE}"):
        comes_back(refine_cmake(facts, (PACKAGE,), trace=trace, root=root))


def syntax_report(data: bytes) -> None:
    comes_back(read_syntax_report(data))


def python_causes(data: bytes) -> None:
    message, _, text = data.decode("utf-8", "replace").partition("\n")
    reason_of(
        message, text, column=len(text) or None, opened=len(message) % 3 or None, mixed=len(text) % 2 == 0
    )


def source_file(data: bytes) -> None:
    for path in ("src/talker.py", "src/talker", "run.sh"):
        _text_facts(data, path, executable=path == "run.sh")


def parameters(data: bytes) -> None:
    file = write(Path("params.yaml"), data)
    found, _ = settings((Param(file="params.yaml", also=("/name",)),), lambda _: file)
    json.dumps([setting.value for setting in found], allow_nan=False)


def source(data: bytes) -> None:
    try:
        parse_source(os.fsdecode(data))
    except (UsageError, SubmissionError) as error:
        one_line(error, data)
        raise


def roster(data: bytes) -> None:
    _roster(write(fresh("class") / "roster.csv", data), data)


def gitlab(data: bytes) -> None:
    _roster(write(fresh("class") / "projects.json", data), data)


def _roster(path: Path, data: bytes) -> None:
    try:
        found = read_roster(path)
    except UsageError as error:
        one_line(error, data)
        raise
    comes_back(found)
    ids = [safe_name(entry.id).casefold() for entry in found.entries]
    assert len(ids) == len(set(ids)), "two entries would share one folder"
    for fault in found.faults:
        assert "\n" not in str(fault), f"more than one line: {str(fault)!r}"


def template(data: bytes) -> None:
    """A platform's export comes back as it was, but for one cell."""
    path = write(fresh("book") / "export.csv", data)
    assert read_sheet(path).to_bytes() == data
    for platform in ("canvas", "moodle", "blackboard"):
        with suppress(UsageError):
            write_gradebook(
                BOOK, [row("ada", name="Ada Lovelace")], path.with_name("out"), platform, template=path
            )


def archive(data: bytes) -> None:
    file, work = write(Path("lab1.zip"), data), fresh("work")
    try:
        submission = open_submission(str(file), package=PACKAGE, workdir=work, limits=SMALL)
    except SubmissionError as error:
        one_line(error)
        raise
    comes_back(submission)
    for path in submission.root.rglob("*"):
        assert path.resolve().is_relative_to(submission.root.resolve()), f"{path} leads out"


def built(data: bytes) -> None:
    left = write(Path("built.tar"), data)
    comes_back(read_archive(left, PACKAGE))
    read_member(left, "trace.json", 1000)


def git_refs(data: bytes) -> None:
    wanted, _, text = data.decode("utf-8", "surrogateescape").partition("\n")
    try:
        choose_ref(parse_refs(text), wanted or None, given="repository")
    except SubmissionError as error:
        one_line(error)
        raise


def rubric(data: bytes) -> None:
    load_rubric(str(write(fresh("tree") / "lab.yaml", data)))


@lru_cache(maxsize=1)
def _rubric() -> Rubric:
    return load_rubric("leeds-comp3631-lab1").rubric


def mutants(data: bytes) -> None:
    load_mutants(write(Path("mutants.yaml"), data), _rubric())


def timeline(data: bytes) -> None:
    read = read_source(write(Path("timeline.yaml"), data), "timeline.yaml").data
    if isinstance(read, dict):
        for run in build_runs(read).values():
            seen(run)


def definition(data: bytes) -> None:
    text, _, message = data.partition(b"\0")
    name, _, lines = text.decode("utf-8", "replace").partition("\n")
    Decoder(name, lines).decode(message)
    for path in ("msg/A.msg", "srv/A.srv", "action/A.action"):
        comes_back(parse_interface(text, path))


def service(data: bytes) -> None:
    text, _, answer = data.partition(b"\0")
    name, _, lines = text.decode("utf-8", "replace").partition("\n")
    found = ServiceTypes(name, lines)
    found.request.encode({})
    found.response.decode(answer)


def frames(data: bytes) -> None:
    """What the arena sends never breaks the session: what is no frame becomes its failure."""
    writer = EvidenceStream(BytesIO(), **ENVELOPE)
    session = ArenaSession(PLACE, writer)  # type: ignore[arg-type] # nothing is started
    cut = len(data) // 3
    session._read(data[:cut])
    session._read(data[cut:])
    writer.finish()


def mcap(data: bytes) -> None:
    seen(_loaded(data))


def recording(data: bytes) -> None:
    """As it is when a recording is handed in: it tells of nothing but messages."""
    run = _loaded(data)
    if run.foreign:
        told = (run.processes, run.console, run.graph, run.params, run.actors, run.course, run.package_json)
        assert not any(told)
    seen(run)
    try:
        export_bag(run, Path("out.bag"), everything=True)
    except (EvidenceError, OutputError) as error:
        one_line(error)


def _loaded(data: bytes) -> Run:
    try:
        return load_run(BytesIO(data))
    except EvidenceError as error:
        one_line(error)
        raise


def bag(data: bytes) -> None:
    try:
        run = load_run(write(Path("lab.bag"), data))
    except EvidenceError as error:
        one_line(error)
        raise
    seen(run)


def seen(run: Run) -> None:
    """As the checks and `grader inspect` look at it."""
    inspect_run(run).model_dump_json()
    for channel in run.channels:
        _ = channel.data
    if run.package_json is not None:
        package_facts(run)


NOTHING: Promised = ()
READERS: dict[str, tuple[Read, Promised]] = {
    "manifest": (manifest, NOTHING),
    "launch": (launch, NOTHING),
    "launch-loader": (launch_loader, NOTHING),
    "cmake": (cmake, NOTHING),
    "cmake-trace": (cmake_trace, NOTHING),
    "syntax-report": (syntax_report, NOTHING),
    "python-causes": (python_causes, NOTHING),
    "source-file": (source_file, NOTHING),
    "parameters": (parameters, NOTHING),
    "source": (source, (UsageError, SubmissionError)),
    "roster": (roster, (UsageError,)),
    "gitlab": (gitlab, (UsageError,)),
    "template": (template, (UsageError,)),
    "archive": (archive, (SubmissionError,)),
    "built": (built, NOTHING),
    "git-refs": (git_refs, (SubmissionError,)),
    "rubric": (rubric, (RubricError,)),
    "mutants": (mutants, (RubricError,)),
    "timeline": (timeline, (RubricError, ValueError)),
    "definition": (definition, NOTHING),
    "service": (service, (ValueError,)),
    "frames": (frames, NOTHING),
    "mcap": (mcap, (EvidenceError,)),
    "recording": (recording, (EvidenceError,)),
    "bag": (bag, (EvidenceError,)),
}
