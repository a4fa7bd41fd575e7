"""`make screenshots`: the README's pictures of a terminal, of a student's report and of a class's page.

Two faults are put into a package, a class of fixtures gets made-up names, both are graded for real (ROS and Chromium
have to be there), and `docs/images/` gets a picture of each.
"""

from __future__ import annotations

import argparse
import csv
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

from fixtures.make import declared, faulty_package
from scripts.terminal_picture import draw_terminal
from tests.browser.ground import chromium, missing
from tests.report.class_page.made_up import FIRST, LAST

ROOT = Path(__file__).resolve().parent.parent
LAB = "leeds-comp3631-lab1"
CORRECT = ROOT / "reference_solutions" / LAB
IMAGES = ROOT / "docs" / "images"
BYTES_MAX = 220_000
CLASS = 60
OFTEN = (
    "talker-not-executable",
    "listener-not-executable",
    "counter-resets-to-1",
    "chatter-5hz",
    "launch-missing",
)


def main() -> int:
    """Take the pictures."""
    parser = argparse.ArgumentParser(description="Take the pictures of the README.")
    parser.add_argument("--jobs", default="8", help="gradings side by side")
    parser.add_argument("--keep", type=Path, help="work in this folder, and leave it")
    options = parser.parse_args()
    why = missing()
    if why is not None:
        print(why, file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        IMAGES.mkdir(parents=True, exist_ok=True)
        report = _student(folder)
        _draw_check(folder / "lab1")
        page = _class(folder, options.jobs)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
            _take_report(browser, report)
            _take_class(browser, page)
    return 0


def _student(folder: Path) -> Path:
    """The report of a package that counts from 1 after its wrap, at half the rate."""
    package = folder / "lab1"
    shutil.copytree(faulty_package(LAB, "counter-resets-to-1") / "lab1", package, dirs_exist_ok=True)
    talker = package / "src" / "numeric_talker.py"
    talker.write_text(talker.read_text(encoding="utf-8").replace("Rate(10)", "Rate(5)"), encoding="utf-8")
    _grader("grade", str(package), "--rubric", LAB, "--out", str(folder / "student"))
    return folder / "student" / "lab1" / "report.html"


def _draw_check(package: Path) -> None:
    """What its student sees in a terminal."""
    program = (sys.executable, "-m", "grader", "check")
    svg = draw_terminal("grader check", program, folder=package, environment={"PYTHONPATH": str(ROOT)})
    path = IMAGES / "check.svg"
    path.write_text(svg, encoding="utf-8")
    _keep_small(path)


def _class(folder: Path, jobs: str) -> Path:
    """The page of a class in which some faults are more frequent than others."""
    chance = random.Random(4)  # noqa: S311 - the same class each time
    seldom = sorted(declared(LAB))
    roster = folder / "roster.csv"
    with roster.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["id", "source", "name", "group"])
        for number in range(CLASS):
            kind = chance.random()
            fault = chance.choice(OFTEN if kind < 0.55 else seldom)
            source = CORRECT if kind < 0.3 else faulty_package(LAB, fault)
            name = f"{chance.choice(FIRST)} {chance.choice(LAST)}"
            rows.writerow([f"sc26{number:03}", source, name, f"Group {number % 6 + 1}"])
    faulty = faulty_package(LAB, OFTEN[0]).parent
    allowed = ("--allow-local", str(CORRECT.parent), "--allow-local", str(faulty))
    _grader("batch", roster.name, *allowed, "--rubric", LAB, "--out", "class", "--jobs", jobs, within=folder)
    return folder / "class" / "index.html"


def _grader(*words: str, within: Path = ROOT) -> None:
    """Exit code 1 says that packages have faults."""
    done = subprocess.run([sys.executable, "-m", "grader", *words], cwd=within, check=False)
    if done.returncode > 1:
        raise SystemExit(f"grader {words[0]} ended with {done.returncode}")


def _take_report(browser: Browser, report: Path) -> None:
    page = _opened(browser, report, 1100, 1360)
    _save(page, "student-report.png")


def _take_class(browser: Browser, index: Path) -> None:
    page = _opened(browser, index, 1280, 1240)
    page.locator(".todo[open]").evaluate_all("all => all.forEach((one) => { one.open = false; })")
    _save(page, "class-page.png")
    page.locator("#heat").evaluate("one => one.closest('section').scrollIntoView()")
    page.locator("#heat-scroll rect.cell").nth(CLASS - 4).hover()
    _save(page, "class-heat-map.png")


def _opened(browser: Browser, path: Path, width: int, height: int) -> Page:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="light")
    page.goto(path.absolute().as_uri())
    return page


def _save(page: Page, name: str) -> None:
    path = IMAGES / name
    page.screenshot(path=path)
    _keep_small(path)


def _keep_small(path: Path) -> None:
    if path.stat().st_size > BYTES_MAX:
        raise SystemExit(f"{path} is larger than {BYTES_MAX} bytes")
    print(path)


if __name__ == "__main__":
    sys.exit(main())
