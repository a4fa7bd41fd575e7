"""Who handed in what: a CSV file, a folder of submissions, or an export of GitHub Classroom or GitLab."""

from grader.classes.roster.local import Local
from grader.classes.roster.read import read_roster
from grader.model.batch import Entry, Roster

__all__ = ["Entry", "Local", "Roster", "read_roster"]
