"""`grader check --watch`: grade a package again whenever one of its files is saved, until Ctrl-C.

A package's folder and the options of `grader check` come in; results go to a `Screen`,
which is cleared between runs on a terminal, else line after line. Each run grades everything again: how one file of a
package affects another cannot be foreseen, and a stale result would mislead.

Saves are found by polling, which works on network folders and virtual machines' shares too. A save only says when to
look; whether the package has changed is decided by its contents.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import IO, TextIO

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from grader import pipeline
from grader.arena.interruption import Stop, Stopped
from grader.arena.workspace import needed_packages
from grader.errors import ExitCode, GraderError, SubmissionError, UsageError
from grader.faults import error_result
from grader.files import temporary_folder
from grader.intake.choose import WantedPackage
from grader.intake.open import open_submission
from grader.intake.source import identify
from grader.model.package import SourceFile
from grader.model.result import CriterionResult, GradingResult, Progress, SubmissionInfo
from grader.model.verdict import Status
from grader.package.facts import read_files
from grader.package.reading import LEFT_OUT
from grader.report.files import result_text
from grader.report.losses import arrange
from grader.report.sentences import points_line
from grader.report.terminal import TO_FIX, Terminal, emit, fit_encoding, open_console
from grader.report.text import line
from grader.report.view import points_of, without_hidden
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.wording import first_few, number

# a save shows within a quarter of a second, and a thousand files are looked at for little
POLL_S = 0.25
AGAIN_S = 0.4
GONE_S = 1.0
WAIT_S = 5.0
LOOKS = 3
IGNORED_FOLDERS = LEFT_OUT | {
    ".tox", ".venv", ".idea", ".vscode", "node_modules", ".mypy_cache", ".pytest_cache", ".ruff_cache",
    ".hypothesis", "logs", "grader-results",
}  # fmt: skip
IGNORED_NAMES = re.compile(
    r"""
      \.py[cod]$ | \.log$ | \.active$                       # Python's, and what ROS is still writing
    | ~$ | \.sw[a-z]$ | ^4913$ | \.(bak|orig|tmp|part)$     # vim, and many others
    | ^\.?\# | ^flycheck_ | ^flymake_                       # Emacs
    | \.kate-swp$ | ^\.goutputstream- | ^\.~lock | ___jb_\w+___$
    | ^\.DS_Store$ | ^\.nfs | ^\.fuse_hidden
    """,
    re.VERBOSE,
)


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """The files of a package, and of those built with it, at one moment.

    Two are equal if the grader would say the same of both: `hints` has git's view of the modes. `folders` are those
    of all the packages.
    """

    folder: Path
    files: dict[str, SourceFile]
    hints: tuple[str, ...]
    folders: tuple[Path, ...]


@dataclass(frozen=True, kw_only=True)
class WatchedResult:
    """One result. While it is `undecided`, a save is reason enough to try again, even if no file has changed."""

    result: GradingResult
    code: ExitCode
    undecided: bool = False


class Screen:
    """Shows the user what happens. This one shows nothing."""

    def begin(self, saved: tuple[str, ...]) -> None:
        """Show that a run begins because these files were saved; none for the first run."""

    def restart(self) -> None:
        """Show that a run was stopped because something was saved during it."""

    def end(self, outcome: WatchedResult, saved: tuple[str, ...]) -> None:
        """Show a result."""

    def unchanged(self, saved: tuple[str, ...]) -> None:
        """Show that something was saved that changes nothing."""


@dataclass(kw_only=True)
class Grading:
    """Grades `source` into `out`, as often as it is called. `code` gives the exit code of a result; `progress` opens a
    display and is told whether it is the first one."""

    source: str
    rubric: LoadedRubric
    out: Path
    options: pipeline.GradeOptions
    progress: Callable[[bool], AbstractContextManager[Progress]]
    code: Callable[[GradingResult], ExitCode]
    _begun: bool = field(default=False, init=False)

    def __call__(self, stop: Stop) -> WatchedResult:
        """Return the outcome. Raises Stopped, and GraderError where no save can help: a wrong use, or a fault of the
        machine at the very start."""
        try:
            with self.progress(not self._begun) as progress:
                options = replace(self.options, stop=stop)
                result = pipeline.grade(self.source, self.rubric, self.out, options, progress)
        except GraderError as error:
            # at the start nobody has seen a result yet, and a save does not repair the machine
            if isinstance(error, UsageError) or (error.blame != "submission" and not self._begun):
                raise
            about = SubmissionInfo.unopened(*(identify(self.source) or (Path(self.source).name, self.source)))
            result = error_result(error, about, self.rubric)
        self._begun = True
        undecided = not self.options.static_only and any(c.status.is_retryable for c in result.criteria)
        shown = without_hidden(result, self.rubric.rubric)
        # what failed may have been a file half-written, or Docker not yet there
        if shown.status == "error":
            return WatchedResult(result=shown, code=ExitCode.NOT_GRADED, undecided=True)
        return WatchedResult(result=shown, code=self.code(shown), undecided=undecided)


class Watch:
    """The loop. `folder` is the absolute path that the command line named.

    `look` takes a snapshot of the package; `grade` grades it, and raises no SubmissionError.
    """

    def __init__(
        self,
        folder: Path,
        *,
        look: Callable[[], Snapshot],
        grade: Callable[[Stop], WatchedResult],
        saves: Saves,
        screen: Screen,
    ) -> None:
        self._folder = folder
        self._take, self._grade, self._saves, self._screen = look, grade, saves, screen
        self._graded: Snapshot | None = None
        self._last: WatchedResult | None = None
        self._saved: set[str] = set()

    def run(self) -> ExitCode:
        """Run until Ctrl-C, then return the exit code of the last result; KeyboardInterrupt where there is none yet.

        Raises SubmissionError where the package's folder is gone, and what `grade` raises.
        """
        try:
            while True:
                while not self._run_once():
                    self._screen.restart()
                self._saved.clear()
                while not self._wait_for_change():
                    pass
        except KeyboardInterrupt:
            if self._last is None:
                raise
            return self._last.code

    def _run_once(self) -> bool:
        """Grade and show the result; false if files were saved during it, so that it no longer holds."""
        snapshot = self._look()
        saved = self._names_to_show(snapshot)
        self._screen.begin(saved)
        stop = Stop()
        try:
            with self._saves.stopping(stop):
                outcome = self._grade(stop)
        except Stopped:
            self._saved |= self._saves.wait(0)
            return False
        # an error may come of an editor that was still writing
        saved_since = self._saves.wait(AGAIN_S if outcome.result.error is not None else 0)
        if saved_since and self._look() != snapshot:
            self._saved |= saved_since
            return False
        self._graded, self._last = snapshot, outcome
        self._screen.end(outcome, saved)
        return True

    def _wait_for_change(self) -> bool:
        """Wait a while for a save; return whether to grade again.

        Without a save, the package may have changed all the same: git's view of the modes is kept elsewhere.
        """
        self._saved |= self._saves.wait(WAIT_S)
        snapshot = self._look()
        if snapshot != self._graded:
            return True
        if not self._saved:
            return False
        if snapshot is None or (self._last is not None and self._last.undecided):
            return True
        self._screen.unchanged(self._relative(self._saved))
        self._saved.clear()
        return False

    def _look(self) -> Snapshot | None:
        """Return the package now; None where it cannot be read, even after a second look: an editor may replace it."""
        for _ in range(LOOKS):
            self._check_folder()
            try:
                snapshot = self._take()
            except (SubmissionError, OSError):
                self._saved |= self._saves.wait(AGAIN_S)
                continue
            self._folder = snapshot.folder
            self._saves.follow(snapshot.folders)
            return snapshot
        self._saves.follow((self._folder,))
        return None

    def _check_folder(self) -> None:
        until_s = time.monotonic() + GONE_S
        # some editors and `git switch` remove a folder for a moment
        while not self._folder.is_dir():
            if time.monotonic() > until_s:
                raise SubmissionError(f"{self._folder} was deleted or renamed while it was watched")
            self._saves.wait(GONE_S / 10)

    def _names_to_show(self, snapshot: Snapshot | None) -> tuple[str, ...]:
        """Return the files that differ from the last graded ones; else those that were saved."""
        changed = changed_files(self._graded, snapshot) if snapshot and self._graded else ()
        return changed or self._relative(self._saved)

    def _relative(self, saved: Iterable[str]) -> tuple[str, ...]:
        return tuple(
            sorted(name.removeprefix(f"{self._folder}{os.sep}").replace(os.sep, "/") for name in saved)
        )


class Saves:
    """Finds saved files by polling, in the folders to `follow`, but not what is below `without`."""

    def __init__(self, without: Path | None = None) -> None:
        self._without = without
        self._folders: tuple[Path, ...] = ()
        self._seen: dict[str, tuple[int, ...]] = {}
        self._saved: set[str] = set()

    def follow(self, folders: tuple[Path, ...]) -> None:
        """Poll these folders from now on."""
        if folders != self._folders:
            self._folders = folders
            self._seen = dict(self._stamps())

    def wait(self, timeout_s: float) -> frozenset[str]:
        """Return the paths saved since the last call, as soon as there are any; none after `timeout_s`.

        Files that are saved right after one another come together.
        """
        until_s = time.monotonic() + timeout_s
        while not self._poll() and (left_s := until_s - time.monotonic()) > 0:
            time.sleep(min(POLL_S, left_s))
        # an editor's "save all" and `git switch` write many files: one run for all of them
        while timeout_s and self._saved:
            known = len(self._saved)
            time.sleep(POLL_S / 2)
            self._poll()
            if len(self._saved) == known:
                break
        found, self._saved = frozenset(self._saved), set()
        return found

    @contextmanager
    def stopping(self, stop: Stop) -> Iterator[None]:
        """A context in which any save asks `stop`."""
        end = threading.Event()

        def poll() -> None:
            while not self._poll() and not end.wait(POLL_S):
                pass
            if self._saved:
                stop.ask()

        thread = threading.Thread(target=poll, daemon=True)
        thread.start()
        try:
            yield
        finally:
            end.set()
            thread.join()  # the thread writes what `wait` reads

    def _poll(self) -> bool:
        """Note what was saved; return whether there is any."""
        now = dict(self._stamps())
        self._saved |= {name for name, _ in now.items() ^ self._seen.items()}  # what is new, gone or changed
        self._seen = now
        return bool(self._saved)

    def _stamps(self) -> Iterator[tuple[str, tuple[int, ...]]]:
        for folder in self._folders:
            for place, folders, names in os.walk(folder):
                here = Path(place)
                folders[:] = [n for n in folders if not is_ignored(n) and here / n != self._without]
                for name in names:
                    # suppressed: a file may vanish between walk and stat
                    with suppress(OSError):
                        if not is_ignored(name):
                            about = (here / name).lstat()
                            stamp = (about.st_mtime_ns, about.st_size, about.st_mode, about.st_ino)
                            yield str(here / name), stamp


def watch(grading: Grading, screen: Screen, *, without: Path | None = None) -> ExitCode:
    """Grade again at each save until Ctrl-C; see `Watch.run`. `without` is a folder of our own results."""
    return Watch(
        Path(grading.source),
        look=lambda: take_snapshot(
            grading.source,
            pipeline.wanted_package(grading.rubric.rubric, grading.options.package),
            without=without,
        ),
        grade=grading,
        saves=Saves(without),
        screen=screen,
    ).run()


def is_ignored(path: str) -> bool:
    """Return whether a path relative to the package's folder is a leftover of a build, an editor, git or the grader."""
    parts = PurePosixPath(path).parts
    return any(part in IGNORED_FOLDERS for part in parts) or bool(parts and IGNORED_NAMES.search(parts[-1]))


