"""Gradescope and PrairieLearn: what is exported for each, and how a result or a fault is written for it.

An export packs the grader itself as a wheel, the lab, and the settings that the packed grader reads back. The same
grader and lab always give the same bytes. `autograde` is what runs in the platform's container.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import shlex
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Literal
from uuid import NAMESPACE_URL, uuid5

from pydantic import ValidationError

from grader.errors import GraderError, InternalError, UsageError
from grader.files import atomic_write
from grader.installable import PIP, known_packages
from grader.model import SandboxMode
from grader.model.record import Record
from grader.model.result import CriterionResult, GradingResult
from grader.report.platform_results import LIMIT, LOOK, detail_rows, render_gradescope
from grader.report.sentences import STATES, score_words, without_sandbox
from grader.report.text import html, line, text_limit
from grader.report.view import hidden_ids
from grader.rubric.find import checkout
from grader.rubric.load import LoadedRubric, read_beside_rubric
from grader.rubric.model import Needs
from grader.wording import number

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

NAME = "ros-lab-grader"
PACKAGE = Path(__file__).resolve().parents[1]
SYSTEM_SCRIPT = "setup.sh"
WHEEL = "Wheel-Version: 1.0\nGenerator: grader export\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
METADATA_FILES = ("METADATA", "entry_points.txt")
SETTINGS_FILE = "grader.json"
"""Lies in the folder of the lab."""
EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The first date that a zip can carry: the time of the export is not part of its bytes."""
LostModes = Literal["lost", "granted"]


@dataclass(frozen=True, kw_only=True)
class ContainerLayout:
    """Where a platform's container keeps the `lab` and the `upload`, as folders below its root, and how results are
    written for it: `graded` and `not_graded` return the JSON document `results/results.json`."""

    lab: str
    upload: str
    graded: Callable[[GradingResult, LoadedRubric], dict[str, Any]]
    not_graded: Callable[[GraderError], dict[str, Any]]


class BundleSettings(Record):
    """The file `grader.json` of an exported grader, beside the rubric's folder.

    `rubric` is the path of the rubric from the folder of the settings, `minutes` the platform's time limit. `modes`
    says how a script counts if its executable bit was lost in the upload. `package` is the name of the package to
    grade, "" for the lab's.
    """

    rubric: str
    minutes: int
    sandbox: SandboxMode = "auto"
    modes: LostModes = "lost"
    package: str = ""

    @property
    def grading_s(self) -> int:
        """Return how long grading may take: half a minute is left to report that it took too long."""
        return self.minutes * 60 - 30

    def to_json(self) -> bytes:
        """Return the content of its file."""
        return f"{self.model_dump_json(indent=2)}\n".encode()


def read_settings(folder: Path) -> BundleSettings:
    """Read the settings in `folder`. Raises InternalError: an export wrote them, not a student."""
    try:
        return BundleSettings.model_validate_json((folder / SETTINGS_FILE).read_bytes())
    except (OSError, ValidationError) as error:
        raise InternalError(
            f"{folder / SETTINGS_FILE} cannot be read: {type(error).__name__}", hint="export the grader again"
        ) from error


