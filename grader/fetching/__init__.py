"""How a batch gets one roster entry's source, and which commit of it counts."""

from __future__ import annotations

from grader.fetching.ahead import Prefetch, prefetch
from grader.fetching.history import NothingInTime, Rule
from grader.fetching.obtain import Obtained, obtain
from grader.fetching.patience import Patience

__all__ = ["NothingInTime", "Obtained", "Patience", "Prefetch", "Rule", "obtain", "prefetch"]
