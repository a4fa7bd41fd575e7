"""Addresses without what opens a server."""

from __future__ import annotations

import re

_AUTHORITY = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*)://(?P<user>[^/?#]*)@")
# A colon with no port after it: a password with a slash in it, which ends where nobody can tell.
_TORN = re.compile(r"(?P<scheme>https?)://[^/?#@\[\]]*:(?!\d*(?:[/?#]|$)).*", re.IGNORECASE | re.DOTALL)


def without_password(source: str) -> str:
    """SOURCE as it may be kept and shown: of `https://` nothing before the `@` of the server (a token may stand in
    place of a user), of other schemes the user alone. What is no address stays as it is."""
    return _TORN.sub(r"\g<scheme>://…", _AUTHORITY.sub(_kept, source, count=1))


def _kept(match: re.Match[str]) -> str:
    scheme, user = match["scheme"], match["user"].split(":", 1)[0]
    web = scheme.lower() in ("http", "https")
    return f"{scheme}://" if web or not user else f"{scheme}://{user}@"