def changed_files(before: Snapshot, after: Snapshot) -> tuple[str, ...]:
    """Return the paths of files that came, went or changed (contents, mode, link), the package's own first."""
    paths = before.files.keys() | after.files.keys()
    changed = (path for path in paths if before.files.get(path) != after.files.get(path))
    return tuple(sorted(changed, key=lambda path: (path.startswith("../"), path)))


def take_snapshot(source: str, package: str | WantedPackage, *, without: Path | None = None) -> Snapshot:
    """Return the package as `grader check SOURCE` sees it now, without what is in the folder `without`.

    Raises SubmissionError where there is no such package or a file cannot be read, OSError where one vanishes.
    """
    with temporary_folder("source") as workdir:
        submission = open_submission(source, package=package, workdir=workdir)
    home = submission.package.folder
    files: dict[str, SourceFile] = {}
    needed = needed_packages(submission)
    for one in needed:
        prefix = "" if one.folder == home else f"../{one.name}/"
        for file, path in read_files(one):
            if not is_ignored(path) and not (without and (one.folder / path).is_relative_to(without)):
                # where a mode was read changes with the first commit, and the file does not
                files[prefix + path] = file.model_copy(update={"mode_source": "disk"})
    hints = tuple(h for h in submission.hints if not any(is_ignored(word.rstrip(",")) for word in h.split()))
    return Snapshot(folder=home, files=files, hints=hints, folders=tuple(one.folder for one in needed))


