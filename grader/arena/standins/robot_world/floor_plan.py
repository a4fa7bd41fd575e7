"""Walls of a world, without ROS: read from YAML and from map_server's maps.

A wall is a straight line ((x0, y0), (x1, y1)) in metres. Raises ValueError for what is no floor plan.
"""

import math
from pathlib import Path

OCCUPIED_THRESH = 0.65
PIXELS_MAX = 4000000
WALLS_MAX = 5000


def walls_of(lines, boxes):
    """The walls of `lines`, each through points [x, y], and of `boxes` [x0, y0, x1, y1], two opposite corners."""
    found = []
    for line in _items(lines, "walls"):
        points = [_point(point) for point in _items(line, "a wall")]
        found += zip(points, points[1:])  # noqa: RUF007 - pairwise is Python 3.10's
    for box in _items(boxes, "boxes"):
        x0, y0, x1, y1 = (_number(value) for value in _items(box, "a box", 4))
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        found += zip(corners, corners[1:] + corners[:1])
    if len(found) > WALLS_MAX:
        raise ValueError(f"{len(found)} walls, more than {WALLS_MAX}")
    return found


def read_plan(path, parse):
    """The walls of a YAML file: `walls` and `boxes`, or the `image` of a map. `parse` makes values of YAML's text."""
    path = Path(path)
    plan = parse(path.read_text())
    if not isinstance(plan, dict) or not {"walls", "boxes", "image"} & set(plan):
        raise ValueError(f"{path}: neither walls, boxes nor the image of a map")
    walls = walls_of(plan.get("walls", []), plan.get("boxes", []))
    if "image" in plan:
        rows = read_pgm((path.parent / str(plan["image"])).read_bytes())
        walls += map_walls(rows, plan)
    return walls


def read_pgm(data):
    """The rows of a picture, from the top, each value from 0 (black) to 1 (white)."""
    fields, place = [], 0
    while len(fields) < 4:
        place = _skip_blanks(data, place)
        end = place
        while end < len(data) and not data[end : end + 1].isspace():
            end += 1
        if end == place:
            raise ValueError("the picture is cut short")
        fields.append(data[place:end])
        place = end
    kind, (width, height, white) = fields[0], (int(field) for field in fields[1:])
    if kind not in (b"P2", b"P5") or not 0 < width * height <= PIXELS_MAX or not 0 < white < 256:
        raise ValueError("no PGM picture of 8 bits a pixel, or a larger one than four million pixels")
    values = data[place + 1 :] if kind == b"P5" else [int(field) for field in data[place:].split()]
    if len(values) < width * height:
        raise ValueError("the picture is cut short")
    return [[value / white for value in values[row * width : (row + 1) * width]] for row in range(height)]


def map_walls(rows, about):
    """The borders of what is occupied, by map_server's own rule; `about` are the keys of the map's YAML file."""
    size_m, threshold = (
        _number(about.get("resolution")),
        _number(about.get("occupied_thresh", OCCUPIED_THRESH)),
    )
    x, y, yaw = (_number(value) for value in _items(about.get("origin", [0, 0, 0]), "origin", 3))
    negate = bool(about.get("negate", 0))
    if size_m <= 0:
        raise ValueError("resolution: no length")
    full = [[(value if negate else 1 - value) > threshold for value in row] for row in reversed(rows)]
    cos, sin = math.cos(yaw), math.sin(yaw)

    def placed(column, row):
        right, up = column * size_m, row * size_m
        return x + cos * right - sin * up, y + sin * right + cos * up

    across = [(placed(a, at), placed(b, at)) for at, a, b in _borders(full)]
    upright = [
        (placed(at, a), placed(at, b)) for at, a, b in _borders([list(column) for column in zip(*full)])
    ]
    if len(across) + len(upright) > WALLS_MAX:
        raise ValueError(f"the map has more than {WALLS_MAX} walls")
    return across + upright


def _borders(full):
    """Between which rows, and from where to where, full cells meet free ones; outside of the picture all is free."""
    free = [False] * len(full[0])
    for at, (below, above) in enumerate(zip([free, *full], [*full, free])):
        start = None
        for column, differs in enumerate([a != b for a, b in zip(below, above)] + [False]):
            if differs and start is None:
                start = column
            elif not differs and start is not None:
                yield at, start, column
                start = None


def _skip_blanks(data, place):
    """Behind blanks and comments."""
    while place < len(data):
        if data[place : place + 1] == b"#":
            place = data.find(b"\n", place) + 1 or len(data)
        elif not data[place : place + 1].isspace():
            break
        else:
            place += 1
    return place


def _items(value, what, count=None):
    if not isinstance(value, (list, tuple)) or (count is not None and len(value) != count):
        raise ValueError(f"{what}: no list" + (f" of {count} numbers" if count else ""))
    return value


def _point(value):
    x, y = _items(value, "a point", 2)
    return _number(x), _number(y)


def _number(value):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{value}: no number")
    return float(value)
