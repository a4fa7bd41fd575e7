"""Text that others wrote, made harmless: shown, never obeyed. One function for each place where it is shown.

| place | function |
|---|---|
| terminal, XML, a log | `line` (one line of bounded length), `visible` (`lines=True` keeps line ends) |
| Markdown | `markdown`, `markdown_code` |
| HTML | `html` for text and quoted attributes, `html_address` for `href` |
| CSV | `csv_text` for whole tables |
| JSON | `json_text` |
| a file's name | `grader.intake.safe_name` |
"""

from grader.report.text.html import html, html_address
from grader.report.text.markdown import markdown, markdown_code
from grader.report.text.table import csv_text
from grader.untrusted_text import clip, json_text, line, text_limit, uncommanded, visible

__all__ = [
    "clip",
    "csv_text",
    "html",
    "html_address",
    "json_text",
    "line",
    "markdown",
    "markdown_code",
    "text_limit",
    "uncommanded",
    "visible",
]