NAME_CHARS, TEXT_CHARS = 60, 300
NAMES_SHOWN = 3
ENDS = "Ctrl-C ends it"
DASH = "\N{EN DASH}"
INDENT = 4
CHANGES = {
    "now reached": "green",
    "better": "green",
    "now lost": "red",
    "worse": "red",
    "no longer judged": "yellow",
}


class TerminalScreen(Screen):
    """Prints the first result in full, as `grader check` does, and later ones shortened.

    On a terminal, a result stays while the next one is worked out. `hidden` is how many criteria are left out.
    """

    def __init__(
        self,
        package: str,
        rubric: Rubric,
        stream: IO[str],
        *,
        hidden: int = 0,
        static: bool = False,
        clock: Callable[[], datetime] = lambda: datetime.now().astimezone(),
    ) -> None:
        self._package, self._rubric, self._hidden = package, rubric, hidden
        self._unrun = "--static" if static else ""
        self._console = open_console(stream)
        self._clock = clock
        self._at = clock()
        self._last: GradingResult | None = None
        self._ended = False

    def begin(self, saved: tuple[str, ...]) -> None:
        self._at = self._clock()
        doing = "looking at the files" if self._unrun else "running everything"
        self._say(f"{self._saved_text(saved)}: {doing} … {ENDS}" if saved else f"{doing} … {ENDS}")

    def restart(self) -> None:
        self._say("saved again: starting over")

    def unchanged(self, saved: tuple[str, ...]) -> None:
        self._at = self._clock()
        self._say(f"{self._saved_text(saved)}: nothing has changed … {ENDS}")

    def end(self, outcome: WatchedResult, saved: tuple[str, ...]) -> None:
        result = outcome.result
        if self._console.is_terminal and self._ended:
            self._console.clear()
        self._ended = True
        if result.error is not None:
            self._emit([Text(f"Could not be graded: {self._show(result.error.message)}", "red")])
            if result.error.hint:
                hint = Text(f"hint: {self._show(result.error.hint)}", "dim")
                self._emit([Padding(hint, (0, 0, 0, INDENT))])
        elif self._last is None:
            Terminal(self._console).report(result, self._rubric, hidden=self._hidden, unrun=self._unrun)
        else:
            self._emit(self._short(result, self._last))
        self._last = result if result.error is None else self._last
        self._say(f"{self._saved_text(saved)} … {ENDS}" if saved else ENDS)

    def _short(self, result: GradingResult, before: GradingResult) -> Iterable[RenderableType]:
        view = arrange(result, self._rubric)
        lost = number(sum(loss.points for loss in view.lost))
        yield Text.assemble(
            (points_line(result, view), "bold"), f", {lost} lost" if view.lost else ", nothing lost"
        )
        changed = compare(before, result)
        for words, criteria in changed.items():
            names = ", ".join(f"{self._show(c.id, NAME_CHARS)} {points_of(c)}" for c in criteria)
            yield Text(f"{words}: {names}", CHANGES[words])
        if not changed:
            yield Text("as before", "dim")
        if view.open:
            yield from Terminal(self._console).still_open(view.open, self._unrun)
        yield from Terminal(self._console).losses(TO_FIX, view.lost)

    def _saved_text(self, saved: tuple[str, ...]) -> str:
        """Return `saved src/talker.py at 12:03:04`."""
        names = first_few([self._show(name, NAME_CHARS) for name in saved], NAMES_SHOWN)
        return f"saved {names} at {self._at:%H:%M:%S}"

    def _say(self, words: str) -> None:
        text = self._show(f"Watching {self._package} {DASH} {words}", 3 * TEXT_CHARS)
        if self._console.is_terminal:
            self._emit([Text(f"\n{text}", "cyan")])
        else:
            self._console.file.write(f"{text}\n")
            self._console.file.flush()

    def _emit(self, parts: Iterable[RenderableType]) -> None:
        emit(self._console, parts)
        self._console.file.flush()

    def _show(self, text: str, limit: int = TEXT_CHARS) -> str:
        return fit_encoding(line(text, limit), self._console.encoding)


