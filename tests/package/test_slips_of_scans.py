"""What `lint/` finds in scripts that read a scan, in what callbacks keep, or write to a file, and in loops that end."""

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")

HELPER = """\
def get(self, degrees):
    return self.scan.ranges[int(degrees) % 360]
"""


@pytest.mark.parametrize(
    ("calls", "read"),
    [
        ("a = self.get(90)\nb = min(self.get(d) for d in range(-25, 26))\n", ["90", "-25:", ":26"]),
        ("a = self.get(90)\nb = self.get(angle)\n", []),
        ("def near(self, d):\n    return self.get(d)\na = self.near(270)\n", ["270"]),
        ("def near(self, d):\n    d += 1\n    return self.get(d)\na = self.near(270)\n", []),
        ("def near(self, d):\n    return self.get(d) + self.near(d)\n", []),
        ("", []),
    ],
)
def test_which_ranges_a_function_is_asked_for(calls: str, read: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(HELPER + calls, encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.message for s in slips if s.kind == "ranges-read"] == read


ASK = "ask whether `min(…)` of them is small, or whether any of them is"


@pytest.mark.parametrize(
    ("lines", "read"),
    [
        ("a = min(msg.ranges[0:45] + msg.ranges[-45:])", ["0:45", "-45:"]),
        ("r = msg.ranges; n = len(r); print(r[90], r[:3])", ["90", ":3"]),
        ("print(msg.ranges[0], min(msg.ranges))", []),
        ("print(msg.ranges[n], msg.ranges[0])", []),
        ("r = msg.ranges; print(nearest(r), r[0])", []),
        ("print(msg.ranges[::2])", []),
        ("r = [min(one, 9) for one in msg.ranges]; print(r[0], r[5:9])", ["0", "5:9"]),
        ("r = [one for one in msg.ranges if one]; print(r[0], r[5:9])", []),
        ("r = np.array(msg.ranges); print(r[:3])", [":3"]),
        ("print(msg.ranges[len(msg.ranges) // 2])", ["n//2"]),
        ("m = int(len(msg.ranges) / 2); print(msg.ranges[m - 45:m + 45])", ["n//2-45:n//2+45"]),
        ("n = len(msg.ranges) - 1; print(msg.ranges[3 * n // 4], msg.ranges[n])", []),
        ("if msg.ranges: print(msg.ranges[len(msg.ranges) * 3 // 4 + 1])", ["n*3//4+1"]),
        ("i = 3; i = i + 1; print(msg.ranges[i])", []),
        ("for i in range(9): print(msg.ranges[i])", ["0:9"]),
        ("print([msg.ranges[i] for i in range(-9, 10)])", ["-9:", ":10"]),
        ("print(min(msg.ranges[d % 360] for d in [0, 90, -5]))", ["0", "90", "-5"]),
        ("for i in range(len(msg.ranges)): print(msg.ranges[i])", []),
        ("for i in range(0, 90, 5): print(msg.ranges[i])", []),
    ],
)
def test_which_ranges_of_a_scan_are_read(lines: str, read: list[str], tmp_path: Path) -> None:
    text = f"def heard(msg):\n    {lines}\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.message for s in slips if s.kind == "ranges-read"] == read


@pytest.mark.parametrize(
    ("lines", "fixes"),
    [
        ("far = sum(near) / len(near)", ["on line 2, write `min(near)` in its place"]),
        ("far = sum(near) / len(near)\nfirst = min(near)", []),
        ("if max(msg.ranges) < 0.5: stop()", ["on line 2, write `min` for `max`"]),
        ("far = max(msg.ranges[:9])\nif far < 0.5: stop()", ["on line 2, write `min` for `max`"]),
        ("if max(msg.ranges) > 3: go()", []),
        (
            "a = [r for r in near if r]\nd = max(a) if a else 9\nif d < 0.5: print(min(a))",
            ["on line 3, write `min` for `max`"],
        ),
        ("for r in near:\n    if r > 0.5:\n        wall = False", [f"on line 3, {ASK}"]),
        ("if any(r > NEAR for r in near): go()", [f"on line 2, {ASK}"]),
        ("if all([r < 0.5 for r in near]): stop()", [f"on line 2, {ASK}"]),
        ("if all(r > 0.5 for r in near): go()", []),
        ("if any(r < 0.5 for r in near): stop()", []),
        ("for r in near:\n    if r < 0.5:\n        wall = True", []),
        ("for r in near:\n    if r > far:\n        far = r", []),
        ("for r in near:\n    if r > 0.5:\n        free = True\nif min(near) < 0.5: stop()", []),
    ],
)
def test_the_mean_of_ranges(lines: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"near = msg.ranges[:9]\n{lines}\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.fix for s in slips if s.name == "mean"] == fixes


KEPT = """\
class Stop:
    def __init__(self):
        self.stopped = False
        self.cmd = Twist()
        self.cmd.linear.x = 0.2
    def heard(self, msg):
        if min(msg.ranges) < 0.5:
            SET
        OTHER
        if self.stopped:
            self.pub.publish(Twist())
        else:
            self.pub.publish(self.cmd)
"""


@pytest.mark.parametrize(
    ("given", "other", "fixes"),
    [
        (
            "self.stopped = True",
            "pass",
            ["set `self.stopped` back to False in an `else` of the `if` on line 7"],
        ),
        (
            "self.cmd.linear.x = 0",
            "pass",
            ["set `self.cmd.linear.x` back to 0.2 in an `else` of the `if` on line 7"],
        ),
        ("pass", "self.stopped = len(msg.ranges) > 0", []),
        ("self.stopped = True", "self.stopped = self.stopped and near", []),
        ("self.stopped = True", "if free: self.stopped = False", []),
        ("self.cmd.linear.x = 0", "self.cmd = Twist()", []),
        ("self.cmd.linear.x = 0.1", "pass", []),
        ("self.cmd.angular.z = 1", "pass", []),
    ],
)
def test_what_nothing_sets_back(given: str, other: str, fixes: list[str], tmp_path: Path) -> None:
    text = KEPT.replace("SET", given).replace("OTHER", other)
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "stuck"] == fixes


@pytest.mark.parametrize(
    "text",
    [
        "started = False\ndef heard(msg):\n    global started\n    if not started:\n        started = True\n",
        "near = False\ndef heard(msg):\n    if msg.data:\n        near = True\n    if near:\n        stop()\n",
        "while go:\n    near = False\n    if wall:\n        near = True\n    if near:\n        stop()\n",
        "v = Twist()\nv.linear.x = 1\nwhile a:\n    v.linear.x = 1\n    if b: v.linear.x = 0\n    p.publish(v)",
    ],
)  # fmt: skip
def test_what_need_not_be_set_back(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert not [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "stuck"]


TURNED = """\
front = msg.ranges[:45]
d = min(front)
if TEST:
    cmd.linear.x = 0.2
else:
    cmd.linear.x = 0
    cmd.angular.z = 0.5
"""


@pytest.mark.parametrize(
    ("test", "fixes"),
    [
        ("d < 0.5", ["on line 3, write `>` in place of `<`, or swap the two branches"]),
        ("min(front) <= NEAR", ["on line 3, write `>` in place of `<`, or swap the two branches"]),
        ("d > 0.5", []),
        ("speed < 0.5", []),
        ("d < 0.5 and free", []),
    ],
)
def test_conditions_that_are_the_wrong_way_round(test: str, fixes: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(TURNED.replace("TEST", test), encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "turned"] == fixes


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("for r in msg.ranges:\n    if r == float('inf'):\n        r = 0\n    a.append(r)\n", [3]),
        ("def at(i):\n    r = msg.ranges[i]\n    if math.isinf(r):\n        return 0.0\n    return r\n", [4]),
        ("a = [0 if r >= msg.range_max else r for r in msg.ranges]\n", [1]),
        ("a = np.array(msg.ranges)\na[np.isinf(a)] = 0\n", [2]),
        ("a = [0 if math.isinf(r) else r for r in msg.ranges]\nb = [r for r in a if r > 0]\n", []),
        ("a = [10 if math.isinf(r) else r for r in msg.ranges]\n", []),
        ("a = [r if math.isinf(r) else 0 for r in msg.ranges]\n", []),
        ("a = [0 if r < msg.range_max else r for r in msg.ranges]\n", []),
        ("if math.isinf(x):\n    x = 0\n", []),
        ("def turn(r):\n    if math.isinf(r):\n        return 0\n    return 2 * r\nprint(msg.ranges)\n", []),
        ("r = msg.ranges[0]\nif math.isinf(r) or math.isnan(r):\n    r = 0\n", [3]),
        ("r = msg.ranges[0]\nif math.isinf(r):\n    turn = 0\n", []),
    ],
)
def test_inf_that_is_made_0(text: str, lines: list[int], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.line for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "inf"] == lines


@pytest.mark.parametrize(
    ("index", "found"),
    [
        ("int(math.radians(90))", True),
        ("int(math.radians(d) % (2 * math.pi))", True),
        ("int(math.pi / 2)", True),
        ("int(math.radians(90) / msg.angle_increment)", False),
        ("int((math.pi / 2 - msg.angle_min) / step)", False),
        ("int(math.degrees(math.pi / 2))", False),
        ("int(math.pi / 2 * 57.3)", False),
        ("90", False),
    ],
)
def test_angles_that_are_taken_for_indexes(index: str, found: bool, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"d = 9\nr = msg.ranges[{index}]\n", encoding="utf-8")
    assert any(s.name == "angle" for s in check_syntax(tmp_path, ["a.py"]).slips) is found


@pytest.mark.parametrize(
    ("lines", "fixes"),
    [
        ("with open('a.csv', 'w') as f: f.write(str(m.data))", ["on line 3, write 'a' in place of 'w'"]),
        (
            "f = open('a.csv', mode='w+'); csv.writer(f).writerow([m.data])",
            ["on line 3, write 'a' in place of 'w'"],
        ),
        ("with open('a.csv', 'a') as f: f.write(str(m.data))", []),
        ("with open('a.csv') as f: print(f.read())", []),
        ("with open('a.csv', 'w') as f: csv.writer(f).writerows(rows)", []),
    ],
)
def test_files_that_each_call_empties(lines: str, fixes: list[str], tmp_path: Path) -> None:
    text = f"rospy.Subscriber('/steps', Float64, heard)\ndef heard(m):\n    {lines}\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "emptied"] == fixes


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("f = open('a.csv', 'w')\nf.write('x\\n')", True),
        ("with open('a.csv', 'w') as f:\n    f.write('x\\n')\n    rospy.spin()", True),
        ("with open('a.csv', 'w') as f:\n    f.write('x\\n')", False),
        ("f = open('a.csv', 'w')\nf.write('x\\n')\nf.close()", False),
        ("f = open('a.csv', 'w')\nf.write('x\\n')\nf.flush()", False),
        ("f = open('a.csv')", False),
        ("f = open('b.csv', 'w')", False),
    ],
)
def test_files_that_are_open_elsewhere_too(lines: str, told: bool, tmp_path: Path) -> None:
    callback = "def heard(m):\n    with open('a.csv', 'w') as f: f.write(str(m.data))"
    text = f"rospy.Subscriber('/steps', Float64, heard)\n{callback}\n{lines}\n"
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    [fix] = [s.fix for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "emptied"]
    assert ("`flush()` of the file that line 4 opens" in fix) is told


