"""Every format that the grader writes or reads: its version, what changed, its JSON Schema.

`known.FORMATS` is the list, `schemas.schema_of` gives a schema, `page.formats_page` is docs/reference/formats.md.
"""

from grader.report.formats.known import FORMATS, Addition, Change, Format
from grader.report.formats.schemas import schema_of

__all__ = ["FORMATS", "Addition", "Change", "Format", "schema_of"]