class Bundle:
    """Files to hand over as a zip or a folder, by their relative POSIX path."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[bytes, bool]] = {}

    def add(self, path: str, data: bytes, *, executable: bool = False) -> None:
        """Add a file, or replace the one of the same path."""
        self._files[path] = (data, executable)

    def entries(self) -> Iterator[tuple[str, bytes, bool]]:
        """Return the path, content and executable bit of each file, sorted by path."""
        for path, (data, executable) in sorted(self._files.items()):
            yield path, data, executable

    def zipped(self) -> bytes:
        """Return a zip that keeps the modes of the files."""
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for path, data, executable in self.entries():
                about = zipfile.ZipInfo(path, EARLIEST)
                about.create_system = 3  # Unix, on any machine: only then do modes count
                about.compress_type = zipfile.ZIP_DEFLATED
                about.external_attr = _mode(executable=executable) << 16
                archive.writestr(about, data)
        return out.getvalue()

    def write(self, folder: Path) -> None:
        """Write the files below `folder`, each one atomically. Raises OutputError."""
        for path, data, executable in self.entries():
            target = folder / path
            atomic_write(target, data, public=True)
            target.chmod(_mode(executable=executable) & 0o777)


def _mode(*, executable: bool) -> int:
    return 0o100755 if executable else 0o100644


def wheel() -> tuple[str, bytes]:
    """Return the file name and the bytes of a wheel of the running grader, installed or in a clone.

    What is installed beside the package (the man page) is left out. Raises UsageError if the grader is not installed
    but only on Python's path.
    """
    try:
        installed = distribution(NAME)
    except PackageNotFoundError as error:
        raise UsageError(
            "the grader is not installed here, so it cannot be packed",
            hint="run pip install -e . in its folder, or install it with pipx",
        ) from error
    bundle = Bundle()
    for path, file in _package_files():
        bundle.add(path, file.read_bytes(), executable=os.access(file, os.X_OK))
    stem = f"{NAME.replace('-', '_')}-{installed.version}"
    info = f"{stem}.dist-info"
    for name in METADATA_FILES:
        if (text := installed.read_text(name)) is not None:
            bundle.add(f"{info}/{name}", text.encode())
    bundle.add(f"{info}/WHEEL", WHEEL.encode())
    bundle.add(f"{info}/RECORD", _record(bundle, f"{info}/RECORD"))
    return f"{stem}-py3-none-any.whl", bundle.zipped()


def system_script() -> bytes:
    """Return the script that installs the system's packages."""
    clone = checkout()
    file = clone / "scripts" / SYSTEM_SCRIPT if clone else PACKAGE / "_data" / SYSTEM_SCRIPT
    return file.read_bytes()


def _package_files() -> Iterator[tuple[str, Path]]:
    yield from _files(PACKAGE, PACKAGE.name)
    clone = checkout()
    if clone is None:
        return
    project = tomllib.loads((clone / "pyproject.toml").read_text(encoding="utf-8"))
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for source, target in sorted(included.items()):
        yield from _files(clone / source, target)


def _files(source: Path, target: str) -> Iterator[tuple[str, Path]]:
    if source.is_file():
        yield target, source
    for file in sorted(source.rglob("*")):
        inside = file.relative_to(source)
        # what Python compiled has times and paths of this machine in it
        if file.is_file() and file.suffix != ".pyc" and "__pycache__" not in inside.parts:
            yield f"{target}/{inside.as_posix()}", file


def _record(bundle: Bundle, own: str) -> bytes:
    lines = [f"{path},sha256={_digest(data)},{len(data)}" for path, data, _ in bundle.entries()]
    # RECORD cannot list its own sum; the specification of wheels leaves it empty
    return "".join(f"{line}\n" for line in [*lines, f"{own},,"]).encode()


def _digest(data: bytes) -> str:
    # as the specification of wheels asks for
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def add_lab(bundle: Bundle, rubric: LoadedRubric, folder: str) -> str:
    """Add the rubric's file and the files it names below `folder`. Return the rubric's path in the bundle."""
    path = f"{folder}/{rubric.path.name}"
    bundle.add(path, rubric.path.read_bytes())
    for name, data in read_beside_rubric(rubric).items():
        # the course's copy may have lost its modes on the way
        bundle.add(f"{folder}/{name}", data, executable=data.startswith(b"#!"))
    return path


def needs_script(needs: Needs) -> bytes:
    """Return the script that installs what a rubric needs besides ROS and the grader; empty where that is nothing."""
    apt, pip, unknown = list(needs.apt), list(needs.pip), []
    for name in needs.ros:
        packages = known_packages().get(name, ())
        own = [one for one in packages if not one.startswith(PIP)]
        apt += own
        pip += [one.removeprefix(PIP) for one in packages if one not in own]
        unknown += [] if packages else [name]
    if not (apt or pip or unknown):
        return b""
    apt += ["python3-pip"] if pip else []
    lines = [template("needs.sh").decode(), f"apt-get install -y --no-install-recommends {shlex.join(apt)}\n"]
    if pip:
        # the variable, as Debian's pip refuses to install beside apt's packages (PEP 668); the container is
        # ours alone
        lines.append(f"PIP_BREAK_SYSTEM_PACKAGES=1 python3 -m pip install --no-cache-dir {shlex.join(pip)}\n")
    lines += [f"echo 'setup: install the ROS package {name} here yourself' >&2\n" for name in unknown]
    return "".join(lines).encode()