AIM = "give `self.aim` its value in the callback that has to"
CALLBACKS = """\
goal, near = None, 0
far = 9.0
def heard(msg):
    global goal, far
    %s
class Driver:
    def __init__(self):
        self.goal, self.on = None, False
        self.on = False
        self.aim = None
    def heard(self, msg):
        %s
    def step(self):
        %s
        pub.publish(goal, far)
"""


@pytest.mark.parametrize(
    ("plain", "method", "test", "fixes"),
    [
        ("pass", "self.aim = msg", "", ["below line 4, write `far = msg`"]),
        ("goal = msg", "self.aim = msg", "", ["below line 4, write `far = …`"]),
        ("goal, far = msg.a, msg.b", "self.aim = msg", "", []),
        ("print(goal, far)", "self.aim = msg", "", []),
        ("far = msg", "self.x = 1", "if self.aim is None: return", [AIM]),
        ("far = msg", "self.x = 1", "if not self.aim or self.x: return", [AIM]),
        ("far = msg", "self.x = 1", "if self.aim and self.x: pub.publish(1)", [AIM]),
        ("far = msg", "self.aim = msg", "if self.aim is None: return", []),
        ("far = msg", "self.x = 1", "if self.aim is None: pub.publish(1)", []),
        ("far = msg", "self.x = 1", "if self.aim: print(1)", []),
        ("far = msg", "driver.aim = 1", "if not self.aim: return", []),
    ],
)  # fmt: skip
def test_what_a_callback_never_gives_a_value(
    plain: str, method: str, test: str, fixes: list[str], tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(CALLBACKS % (plain, method, test), encoding="utf-8")
    slips = check_syntax(tmp_path, ["a.py"]).slips
    assert [s.fix for s in slips if s.kind == "wrong-value" and "value" in s.message] == fixes


UNSET = """\
from nav_msgs.msg import OccupancyGrid
import nav_msgs.msg as nav
class Mapper:
    def __init__(self):
        self.grid = OccupancyGrid()
        self.grid.info.width = 4
        self.grid.data = [0] * 12
    def mark(self, point):
        row = point.y / self.grid.info.resolution
        self.grid.data[int(row)] = 100
"""


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        (("", ""), [("self.grid.info.resolution", 9, 6)]),
        (("/ self.grid.info.resolution", "* 2 if point.x < self.grid.info.height else 0"),
         [("self.grid.info.height", 9, 6)]),
        (("= OccupancyGrid()", "= nav.OccupancyGrid()"), [("self.grid.info.resolution", 9, 6)]),
        (("        self.grid.info.width = 4\n", ""), [("self.grid.info.resolution", 8, 5)]),
        (("width = 4", "resolution = 4"), []),
        (("info.width = 4", "info = info"), []),
        (("        self.grid.info.width = 4\n", "        fill(self.grid.info)\n"), []),
        (("        self.grid.info.width = 4\n", "        fill(self.grid)\n"), []),
        (("self.grid.info.width = 4", "info = self.grid.info; info.resolution = 4"), []),
        (("= OccupancyGrid()", "= OccupancyGrid(info=info)"), []),
        (("= OccupancyGrid()", "= Own()"), []),
        (("    def mark", "    def keep(self, grid):\n        self.grid = grid\n    def mark"), []),
        (("row = point.y / ", "print("), []),
    ],
)  # fmt: skip
def test_a_field_that_no_line_gives_a_value_is_known_where_it_is_calculated_with(tmp_path, changed, found):
    (tmp_path / "a.py").write_text(
        UNSET.replace(*changed).replace("print(self.grid.info.resolution", "print(1")
    )
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "new-field"]
    assert [(s.message.split("`")[1], s.line) for s in slips] == [(name, line) for name, line, _ in found]
    assert [s.fix for s in slips] == [f"below line {line}, write `{name} = …`" for name, _, line in found]


