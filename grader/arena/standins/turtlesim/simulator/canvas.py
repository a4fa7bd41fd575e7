"""The field's picture: what the pens drew, and what a colour sensor reads of it. Coordinates are pixels, y down."""

from math import ceil, hypot

SIZE = 500


class Canvas:
    """`SIZE` by `SIZE` pixels of (red, green, blue), each 0 to 255."""

    def __init__(self, color):
        self.fill(color)

    def fill(self, color):
        self._pixels = bytearray(bytes(color) * (SIZE * SIZE))

    def pixel(self, x, y):
        """The colour of the pixel nearest to a point; black outside."""
        column, row = int(x + 0.5), int(y + 0.5)
        if not (0 <= column < SIZE and 0 <= row < SIZE):
            return 0, 0, 0
        start = 3 * (row * SIZE + column)
        return tuple(self._pixels[start : start + 3])

    def line(self, start, end, width, color):
        """A straight stroke with square ends, `width` pixels wide; of a point, it makes a dot."""
        corners = _outline(start, end, width / 2)
        rows = [y for _, y in corners]
        for row in range(max(0, ceil(min(rows))), min(SIZE, ceil(max(rows)))):
            left, right = _span(corners, row)
            first, last = max(0, ceil(left)), min(SIZE, ceil(right))
            if first < last:
                begin = 3 * (row * SIZE + first)
                self._pixels[begin : begin + 3 * (last - first)] = bytes(color) * (last - first)


def _outline(start, end, half):
    """The corners of the rectangle that a stroke covers, in order."""
    (x0, y0), (x1, y1) = start, end
    length = hypot(x1 - x0, y1 - y0)
    along_x, along_y = (half * (x1 - x0) / length, half * (y1 - y0) / length) if length else (half, 0.0)
    return (
        (x0 - along_x - along_y, y0 - along_y + along_x),
        (x1 + along_x - along_y, y1 + along_y + along_x),
        (x1 + along_x + along_y, y1 + along_y - along_x),
        (x0 - along_x + along_y, y0 - along_y - along_x),
    )


def _span(corners, row):
    """Where a row crosses a convex outline: its first and last x."""
    crossed = []
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0])):
        if min(y0, y1) <= row <= max(y0, y1):
            crossed += [x0, x1] if y0 == y1 else [x0 + (x1 - x0) * (row - y0) / (y1 - y0)]
    return min(crossed), max(crossed)
