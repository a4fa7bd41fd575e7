"""The scripts of `ci/gitlab.yml`, run as GitLab's runner runs them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from lxml import etree

from tests.integrations.conftest import handed_in
from tests.integrations.gitlab import JOB, variables_of
from tests.integrations.runner import ROOT, SYSTEM_PATH, grader, version

ALL, MOST = {"GRADER_PASS_MARK": "100%"}, {"GRADER_PASS_MARK": "80%"}


@dataclass(kw_only=True)
class Job:
    """A job of a project in `folder`. `code` is None until it has run."""

    folder: Path
    path: str
    more: dict[str, str] = field(default_factory=dict)
    code: int | None = None
    log: str = ""

    @property
    def project(self) -> Path:
        return self.folder / "builds" / "my lab"

    @property
    def results(self) -> Path:
        return self.project / "grader-results"

    def run(self, **given: str) -> Job:
        """With these variables of the including file. before_script and script are one shell, after_script its own."""
        told = (
            variables_of(str(self.project), **given)
            | {"HOME": str(self.folder), "PATH": self.path}
            | self.more
        )
        self.code = self._shell([*JOB["before_script"], *JOB["script"]], told)
        self._shell(JOB["after_script"], told)
        return self

    def _shell(self, lines: list[str], variables: dict[str, str]) -> int:
        done = subprocess.run(
            ["/bin/bash", "-c", "set -eo pipefail\nset +o noclobber\n" + "\n".join(lines)],
            env=variables,
            cwd=self.project,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        self.log += done.stdout.decode(errors="replace")
        return done.returncode


@pytest.fixture
def job(tmp_path) -> Job:
    """In an image that has the grader, and no ROS."""
    (tmp_path / "image").mkdir()
    (tmp_path / "image" / "grader").symlink_to(grader())
    made = Job(folder=tmp_path, path=f"{tmp_path}/image:{SYSTEM_PATH}")
    made.more = {"GRADER_ROS_SETUP": "none", "PYTHONDONTWRITEBYTECODE": "1"}
    made.project.mkdir(parents=True)
    return made


@pytest.mark.full
def test_every_report_is_where_gitlab_looks_for_it(job):
    package = handed_in(job.project, ".")
    (package / "src" / "numeric_talker.py").chmod(0o644)
    job.run(GRADER_STATIC="true", GRADER_LAB="leeds-comp3631-lab1")
    assert job.code == 1, job.log
    named = JOB["artifacts"]["reports"]
    assert JOB["artifacts"]["when"] == "always"
    assert all((job.project / path).is_file() for path in named.values())
    suite = etree.parse(job.project / named["junit"]).getroot()
    assert suite.get("failures") == "1"
    (issue,) = json.loads((job.project / named["codequality"]).read_text())
    assert issue["location"]["path"] == "src/numeric_talker.py"
    assert re.fullmatch(r"[0-9a-f]{64}", issue["fingerprint"])
    assert (job.project / named["dotenv"]).read_text().splitlines() == [
        "GRADER_POINTS=15",
        "GRADER_MAX_POINTS=20",
        "GRADER_STATUS=below-pass-mark",
        "GRADER_RUBRIC_ORIGIN=grader",
    ]
    assert (job.project / JOB["artifacts"]["paths"][0] / "report.html").is_file()


@pytest.mark.full
def test_a_package_without_mistakes_passes(job):
    handed_in(job.project, "src/lab1")
    assert job.run(GRADER_STATIC="true", **ALL).code == 0, job.log
    assert job.log.rstrip().endswith("sandbox: nothing was run")


@pytest.mark.full
def test_what_could_not_be_judged_is_a_warning(job):
    handed_in(job.project)
    assert job.run().code in JOB["allow_failure"]["exit_codes"], job.log
    assert "this costs no marks" in job.log


@pytest.mark.full
@pytest.mark.parametrize(
    "given", [{"GRADER_LAB": "leeds"}, {"GRADER_PASS_MARK": "1000"}, {"GRADER_PATH": "nowhere"}]
)
def test_wrong_variables(job, given):
    handed_in(job.project)
    assert job.run(GRADER_STATIC="true", **given).code == 2, job.log
    assert "grader: error: " in job.log
    assert (job.results / "grader.env").read_text() == "GRADER_STATUS=wrong-input\n"


@pytest.mark.full
def test_results_that_were_handed_in_are_not_kept(job):
    handed_in(job.project)
    (job.results / "evidence").mkdir(parents=True)
    (job.results / "report.html").write_text("100 of 100 points")
    (job.results / "mine").symlink_to("/etc/passwd")
    job.run(GRADER_STATIC="true", GRADER_LAB="no-such-lab")
    assert job.code == 2
    assert not (job.results / "report.html").exists()
    assert not (job.results / "mine").exists()


@pytest.mark.full
def test_what_is_cached_is_no_part_of_the_submission(job):
    handed_in(job.project, ".")
    cache = job.project / ".grader-cache" / "pip"
    cache.mkdir(parents=True)
    (cache / "wheel").write_text("w" * 1000)
    without = job.run(GRADER_STATIC="true")
    digest = json.loads((job.results / "result.json").read_text())["submission"]["digest"]
    assert (cache / "wheel").is_file(), "it is there again for GitLab to keep"
    shutil.rmtree(job.project / ".grader-cache")
    without.run(GRADER_STATIC="true")
    assert json.loads((job.results / "result.json").read_text())["submission"]["digest"] == digest


@pytest.mark.full
def test_a_cache_that_was_handed_in_is_not_used(job):
    """What pip would install from it would do the grading."""
    handed_in(job.project, ".")
    poison = job.project / ".grader-cache" / "pip" / "wheel"
    poison.parent.mkdir(parents=True)
    poison.write_text("a grader that gives full marks")
    for words in (["init", "-q"], ["add", "--force", "."]):
        subprocess.run(["/usr/bin/git", "-C", str(job.project), *words], check=True, capture_output=True)
    job.run(GRADER_STATIC="true")
    assert "it is not used" in job.log
    assert not list(job.folder.glob("builds/**/wheel"))


def test_an_image_without_the_grader_has_to_be_told_where_it_is(job):
    job.path = SYSTEM_PATH
    handed_in(job.project)
    assert job.run(GRADER_STATIC="true").code == 2
    assert "GRADER_REPOSITORY is empty" in job.log


@pytest.mark.full
def test_the_grader_is_fetched_at_the_version_that_was_asked_for(job):
    """What `ci/install.sh` does has tests of its own: here it is a stand-in in another repository."""
    job.path = SYSTEM_PATH
    handed_in(job.project)
    source = job.folder / "the grader"
    (source / "ci").mkdir(parents=True)
    install = source / "ci" / "install.sh"
    install.write_text(
        f'#!/bin/sh\nmkdir -p "$GRADER_HOME/venv/bin"; ln -s "{grader()}" "$GRADER_HOME/venv/bin/grader"\n'
        'echo "asked for: $* cache: $GRADER_CACHE"\n'
    )
    install.chmod(0o755)
    git = ["/usr/bin/git", "-C", str(source), "-c", "user.name=a", "-c", "user.email=a@b.c"]
    for words in (["init", "-q", "-b", "main"], ["add", "."], ["commit", "-qm", "v1"], ["tag", "v1"]):
        subprocess.run([*git, *words], check=True, capture_output=True)
    install.write_text("#!/bin/sh\nexit 9\n")
    subprocess.run([*git, "commit", "-qam", "v2"], check=True, capture_output=True)
    job.run(GRADER_STATIC="True", GRADER_REPOSITORY=str(source))
    assert job.code == 0, job.log
    assert f"asked for: --no-ros cache: {job.project}.grader/cache" in job.log
    assert json.loads((job.results / "result.json").read_text())["points"] == 20


def test_a_version_that_is_not_there_fails_before_anything_is_graded(job):
    job.path = SYSTEM_PATH
    job.run(GRADER_REPOSITORY=str(ROOT), GRADER_REF="v0.0.0-none")
    assert job.code not in {0, 1, 4}
    assert not job.results.exists()


PYTHON = """#!/bin/sh
case "$1" in
  -c) exit {fits} ;;
  --version) echo "Python 3.12.0" ;;
  -m) mkdir -p "$4/bin"; ln -s "{pip}" "$4/bin/python" ;;