def test_a_word_of_python_that_is_misspelt_is_no_variable(tmp_path):
    (tmp_path / "a.py").write_text("def f(msg):\n    if msg.data:\n        retturn\n    print(msg.data)\n")
    (slip,) = [one for one in check_syntax(tmp_path, ["a.py"]).slips if one.name == "retturn"]
    assert (slip.kind, slip.line, slip.message) == ("misspelt", 3, "did you mean return?")


@pytest.mark.parametrize(
    ("asked", "ends"),
    [
        ("n < 9", "after a fixed number of rounds"),
        ("not rospy.is_shutdown() and n < 9", "after a fixed number of rounds"),
        ("not rospy.is_shutdown() and rospy.get_time() - start < 9", "after a fixed time"),
        ("rospy.Time.now() < end", "after a fixed time"),
    ],
)
def test_when_a_loop_ends_that_does_not_wait_for_the_nodes_end(tmp_path, asked, ends):
    text = f"import rospy\nrospy.init_node('a')\nn = 0\nwhile {asked}:\n    pub.publish(n)\n    n += 1\n"
    (tmp_path / "a.py").write_text(text)
    (slip,) = [one for one in check_syntax(tmp_path, ["a.py"]).slips if one.kind == "loop-left"]
    assert (slip.line, slip.message) == (4, f"the loop on line 4 ends {ends}")


