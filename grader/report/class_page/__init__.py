"""A class's results as one page (`index.html`): a table, what cost most, who shares a fault, what to run again.

pairs of (Entry, GradingResult), one by one → `lines` → counted (`points`, `costs`, `diagnoses`, `timing`), drawn
(`heat`, `histogram`) → `page`
"""

from grader.report.class_page.gather import salt_in
from grader.report.class_page.page import write_class_page

__all__ = ["salt_in", "write_class_page"]
