"""The registry of forms in which feedback is returned.

A new form is a module beside this one with a `Sender`, an entry in `_FORMS`, from which the command line and the tests
have it, and its row in `docs/how-to/feedback.md`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from grader.errors import NotSent
from grader.untrusted_text import line

if TYPE_CHECKING:  # the parser of the command line reads the names of forms, and must start fast
    from grader.model.batch import Entry, Publication

WhenUnsure = Literal["again", "look", "ask"]
TEXT, PAGE = "report.md", "report.html"
SUBJECT_CHARS = 200
NEWLINE = "\n"


class Unsure(NotSent):
    """Nobody knows whether it was sent."""


@dataclass(frozen=True, kw_only=True)
class Feedback:
    """What one student gets: `title` is the lab's, `folder` holds the reports, `last_place` says where this form
    sent the one before."""

    entry: Entry
    publication: Publication
    name: str
    title: str
    folder: Path
    commit: str = ""
    last_place: str = ""

    @property
    def text(self) -> str:
        """The report as Markdown. Raises NotSent."""
        return self._read(TEXT).decode("utf-8", "replace")

    @property
    def page(self) -> bytes:
        """The report as one HTML file. Raises NotSent."""
        return self._read(PAGE)

    @property
    def subject(self) -> str:
        """`Lab 1: 85 of 100 points`, in one visible line. Raises NotSent."""
        return line(f"{self.title}: {self.text.partition(NEWLINE)[0].lstrip('# ')}", SUBJECT_CHARS)

    def _read(self, name: str) -> bytes:
        try:
            return (self.folder / name).read_bytes()
        except OSError as error:
            message = f"{self.folder / name}: cannot be read: {error.strerror}"
            raise NotSent(message, hint=f"grader publish DIR --only {self.entry.id}") from error


@dataclass(frozen=True, kw_only=True)
class SendSettings:
    """What the command line says. `folder` is the class's, `out` where files go, empty for a place in `folder`.
    `told` gets a line where a server is waited for."""

    folder: Path
    out: Path | None = None
    smtp: str = ""
    sender: str = ""
    branch: str = ""
    issues: bool = False
    public: bool = False
    told: Callable[[str], None] = lambda _: None


class Sender(ABC):
    """Sends by one form, within `opened`. Files appear when that ends without an exception.

    `together`: what is sent is one file, so that all of it is sent or nothing. `unsure` says what becomes of
    feedback of which it is not known whether it was sent: it is sent `again`, since that does no harm; the sender can
    `look`; or a person has to (`ask`).
    """

    together = False
    unsure: WhenUnsure = "again"

    def __init__(self, settings: SendSettings) -> None:
        self.settings = settings

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Hold what is sent through: a file, or a connection."""
        yield

    @abstractmethod
    def place(self, feedback: Feedback) -> str:
        """Return where it will go. Raises NotSent if that is not known."""

    def show(self, feedback: Feedback) -> str:
        """Return what the student will read, for `--dry-run`."""
        return feedback.text

    @abstractmethod
    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Send it and return where it went. With `look`, it may have been sent before. Raises NotSent."""


@dataclass(frozen=True)
class FeedbackForm:
    """`sender` is `module:class` in this package; `purpose` is a line for people; `takes` are its options."""

    name: str
    sender: str
    purpose: str
    takes: str

    @property
    def options(self) -> frozenset[str]:
        """Each option that it takes."""
        return frozenset(self.takes.split())

    def open(self, settings: SendSettings) -> Sender:
        """Return the sender. Raises UsageError if a setting is missing, HostError if a server cannot be reached."""
        module, _, name = self.sender.partition(":")
        made: Sender = getattr(import_module(f"{__package__}.{module}"), name)(settings)
        return made


_OF_FORGES = "a comment on the commit that was graded, or an issue"
_FORMS = (
    FeedbackForm(
        "folder",
        "files:FeedbackFolder",
        "a folder for each student, with `report.md` and `report.html`",
        "--out",
    ),
    FeedbackForm(
        "moodle",
        "files:Moodle",
        "Moodle's zip of feedback files, with `report.html` for each student",
        "--out",
    ),
    FeedbackForm(
        "canvas",
        "files:CanvasFiles",
        "Canvas' zip for re-upload: the reports under the names of the submitted files",
        "--out",
    ),
    FeedbackForm(
        "email",
        "mail:Mail",
        "a mail to each student: as files, or through a server with `--smtp`",
        "--out --smtp --from",
    ),
    FeedbackForm("git", "branch:Branch", "a branch `feedback` in each student's repository", "--branch"),
    FeedbackForm("github", "forges:GitHubComments", _OF_FORGES, "--issues --public"),
    FeedbackForm("gitlab", "forges:GitLabComments", _OF_FORGES, "--issues --public"),
)
FORMS: Mapping[str, FeedbackForm] = {form.name: form for form in _FORMS}
FORGES = tuple(form.name for form in _FORMS if "--issues" in form.options)
"""Those through which students can ask back."""