@pytest.mark.parametrize(
    ("below", "found"),
    [
        (
            "pub.publish(1)\nrate.sleep()\n",
            [(4, "write `while not rospy.is_shutdown():` above line 4, and begin lines 4 to 5")],
        ),
        (
            "pub.publish(1)\nrate.sleep()\nrospy.spin()\n",
            [(4, "publish in a loop `while not rospy.is_shutdown():` that ends")],
        ),
        ("rate.sleep()\npub.publish(1)\n", []),
        ("while not rospy.is_shutdown():\n    pub.publish(1)\n    rate.sleep()\n", []),
        ("rospy.Timer(rospy.Duration(1), f)\npub.publish(1)\nrate.sleep()\n", []),
    ],
)
def test_a_loop_that_is_missing_around_a_publish_and_its_pause(tmp_path, below, found):
    (tmp_path / "a.py").write_text(f"import rospy\nrospy.init_node('a')\nrate = rospy.Rate(1)\n{below}")
    slips = [one for one in check_syntax(tmp_path, ["a.py"]).slips if one.kind == "loop-left"]
    assert [(one.line, one.fix.partition(" with")[0]) for one in slips] == found


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("distance = (a - b) ** 2 + (c - d) ** 2\n", [1]),
        ("def dist(a, b):\n    return pow(a, 2) + pow(b, 2)\n", [2]),
        ("distance = ((a - b) ** 2 + (c - d) ** 2) ** 0.5\n", []),
        ("distance = sqrt((a - b) ** 2 + (c - d) ** 2)\n", []),
        ("dist_sq = (a - b) ** 2 + (c - d) ** 2\n", []),
        ("d2 = (a - b) ** 2 + (c - d) ** 2\n", []),
        ("dist = (a - b) ** 2 + (c - d) ** 2\nif math.sqrt(dist) < 1:\n    stop()\n", []),
        ("dist = (a - b) ** 2 + (c - d) ** 2\nif dist < near ** 2:\n    stop()\n", []),
        ("dist = (a - b) ** 2 + (c - d) ** 2\nif dist < near * near:\n    stop()\n", []),
        ("def dist(a, b):\n    return a ** 2 + b ** 2\nfar = self.dist(1, 2) ** 0.5\n", []),
        ("dist = (a - b) ** 2 + (c - d) ** 2\nif dist < near:\n    stop()\n", [1]),
        ("dist = (a - b) ** 2 + (c - d) ** 2\nif dist < least:\n    least = dist\n", []),
        ("distance = a + b\n", []),
        ("d = abs(math.sqrt((a - b) ** 2) - ((c - d) ** 2))\n", [1]),
        ("d = sqrt(a ** 2) + c\n", []),
        ("d = math.sqrt((a - b) * 2 - (c - d) * 2)\n", [1]),
        ("d = math.sqrt((a - b) * 2 + c)\nd = math.sqrt(a * 2 + b * 2)\n", []),
    ],
)
def test_distances_without_a_root(text: str, lines: list[int], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert [s.line for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "rootless"] == lines


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("a = atan2(goal.x - p.x, goal.y - p.y)\n", ["swapped"]),
        ("dx = goal.x - p.x\ndy = goal.y - p.y\na = math.atan2(dx, dy)\n", ["swapped"]),
        ("a = atan2(goal.y - p.y, goal.x - p.x)\n", []),
        ("a = math.atan2(p.y - goal.y, p.x - goal.x)\n", []),
        ("a = math.atan2(goal.y - p.y, p.x - goal.x)\n", ["turned"]),
        ("dx, dy = x - goal_x, goal_y - y\na = atan2(dy, dx)\n", ["turned"]),
        ("bearing = atan2(goal.x - p.x, goal.y - p.y)\n", []),
        ("bearing = atan2(goal.x - p.x, goal.y - p.y) - p.theta\n", ["swapped"]),
        ("a = math.pi / 2 - atan2(goal.x - p.x, goal.y - p.y)\n", []),
        ("a = degrees(atan2(goal.x - p.x, goal.y - p.y))\nb = 90 - a\n", []),
        ("dx = goal.x - p.y\n", ["mixed"]),
        ("e = self.target_y - self.pose.x\n", ["mixed"]),
        ("slope = p.x - p.y\n", []),
        ("a = math.atan2(cos(e), sin(e))\n", ["swapped"]),
        ("a = math.atan2(sin(e - 1), sin(e - 1))\n", ["swapped"]),
        ("a = math.atan2(cos(e), sin(f))\n", []),
        ("def f(m):\n    self.x = m.x\n    self.y = m.x\n", ["mixed"]),
        ("def f(m):\n    self.x, self.y = m.y, m.x\n", []),
        ("y = 0\ndef f(m):\n    global x, y\n    x = m.x\nprint(x, y)\n", ["", "mixed"]),
        ("y = read()\ndef f(m):\n    global x, y\n    x = m.x\nprint(x, y)\n", []),
        ("y = 0\ndef f(m):\n    global x\n    x = m.x\nprint(x)\n", []),
        ("if abs(e) > -0.1:\n    turn()\n", ["negative"]),
        ("near = min(msg.ranges[:9])\nif near < 0 or far < 0:\n    turn()\n", [""]),
        ("near = min(msg.ranges[:9])\nif near > 0 and far < 0:\n    turn()\n", []),
        ("if abs(e) > 0:\n    turn()\n", []),
        ("e = theta - atan2(dy, dx)\nv.angular.z = 2 * e\n", ["swapped"]),
        ("a = math.atan2(sin(e), cos(e))\n", []),
        ("res = rospy.get_param('~resolution')\nc = int(p.x * resolution)\n", ["times"]),
        ("c = math.floor((p.x - x0) * info.resolution)\n", ["times"]),
        ("x = column * resolution\nc = int(p.x / resolution)\n", []),
        ("e = p.theta - atan2(dy, dx)\nv.angular.z = 2 * e\n", ["swapped"]),
        ("goal = atan2(dy, dx)\nv.angular.z = K * norm(p.theta - goal)\n", []),
        ("goal = atan2(dy, dx)\ne = norm(p.theta - goal)\nv.angular.z = K * e\n", ["swapped"]),
        ("e = p.theta - atan2(dy, dx)\nv.angular.z = -2 * e\n", []),
        ("K = -2\ne = p.theta - atan2(dy, dx)\nv.angular.z = K * e\n", []),
        ("e = p.theta - atan2(dy, dx)\nv.angular.z = 1 if e < 0 else 0\n", []),
        ("e = abs(p.theta - atan2(dy, dx))\nif e > 1:\n    v.angular.z = 1\n", []),
        ("e = degrees(atan2(dy, dx)) - self.pose.theta\n", ["mixed"]),
        ("self.theta = degrees(yaw)\ne = degrees(atan2(dy, dx)) - self.theta\n", []),
        ("e = p.theta - atan2(dy, dx)\nv.angular.z = pid(e)\n", []),
        ("K = get_param('~k', -1)\ne = p.theta - atan2(dy, dx)\nv.angular.z = K * e\n", []),
        ("pitch = atan2(a.x, sqrt(a.y ** 2 + a.z ** 2))\n", []),
        ("resolution = 1 / info.resolution\nc = int(p.x * resolution)\n", []),
        ("e = degrees(atan2(dy, dx)) - degrees(self.pose.theta)\n", []),
        ("e = degrees(atan2(dy, dx) - self.pose.theta)\n", []),
        ("def far(p):\n    return sqrt(p.x ** 2 + p.y ** 2)\nwhile self.far(p) != 0:\n    go()\n", ["exact"]),
        ("d = math.hypot(dx, dy)\nif d == 0.0:\n    stop()\n", ["exact"]),
        ("d = math.hypot(dx, dy)\nif d < 0.1 or count == 0:\n    stop()\n", []),
    ],
)
def test_angles_and_distances(text: str, names: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    assert [s.name for s in slips] == names


HEARS_SCANS = """\
class Robot:
    def __init__(self):
        self.scan = None
        rospy.Subscriber('/scan', {kind}, self.hear)
    def hear(self, msg):
        {hear}
    def go(self):
        {go}
"""
SCANS_KEPT = {
    "the-first": ("LaserScan", "if self.scan is None: self.scan = msg", "pass", 6),
    "its-ranges": (
        "LaserScan",
        "with self.lock:\n            if not self.scan: self.scan = msg.ranges",
        "pass",
        7,
    ),
    "each": ("LaserScan", "self.scan = msg", "pass", 0),
    "set-back": ("LaserScan", "if self.scan is None: self.scan = msg", "self.scan = None", 0),
    "more-of-each": (
        "LaserScan",
        "if self.scan is None: self.scan = msg\n        print(min(msg.ranges))",
        "pass",
        0,
    ),
    "only-its-form": ("LaserScan", "if self.scan is None: self.scan = msg.angle_min", "pass", 0),
    "once": ("LaserScan", "if self.scan is None: self.scan = msg; self.sub.unregister()", "pass", 0),
    "where-it-began": ("Odometry", "if self.scan is None: self.scan = msg", "pass", 0),
}


@pytest.mark.parametrize("case", SCANS_KEPT)
def test_a_callback_that_keeps_the_first_scan(case, tmp_path):
    kind, hear, go, line = SCANS_KEPT[case]
    (tmp_path / "a.py").write_text(HEARS_SCANS.format(kind=kind, hear=hear, go=go))
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "first"]
    assert [s.line for s in slips] == ([line] if line else [])


@pytest.mark.parametrize(
    ("loop", "found"),
    [
        ("for k in s:\n        print(k, d[s][k])", [(3, "on line 2, write `for k in d[s]:`")]),
        ("for k in d[s]:\n        print(k, d[s][k])", []),
        ("for k in s:\n        print(d[k])", []),
    ],
)
def test_letters_of_a_key(loop: str, found: list[tuple[int, str]], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"for s in d:\n    {loop}\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.name == "letters"]
    assert [(s.line, s.fix) for s in slips] == found
