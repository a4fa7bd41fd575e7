"""The files that the grader writes or reads: `FORMATS` with their versions, `schema_of` for their JSON Schemas.

The reference page on them is made by `scripts/reference/formats.py`.
"""

from grader.report.file_formats.known import FORMATS, Addition, Format
from grader.report.file_formats.schemas import schema_of

__all__ = ["FORMATS", "Addition", "Format", "schema_of"]
