"""One line of `grader doctor`."""

from __future__ import annotations

from typing import Literal

from grader.model.record import Record


class Row(Record):
    """`missing`: grading is not fully possible. `limited`: it is, but less safely or more slowly."""

    name: str
    state: Literal["ok", "limited", "missing"]
    detail: str
    mend: str = ""
