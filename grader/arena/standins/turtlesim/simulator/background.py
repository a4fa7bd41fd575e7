"""The field's colour, from the parameter server."""

from .world import BACKGROUND

NAMES = ("background_r", "background_g", "background_b")


class Background:
    """`params` has `has`, `get` (None where there is none) and `set`.

    Noetic and late Melodic read the node's private parameters, releases before them those of the node's namespace.
    Here both are read: a private one that somebody has set first, then one of the namespace.
    """

    def __init__(self, params):
        self._params = params
        self._own = {}
        for name, default in zip(NAMES, BACKGROUND):
            if not params.has("~" + name):
                params.set("~" + name, default)
                self._own[name] = default

    def read(self):
        return tuple(self._component(name, default) for name, default in zip(NAMES, BACKGROUND))

    def _component(self, name, default):
        private, shared = as_integer(self._params.get("~" + name)), as_integer(self._params.get(name))
        untouched = private is None or private == self._own.get(name)
        if untouched and shared is not None:
            return shared & 0xFF
        return (default if private is None else private) & 0xFF


def as_integer(value):
    """As roscpp reads an integer parameter: a real number is rounded, all else is none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value or abs(value) > 2**31:  # noqa: PLR0124 - not a number
        return None
    return int(value // 1 + (value % 1 >= 0.5))
