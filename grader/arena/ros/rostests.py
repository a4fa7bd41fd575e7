"""Runs the tests of a `.test` file as rostest does, in the run's own master: `rostests.py PACKAGE FILE [NAME:=VALUE…]`.

Each line on stdout is JSON: first the names of all tests, then of each `<test>` that it begins, its testcases, and how
it came to its end; or the `fault` for which nothing can be run. All that tests and nodes print goes to stderr.

Standard library and roslaunch only, Python 3.8. Nothing of a student's package is in this sandbox.
"""

import json
import os
import re
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree as ET

import roslaunch.config
import roslaunch.core
import roslaunch.launch
import roslaunch.parent
import roslaunch.rlutil

XML_BYTES_MAX = 1 << 20
CASES_MAX, MESSAGE_CHARS = 200, 400
FRAME = re.compile(r'File "([^"]+)", line (\d+)')
GTEST_PLACE = re.compile(r"(\S+\.(?:cpp|cc|cxx|h|hpp)):(\d+)$")
THROWN = "C++ exception"
UNITTEST_WORDS = re.compile(r"^\S+ (?:is not (?:true|false)|!= \S+(?: within .*? difference\))?) : ")
"""What unittest writes before a test's own message."""
DIFF = ("- ", "+ ", "? ")
CONTROLS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")
"""A message that a student sent may hold them; in XML they are not allowed."""
DOCTYPE = "<!DOCTYPE"


def main(*words):
    say = Answers()
    try:
        path, *args = roslaunch.rlutil.resolve_launch_arguments(list(words))
        config = roslaunch.config.load_config_default([(path, args)], None)
    except Exception as error:  # noqa: BLE001 - roslaunch raises many kinds
        say(fault=shorten(error))
        return
    names = [test.test_name for test in config.tests]
    twice = [name for name in names if names.count(name) > 1]
    if twice or not names:
        say(fault="two tests are named %s" % twice[0] if twice else "there is no <test> in it")
        return
    say(tests=names)
    for test in config.tests:
        run_test(test, config, path, say)


class Answers:
    """Writes lines on stdout, which is not inherited: what tests print is not among them."""

    def __init__(self):
        # What runs from here on inherits descriptor 1, which is then stderr.
        self._stdout = os.fdopen(os.dup(1), "w")
        os.dup2(2, 1)

    def __call__(self, **fields):
        self._stdout.write(json.dumps(fields) + "\n")
        self._stdout.flush()


def run_test(test, config, path, say):
    """Run it again, with new nodes, as often as its `retry` says and as long as it does not pass."""
    args = test.args
    for left in range(int(test.retry), -1, -1):
        say(test=test.test_name, end="begun")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "results.xml")
            test.args = "%s --gtest_output=xml:%s" % (args, file)
            fault = launch(test, config, path)
            cases = [] if fault else read_cases(file)
        lost = any(case["outcome"] in {"failed", "error"} for case in cases)
        if not left or not (lost or fault == "late"):
            break
    for case in cases[:CASES_MAX]:
        say(test=test.test_name, **case)
    if fault is None and not cases:
        fault = "it left no results"
    end = "late" if fault == "late" else "broken" if fault else "over"
    say(test=test.test_name, end=end, limit_s=test.time_limit, message="" if end == "late" else fault or "")


def launch(test, config, path):
    """Return why it has no results: `late`, or what could not be started; None where it has run."""
    parent = Parent(config, path)
    parent.set_up()
    try:
        _, failed = parent.runner.launch()
        if failed:
            return "%s could not be started" % failed[0]
        parent.runner.run_test(test)
    except roslaunch.launch.RLTestTimeoutException:
        return "late"
    except roslaunch.core.RLException as error:
        # Of a test that has ended with an error when roslaunch first looks: what it left says how it went.
        return None if str(error).endswith("] failed to launch") else shorten(error)
    finally:
        parent.tear_down()
    return None


class Parent(roslaunch.parent.ROSLaunchParent):
    """Launches a configuration that is loaded, as rostest's own does."""

    def __init__(self, config, path):
        super().__init__(roslaunch.core.generate_run_id(), [path], is_core=False, is_rostest=True)
        self.config = config

    def set_up(self):
        self._start_infrastructure()
        self._init_runner()
        # a student's roslaunch that starts in this moment would stop at an id that is not its own
        self.runner._check_and_set_run_id = lambda *_: None  # noqa: SLF001 - there is no other way

    def tear_down(self):
        self.runner.stop()
        self._stop_infrastructure()


def read_cases(file):
    """Return the testcases of a JUnit file, gtest's or rosunit's; none where it is not there or cannot be read."""
    try:
        with file.open("rb") as stream:
            data = stream.read(XML_BYTES_MAX + 1)
        text = CONTROLS.sub("?", data.decode("utf-8", "replace"))
        if len(data) > XML_BYTES_MAX or DOCTYPE in text.partition("<testsuite")[0]:
            return []
        root = ET.fromstring(text.encode())  # noqa: S314 - of bounded size, without entities
    except (OSError, ET.ParseError):
        return []
    cases = [read_case(case) for case in root.iter("testcase")]
    for kind, outcome in (("errors", "error"), ("failures", "failed")):
        # rosunit counts what fails in setUpClass or a subTest, and writes no testcase for it
        if int(root.get(kind) or 0) > sum(case["outcome"] in {"error", "failed"} for case in cases):
            cases.append({"case": "subTest or setUpClass", "outcome": outcome, "message": ""})
    return cases


def read_case(case):
    name = case.get("name") or ""
    found = case.find("error")
    outcome = "error"
    if found is None:
        found, outcome = case.find("failure"), "failed"
    if found is None:
        skipped = case.find("skipped") is not None or "notrun" in (case.get("status"), case.get("result"))
        return {"case": name, "outcome": "skipped" if skipped else "passed"}
    text = found.get("message") or found.text or ""
    first, _, rest = text.partition("\n")
    place = GTEST_PLACE.match(first)
    if place or first == "unknown file":
        outcome = "error" if rest.startswith(THROWN) else outcome
        frames, text = ([place.groups()] if place else []), rest
    else:
        frames = [one for one in FRAME.findall(found.text or "") if "/unittest/" not in one[0]]
        text = UNITTEST_WORDS.sub("", FRAME.split(text)[0].rstrip(), 1)
    about = {"case": name, "outcome": outcome, "message": shorten(text)}
    if outcome == "error" and found.get("type"):
        about["message"] = "%s: %s" % (found.get("type"), about["message"])
    if frames:
        about.update(file=Path(frames[-1][0]).name, line=int(frames[-1][1]))
    return about


def shorten(text):
    """Return its lines as one, of bounded length, without those in which unittest marks what differs."""
    lines = [line for line in str(text).splitlines() if line.strip() and not line.startswith(DIFF)]
    words = " ".join(line.strip() for line in lines)
    return words if len(words) <= MESSAGE_CHARS else words[: MESSAGE_CHARS - 1] + "…"


if __name__ == "__main__":
    main(*sys.argv[1:])