def template(name: str) -> bytes:
    """Return a file of `integrations/files`, which holds what the platforms run and show."""
    return (resources.files("grader.integrations") / "files" / name).read_bytes()


ENTRYPOINT = "/usr/local/bin/grade-question"
NEEDS_LINES = (
    b"COPY needs.sh /tmp/needs.sh\nRUN bash /tmp/needs.sh && rm -rf /tmp/needs.sh /var/lib/apt/lists/*\n"
)


def gradescope_autograder(rubric: LoadedRubric, settings: BundleSettings) -> bytes:
    """Return the zip to upload. Raises UsageError if the grader is not installed."""
    bundle = Bundle()
    name, data = wheel()
    bundle.add(name, data)
    bundle.add("system.sh", system_script(), executable=True)
    bundle.add("setup.sh", template("gradescope-setup.sh"), executable=True)
    run = template("run_autograder").replace(b"@SECONDS@", str(settings.grading_s).encode())
    bundle.add("run_autograder", run, executable=True)
    if needs := needs_script(rubric.rubric.needs):
        bundle.add("needs.sh", needs, executable=True)
    path = add_lab(bundle, rubric, "rubric")
    bundle.add(SETTINGS_FILE, settings.model_copy(update={"rubric": path}).to_json())
    return bundle.zipped()


