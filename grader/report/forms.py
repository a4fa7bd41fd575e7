"""The registry of forms: every form in which one result is shown.

A new form takes
1. a file beside this one with a function that renders it, as text or bytes;
2. an entry in `_FORMS`, from which `grader report --form`, its help and the files of a submission have it;
3. its row in the table of `docs/how-to/reports.md`, in the order of `_FORMS` and in the words of its `purpose`;
4. a golden file in `tests/report/golden/`: `GRADER_REGENERATE=1 pytest tests/report/test_golden.py` writes it;
5. with `in_results`, the name of its file in `results.RESULT_FILES`, `cli.display.REPORTS` and
   `classes.review.guard.REPORTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, fields
from functools import cached_property
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the parser of the command line reads the names of forms, and must start fast
    from grader.model.figure import Figures
    from grader.model.result import GradingResult
    from grader.rubric.model import Rubric


@dataclass(frozen=True, kw_only=True)
class ReportInput:
    """What a form may be rendered from.

    `hidden` is how many criteria are left out of `result`, `prefix` the package's folder in the repository, `passed`
    whether the pass mark is reached. `docs` has the sections of each check's docstring by the check's name. `changes`
    says what has changed since the result was first published.
    `load_figures` is called only by forms that show figures, for it reads the evidence.
    """

    result: GradingResult
    rubric: Rubric
    hidden: int = 0
    prefix: str = ""
    passed: bool = False
    docs: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    changes: tuple[str, ...] = ()
    load_figures: Callable[[], Figures | None] = lambda: None

    @cached_property
    def figures(self) -> Figures | None:
        return self.load_figures()


@dataclass(frozen=True)
class Form:
    """`file` is the usual name of its file, `purpose` one line for the documentation.

    `function` is `module:function` in this package. It takes as parameters those values of `ReportInput` that it
    needs, and returns text or bytes. It is imported when first called, since templates and XML are slow to load.
    """

    name: str
    file: str
    function: str
    purpose: str
    _: KW_ONLY
    cites_lines: bool = False
    """Whether it names files by their place in the repository, for which it needs `prefix`."""
    in_results: bool = False
    """Whether every grading writes it beside `result.json`."""

    def render(self, shown: ReportInput) -> bytes:
        """Return the file's bytes, UTF-8. Raises GraderError where this result cannot be shown in this form."""
        module, _, name = self.function.partition(":")
        make = getattr(import_module(f"{__package__}.{module}"), name)
        given = {one.name for one in fields(ReportInput)} | {"figures"}
        made = make(**{key: getattr(shown, key) for key in signature(make).parameters if key in given})
        # half of a surrogate pair, as a name that is no UTF-8 becomes in Python, cannot be encoded
        return made if isinstance(made, bytes) else made.encode("utf-8", "backslashreplace")


_FORMS = (
    Form("html", "report.html", "html.page:render_html", "people: `report.html`", in_results=True),
    Form(
        "markdown",
        "report.md",
        "markdown:render_markdown",
        "a comment on a merge request, a step's summary: points and losses first, the rest folded, at most 60 kB",
        in_results=True,
    ),
    Form(
        "terminal",
        "terminal.txt",
        "terminal:render_terminal",
        "a terminal or a log, 80 columns wide if no width is known",
    ),
    Form(
        "junit",
        "junit.xml",
        "junit:render_junit",
        "test lists of GitLab, Jenkins and others; here with paths from the repository's root",
        cites_lines=True,
        in_results=True,
    ),
    Form(
        "sarif",
        "report.sarif",
        "findings:render_sarif",
        "code scanning and editors: losses that have a line in a file",
        cites_lines=True,
    ),
    Form(
        "code-quality",
        "code-quality.json",
        "findings:render_code_quality",
        "the same for GitLab's merge requests",
        cites_lines=True,
    ),
    Form(
        "annotations",
        "annotations.txt",
        "findings:render_annotations",
        "the same for GitHub: commands that a step prints",
        cites_lines=True,
    ),
    Form(
        "gradescope", "gradescope.json", "platform_results:render_gradescope", "Gradescope's `results.json`"
    ),
    Form(
        "classroom",
        "classroom.txt",
        "platform_results:render_classroom",
        "GitHub Classroom's autograding reporter: a line of base64 for its `<ID>_RESULTS`, always without "
        "hidden criteria",
        cites_lines=True,
    ),
)
FORMS: Mapping[str, Form] = {form.name: form for form in _FORMS}
