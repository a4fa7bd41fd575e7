"""The base of every record: frozen, typed, by keyword, and no key that nobody knows."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """An immutable record that can be written as JSON and read back to an equal one."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)
