"""Who handed in what: a CSV file, a folder of submissions, or an export of GitHub Classroom or GitLab."""

from grader.classes.roster.read import read_roster
from grader.classes.roster.sources import Local
from grader.model.roster import Entry, Roster

__all__ = ["Entry", "Local", "Roster", "read_roster"]
