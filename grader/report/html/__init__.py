"""The student's report as one HTML page, and the look that all pages share."""

from grader.report.html.page import Docs, html_report

__all__ = ["Docs", "html_report"]
