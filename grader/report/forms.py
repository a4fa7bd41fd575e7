"""The registry of forms: every form in which one result is shown.

A new form is one file beside this one with a function that renders it, one entry in `FORMS`, and one golden file in
`tests/report/golden`. `grader report --form`, the files of a submission, the documentation and the tests read `FORMS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the parser of the command line reads the names of forms, and must start fast
    from grader.model.figure import Figures
    from grader.model.result import GradingResult
    from grader.rubric.model import Rubric


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What a form may be rendered from.

    `hidden` is how many criteria are left out of `result`, `prefix` the package's folder in the repository, `passed`
    whether the pass mark is reached. `docs` has the sections of each check's docstring by the check's name.
    `load_figures` is called only by forms that show figures, for it reads the evidence.
    """

    result: GradingResult
    rubric: Rubric
    hidden: int = 0
    prefix: str = ""
    passed: bool = False
    docs: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    load_figures: Callable[[], Figures | None] = lambda: None

    @cached_property
    def figures(self) -> Figures | None:
        return self.load_figures()


@dataclass(frozen=True, kw_only=True)
class Form:
    """`file` is the usual name of its file, `purpose` one line for the documentation.

    `function` is `module:function` in this package. It takes as parameters those of `Shown`'s values that it needs, and
    gives text or bytes. It is imported when first called, since templates and XML are slow to load.
    """

    name: str
    file: str
    purpose: str
    function: str
    cites_lines: bool = False
    """Whether it names files by their place in the repository, for which it needs `prefix`."""
    in_results: bool = False
    """Whether every grading writes it beside `result.json`."""

    def render(self, shown: Shown) -> bytes:
        """Return the file's bytes, UTF-8. Raises GraderError where this result cannot be shown in this form."""
        module, _, name = self.function.partition(":")
        make = getattr(import_module(f"{__package__}.{module}"), name)
        given = {one.name for one in fields(Shown)} | {"figures"}
        made = make(**{key: getattr(shown, key) for key in signature(make).parameters if key in given})
        return made if isinstance(made, bytes) else made.encode("utf-8", "backslashreplace")


FORMS: Mapping[str, Form] = {
    form.name: form
    for form in (
        Form(
            name="html",
            file="report.html",
            purpose="people: `report.html`",
            function="html.page:render_html",
            in_results=True,
        ),
        Form(
            name="markdown",
            file="report.md",
            purpose="a comment on a merge request, a step's summary: points and losses first, the rest folded, "
            "at most 60 kB",
            function="markdown:render_markdown",
            in_results=True,
        ),
        Form(
            name="terminal",
            file="terminal.txt",
            purpose="a terminal or a log, 80 columns wide where no width is known",
            function="terminal:render_terminal",
        ),
        Form(
            name="junit",
            file="junit.xml",
            purpose="test lists of GitLab, Jenkins and others; here with files as the repository has them",
            function="junit:render_junit",
            cites_lines=True,
            in_results=True,
        ),
        Form(
            name="sarif",
            file="report.sarif",
            purpose="code scanning and editors: what was lost at a line of a file",
            function="sarif:render_sarif",
            cites_lines=True,
        ),
        Form(
            name="code-quality",
            file="code-quality.json",
            purpose="the same for GitLab's merge requests",
            function="code_quality:render_code_quality",
            cites_lines=True,
        ),
        Form(
            name="annotations",
            file="annotations.txt",
            purpose="the same for GitHub: commands that a step prints",
            function="annotations:render_annotations",
            cites_lines=True,
        ),
        Form(
            name="gradescope",
            file="gradescope.json",
            purpose="Gradescope's `results.json`",
            function="gradescope:render_gradescope",
        ),
        Form(
            name="classroom",
            file="classroom.txt",
            purpose="GitHub Classroom's autograding reporter: a line of base64 for its `<ID>_RESULTS`, always without "
            "hidden criteria",
            function="classroom:render_classroom",
            cites_lines=True,
        ),
    )
}