esac
"""
PIP = """#!/bin/sh
echo "$PIP_CACHE_DIR|$*" >>"{notes}"
ln -sf "{grader}" "$(dirname "$0")/grader"
"""


def test_the_installation_is_made_once_and_kept_apart(tmp_path):
    pip, notes, folder = tmp_path / "pip", tmp_path / "notes", tmp_path / "bin"
    folder.mkdir()
    pip.write_text(PIP.format(notes=notes, grader=grader()))
    (folder / "python3").write_text(PYTHON.format(fits=0, pip=pip))
    for path in (pip, folder / "python3"):
        path.chmod(0o755)
    home = tmp_path / "a home"
    variables = {"PATH": f"{folder}:{SYSTEM_PATH}", "GRADER_HOME": str(home)}
    for _ in range(2):
        subprocess.run(
            [ROOT / "ci" / "install.sh", "--no-ros"], env=variables, check=True, capture_output=True
        )
    (row,) = notes.read_text().splitlines()
    assert row.startswith("|-m pip ")
    assert row.endswith(f" install -qq {ROOT}")
    assert (home / "installed").read_text() == version()
    assert (home / "venv" / "bin" / "grader").exists()


@pytest.mark.full
@pytest.mark.ros
def test_nodes_are_run(job):
    handed_in(job.project, ".")
    del job.more["GRADER_ROS_SETUP"]
    assert job.run(**MOST).code == 0, job.log
    assert (job.results / "evidence" / "wraps.mcap").is_file()
