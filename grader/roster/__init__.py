"""Who handed in what: a CSV file, a folder of submissions, or an export of GitHub Classroom or GitLab."""

from grader.model.roster import Entry, Roster
from grader.roster.local import Local
from grader.roster.read import read_roster

__all__ = ["Entry", "Local", "Roster", "read_roster"]
