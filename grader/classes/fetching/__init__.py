"""How a batch gets one roster entry's source, and which commit of it counts."""

from __future__ import annotations

from grader.classes.fetching.history import NothingInTime, Rule
from grader.classes.fetching.mirror import Patience
from grader.classes.fetching.obtain import Obtained, obtain

__all__ = ["NothingInTime", "Obtained", "Patience", "Rule", "obtain"]