class JsonLines(Screen):
    """Prints each result as a JSON document on a line of its own, and nothing else."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def end(self, outcome: WatchedResult, _saved: tuple[str, ...]) -> None:
        ascii_only = (self._stream.encoding or "ascii").lower().replace("-", "") != "utf8"
        # the document is indented for readers; no text in JSON holds a raw line end
        rows = result_text(outcome.result, ascii_only=ascii_only).split("\n")
        self._stream.write(f"{' '.join(row.strip() for row in rows).strip()}\n")
        self._stream.flush()


def compare(before: GradingResult, after: GradingResult) -> dict[str, list[CriterionResult]]:
    """Return the criteria worth points that are better or worse than before, under the words of `CHANGES`."""
    earlier = {c.id: c for c in before.criteria}
    found: dict[str, list[CriterionResult]] = {words: [] for words in CHANGES}
    for criterion in after.criteria:
        if criterion.id in earlier and criterion.counts:
            words = _change(earlier[criterion.id], criterion)
            if words:
                found[words].append(criterion)
    return {words: criteria for words, criteria in found.items() if criteria}


def _change(before: CriterionResult, after: CriterionResult) -> str:
    if after.status.is_retryable:
        return "" if before.status.is_retryable else "no longer judged"
    had, has = before.status is Status.PASS, after.status is Status.PASS
    if has != had:
        return "now reached" if has else "now lost"
    if after.points == before.points:
        return ""
    return "better" if after.points > before.points else "worse"