def _gradescope_results(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Return the points and tests. Raises GraderError if nothing was graded because of the machine."""
    document: dict[str, Any] = json.loads(render_gradescope(result, rubric.rubric))
    about = result.environment
    unwalled = line(without_sandbox(about.sandbox), LIMIT)
    document["extra_data"] = {
        "grader": about.grader,
        "sandbox": about.sandbox,
        **({"without_sandbox": unwalled} if unwalled else {}),
        "rubric": result.rubric.model_dump(),
        "submission": result.submission.digest,
    }
    return document


def _gradescope_fault(fault: GraderError) -> dict[str, Any]:
    """Return a document without a score: Gradescope then stores none, and the staff can run it again."""
    why = f"NOT GRADED, {LOOK}: {line(fault.message, LIMIT)}"
    test = {"name": "NOT GRADED", "status": "failed", "output": why, "visibility": "visible"}
    return {
        "output": f"{why}\n{line(fault.hint, LIMIT)}\nThis is not a mark: nothing was counted against you.",
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": [test],
    }


GRADESCOPE = ContainerLayout(
    lab="source", upload="submission", graded=_gradescope_results, not_graded=_gradescope_fault
)
"""Its folders lie below /autograder."""


def prairielearn_question(rubric: LoadedRubric, settings: BundleSettings, image: str) -> Bundle:
    """Return the folder `question/` for a course, and `image/`, the files of a Docker image: it suits every lab that
    needs nothing besides."""
    bundle = Bundle()
    name, data = wheel()
    bundle.add(f"image/{name}", data)
    bundle.add("image/system.sh", system_script(), executable=True)
    bundle.add("image/grade-question", template("grade-question"), executable=True)
    dockerfile = template("prairielearn.Dockerfile")
    if needs := needs_script(rubric.rubric.needs):
        bundle.add("image/needs.sh", needs, executable=True)
        dockerfile = dockerfile.replace(b"ENTRYPOINT", NEEDS_LINES + b"ENTRYPOINT")
    bundle.add("image/Dockerfile", dockerfile)
    lab = add_lab(bundle, rubric, "question/tests/rubric").removeprefix("question/tests/")
    bundle.add(f"question/tests/{SETTINGS_FILE}", settings.model_copy(update={"rubric": lab}).to_json())
    bundle.add("question/info.json", _info(rubric, settings, image))
    bundle.add("question/question.html", _page(rubric, settings))
    return bundle


def write_question(bundle: Bundle, target: Path) -> None:
    """Write a question to a folder, or to a zip if `target` ends in .zip.

    Raises UsageError if the folder contains anything but an earlier export.
    """
    if target.suffix.lower() == ".zip":
        atomic_write(target, bundle.zipped(), public=True)
        return
    if target.exists() and not target.is_dir():
        raise UsageError(f"{target} is not a folder", hint="give --out a folder, or a name that ends in .zip")
    exported = (target / "question" / "tests" / SETTINGS_FILE).is_file()
    if target.is_dir() and any(target.iterdir()) and not exported:
        raise UsageError(f"{target} contains other files", hint="choose a new folder with --out")
    bundle.write(target)


def _info(rubric: LoadedRubric, settings: BundleSettings, image: str) -> bytes:
    """Return info.json. Its uuid comes from the rubric's id, so that a second export is the same question."""
    lab = rubric.rubric
    info = {
        "uuid": str(uuid5(NAMESPACE_URL, f"ros-lab-grader:{lab.id}")),
        "title": lab.title,
        "topic": "ROS",
        "tags": ["code", "v3"],
        "type": "v3",
        "singleVariant": True,
        "gradingMethod": "External",
        "externalGradingOptions": {
            "enabled": True,
            "image": image,
            "entrypoint": ENTRYPOINT,
            "timeout": settings.minutes * 60,
        },
    }
    return f"{json.dumps(info, indent=4, ensure_ascii=False)}\n".encode()


def _page(rubric: LoadedRubric, settings: BundleSettings) -> bytes:
    text = template("question.html").decode()
    package = html(settings.package or rubric.rubric.package)
    return text.replace("@TITLE@", html(rubric.rubric.title)).replace("@PACKAGE@", package).encode()


def _prairielearn_results(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Return the points, or that the submission cannot be graded: then no attempt is used up."""
    if result.error is not None:
        return _invalid(result.error.message, result.error.hint)
    # without any that counts, too: there is nothing to give points for
    counting = [c for c in result.criteria if c.counts]
    if all(c.status.is_open for c in counting):
        return _invalid("no criterion could be judged", "submit again")
    hidden = hidden_ids(rubric.rubric)
    shown = [c for c in result.criteria if c.id not in hidden]
    limit = text_limit(len(result.criteria), LIMIT)
    tests = [_test(c, limit) for c in shown]
    if unseen := [c for c in result.criteria if c.id in hidden]:
        tests.append(_unseen(unseen))
    return {
        "gradable": True,
        # a bonus gives no more than all, and penalties no less than none
        "score": round(min(1.0, max(0.0, result.points / (result.max_points or 1.0))), 6),
        "message": "\n".join(_message(result, shown)),
        "tests": tests,
    }


PRAIRIELEARN = ContainerLayout(
    lab="tests",
    upload="student",
    graded=_prairielearn_results,
    # costs neither points nor an attempt
    not_graded=lambda fault: _invalid(fault.message, fault.hint),
)
"""Its folders lie below /grade."""


def _invalid(message: str, hint: str) -> dict[str, Any]:
    errors = [line(f"not graded: {message}", LIMIT), line(hint, LIMIT)]
    return {"gradable": False, "score": 0.0, "format_errors": [e for e in errors if e]}


def _message(result: GradingResult, shown: list[CriterionResult]) -> Iterator[str]:
    waiting = sum(c.missing for c in shown if c.status.is_open)
    if waiting:
        yield f"{LOOK}: {number(waiting)} points are not decided yet; no points are lost for good."
    yield f"{number(result.points)} of {number(result.max_points)} points"
    yield from (line(words, LIMIT) for words in score_words(result))


def _test(criterion: CriterionResult, limit: int) -> dict[str, Any]:
    name = f"{criterion.id}: {criterion.title}"
    return {
        "name": line(f"{LOOK}: {name}" if criterion.status.is_open else name, limit),
        "points": criterion.points,
        "max_points": criterion.max_points,
        "message": line(f"{STATES[criterion.status]}: {criterion.message}", limit),
        "output": "\n".join(
            f"{label}{line(text, limit)}" for label, text in detail_rows(criterion).items() if text
        ),
    }


def _unseen(criteria: list[CriterionResult]) -> dict[str, Any]:
    """Return one row for all hidden criteria: PrairieLearn cannot reveal them later, and the score counts them."""
    return {
        "name": f"{len(criteria)} criteria that are not shown",
        "points": round(sum(c.points for c in criteria), 6),
        "max_points": sum(c.max_points for c in criteria),
    }
