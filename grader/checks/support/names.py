"""Names of the ROS graph as parameters of checks."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field

_ANONYMOUS = r"(_\d+_\d+)?"


def _global(name: str) -> str:
    if not name.startswith("/"):
        raise ValueError(f'a name of the graph begins with a slash: "/{name}"')
    return name


def plain_type(name: str) -> str:
    """`std_srvs/Empty`, also where another tool wrote `std_srvs/srv/Empty`."""
    return name.replace("/msg/", "/").replace("/srv/", "/")


def is_called(node: str, name: str) -> bool:
    """Whether a node has this name, given with its slash or without; an anonymous one counts."""
    return re.fullmatch(re.escape("/" + name.lstrip("/")) + _ANONYMOUS, node) is not None


GlobalName = Annotated[str, AfterValidator(_global)]
"""A topic's, a service's or a parameter's full name."""

TypeName = Annotated[str, Field(pattern=r"^[A-Za-z]\w*/[A-Za-z]\w*$")]
