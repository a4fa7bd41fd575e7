"""What of a package is copied, and how it is mended for running."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from grader.arena.workspace import LARGE_BYTES, needed_packages
from grader.files import read_untrusted
from grader.intake.open import open_submission
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import MANIFEST, SCRIPT, make_place, printed, run

pytestmark = pytest.mark.ros
LIST = """
import os
top = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
print(sorted(os.listdir(top)))
print(os.path.getsize(os.path.join(top, "big.bag")))
"""


def _run_node(tmp_path: Path, files: dict[str, str], *, sandbox: str = "auto") -> list[str]:
    scenario = Scenario(title="t", start=(Start(name="node", script="src/node.py"),), until=Until(limit_s=10))
    with make_place(files, sandbox=sandbox) as place:
        return printed(run(place, scenario, tmp_path / "run.mcap"))


@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_large_files_are_there_and_workspaces_inside_are_not(tmp_path: Path, sandbox: str) -> None:
    files = {
        "src/node.py": SCRIPT + LIST,
        "big.bag": "b" * (LARGE_BYTES + 1),
        "build/junk": "x",
        "devel/setup.bash": "exit 1",
    }
    listing, size = _run_node(tmp_path, files, sandbox=sandbox)
    assert listing == "['CMakeLists.txt', 'big.bag', 'package.xml', 'src']"
    assert int(size) == LARGE_BYTES + 1


@pytest.mark.full
@pytest.mark.parametrize("sandbox", ["auto", "none"])
@pytest.mark.parametrize(
    "shebang",
    [
        "#!/usr/bin/env python",
        "#!/usr/bin/env python3",
        "#!/usr/bin/python",
        "#!/usr/bin/python3",
        "#!/usr/local/bin/python -u",
        "#!/usr/bin/python2.7",
        "#!/home/me/venv/bin/python",
        "#! /usr/bin/env python\r",
        "",
    ],
)
def test_every_shebang_runs(tmp_path: Path, shebang: str, sandbox: str) -> None:
    code = f"{shebang}\nimport sys\nprint('ran', sys.version_info[0])\n"
    assert _run_node(tmp_path, {"src/node.py": code}, sandbox=sandbox) == ["ran 3"]


@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_a_browser_is_found_by_its_path_too(tmp_path: Path, sandbox: str) -> None:
    browsers = ("firefox", "/usr/bin/firefox", "/snap/bin/firefox")
    pages = [f"http://wiki.ros.org/bin/firefox/{number}" for number, _ in enumerate(browsers)]
    lines = [f"{browser} {page}\n" for browser, page in zip(browsers, pages, strict=True)]
    files = {
        "launch/open.sh": "#!/bin/sh\n" + "".join(lines),
        "src/node.py": SCRIPT
        + "import os\nos.chdir(os.path.dirname(__file__))\nos.system('sh ../launch/open.sh')\n",
    }
    scenario = Scenario(title="t", start=(Start(name="node", script="src/node.py"),), until=Until(limit_s=10))
    with make_place(files, sandbox=sandbox) as place:
        seen = run(place, scenario, tmp_path / "run.mcap")
    opened = [(e.actor, e.value) for _, e in seen.actors if e.action == "open"]
    assert opened == [("firefox", [page]) for page in pages]


def test_links_are_copied_as_links(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("marks")
    package = tmp_path / "package"
    (package / "src").mkdir(parents=True)
    (package / "leak").symlink_to(secret)
    (package / "loop").symlink_to(package)
    files = {"src/node.py": SCRIPT + "print('ran')\n"}
    with make_place(files, folder=package) as place:
        for tree in (place.workspace.repaired, place.workspace.built / "src"):
            copy = tree / place.workspace.folder
            assert (copy / "leak").is_symlink()
            assert (copy / "loop").is_symlink()


def test_untrusted_files_are_read_only_as_files(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"12345")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    os.mkfifo(tmp_path / "pipe")
    assert read_untrusted(tmp_path / "file", 3) == b"123"
    assert [read_untrusted(tmp_path / name) for name in ("link", "pipe", "none", ".")] == [None] * 4


NEEDED = {
    "manifest": ("package.xml", "<depend>other</depend>", "src/other", True),
    "include": ("launch/a.launch", '<include file="$(find other)/launch/b.launch"/>', "src/deep/other", True),
    "node": ("launch/a.launch", "<node pkg = 'other' type='a' name='a'/>", "src/other", True),
    "component": ("CMakeLists.txt", "find_package(catkin REQUIRED COMPONENTS other)", "src/other", True),
    "comment": (
        "launch/a.launch",
        '<!-- <node pkg="other"/> --> <a/> <!-- $(find other)',
        "src/other",
        False,
    ),
    "messages": ("src/a.py", "import rospy\nfrom other.msg import Level\n", "src/other", True),
    "module": ("src/a.py", "import other\n# from other.msg import Level\n", "src/other", False),
    "comment-of-cmake": ("CMakeLists.txt", "# find_package(other)", "src/other", False),
    "other-workspace": ("launch/a.launch", "<node pkg='other'/>", "old/src/other", False),
}


@pytest.mark.parametrize(("file", "text", "place", "comes"), NEEDED.values(), ids=NEEDED)
def test_what_a_package_names_of_its_workspace_comes_along(
    file: str, text: str, place: str, comes: bool, tmp_path: Path
) -> None:
    declared = text if file == "package.xml" else ""
    files = {
        "src/lab/package.xml": MANIFEST.replace("</package>", f"{declared}</package>"),
        f"{place}/package.xml": MANIFEST.replace("<name>lab<", "<name>other<"),
        **({} if file == "package.xml" else {f"src/lab/{file}": text}),
    }
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    submission = open_submission(str(tmp_path), package="lab", workdir=tmp_path / "work")
    assert [one.name for one in needed_packages(submission)] == ["lab", *(["other"] if comes else [])]
