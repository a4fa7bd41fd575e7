"""The base of all records: frozen, typed, created by keyword, without unknown keys."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict
from typing_extensions import Self


class Record(BaseModel):
    """An immutable record that can be written as JSON and read back to an equal one."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    @classmethod
    def read_json(cls, data: bytes | str) -> Self:
        """Read what a grader wrote. Keys that only a later grader knows are ignored: without a new version of the
        format, no status and no points depend on them (docs/reference/formats.md). Raises ValidationError."""
        return cls.model_validate_json(data, extra="ignore")
