"""The text of the lines that a loss cites, from the files that were recorded: no reader has to look them up."""

from __future__ import annotations

from grader.evidence.run import Run
from grader.model.verdict import Citation, FileCitation, Verdict

LINE_CHARS = 200
"""A longer line stays out of the result."""


def show_lines(verdict: Verdict, build: Run) -> Verdict:
    """Return a verdict whose cited lines have their text; one that loses nothing, or cites none, stays as it is."""
    if not verdict.status.is_lost or not any(isinstance(c, FileCitation) for c in verdict.citations):
        return verdict
    cited = tuple(_with_text(citation, build) for citation in verdict.citations)
    return verdict.model_copy(update={"citations": cited})


def _with_text(citation: Citation, build: Run) -> Citation:
    if not isinstance(citation, FileCitation) or citation.line is None:
        return citation
    if citation.line == 1 and citation.column is None:
        return citation  # it stands for the whole file
    lines = build.file_lines(citation.file)
    text = lines[citation.line - 1].rstrip() if 0 < citation.line <= len(lines) else ""
    if not text.strip() or len(text) > LINE_CHARS:
        return citation
    if not citation.source:
        return citation.model_copy(update={"source": text})
    if citation.end_column is None or text.strip() != citation.source:
        return citation
    # Python prints a line without its indentation, and its carets stand below that
    indent = len(text) - len(text.lstrip())
    begin, end = (citation.column or 1) + indent, citation.end_column + indent
    return citation.model_copy(update={"source": text, "column": begin, "end_column": end})
