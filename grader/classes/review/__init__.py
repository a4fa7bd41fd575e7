"""`grader review DIR`: a web page served only on this machine, on which an instructor looks at a class and decides."""

from __future__ import annotations

from importlib.util import find_spec

from grader.errors import UsageError
from grader.installable import install_extra


def require_library() -> None:
    """Raise UsageError where the extra is not installed."""
    missing = [name for name in ("flask", "waitress") if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"reviewing a class needs packages that are not installed: {', '.join(missing)}",
            hint=install_extra("review"),
        )
