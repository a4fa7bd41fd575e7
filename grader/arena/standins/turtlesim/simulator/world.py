"""The turtles of one field and the picture that they draw on."""

from .canvas import Canvas
from .turtle import FIELD_M, Turtle, as_float32

BACKGROUND = (69, 86, 255)
MIDDLE_M = as_float32(FIELD_M / 2)


class World:
    """`turtles` by name. The first one is made by `reset`."""

    def __init__(self):
        self.turtles = {}
        self.canvas = Canvas(BACKGROUND)
        self._number = 0

    def spawn(self, name, x, y, theta):
        """Put a turtle on the field; an empty name becomes the next free `turtle<n>`. Raises KeyError for one that is
        taken."""
        name = name or self._free_name()
        if name in self.turtles:
            raise KeyError(name)
        self.turtles[name] = Turtle(x, y, theta)
        return name

    def kill(self, name):
        """Take a turtle off the field. Raises KeyError where there is none of that name."""
        del self.turtles[name]

    def reset(self):
        """All as in the beginning: one turtle in the middle. Its name."""
        self.turtles.clear()
        self._number = 0
        return self.spawn("", MIDDLE_M, MIDDLE_M, 0.0)

    def _free_name(self):
        while True:
            self._number += 1
            name = f"turtle{self._number}"
            if name not in self.turtles:
                return name
