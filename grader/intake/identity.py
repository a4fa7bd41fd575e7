"""Who a submission is before it is opened, for one that cannot be."""

from __future__ import annotations

from pathlib import PurePath

from grader.errors import GraderError, UsageError
from grader.intake.names import archive_stem, printable, safe_name
from grader.intake.passwords import without_password
from grader.intake.source import Source, parse_source


def identify(source: str | Source, submission_id: str | None = None) -> tuple[str, str] | None:
    """The id and what may be shown of the source, as an opened submission has them; None for what is no source."""
    if isinstance(source, Source):
        return safe_name(submission_id if submission_id is not None else source.name), source.given
    try:
        parsed = parse_source(source)
        name, given = parsed.name, parsed.given
    except UsageError:
        return None
    except (GraderError, OSError, ValueError):
        name, given = archive_stem(PurePath(source).name), printable(without_password(source))
    return safe_name(submission_id if submission_id is not None else name), given
