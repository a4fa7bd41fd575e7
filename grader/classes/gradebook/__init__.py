"""A class's results as a table: for people, for programs, and as learning platforms import it."""

from grader.classes.gradebook.table import FORMS, Book, GradebookFormat, GradebookRow
from grader.classes.gradebook.write import write_gradebook

__all__ = ["FORMS", "Book", "GradebookFormat", "GradebookRow", "write_gradebook"]
