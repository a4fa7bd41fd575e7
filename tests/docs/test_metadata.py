"""The files that say whose this is, under which licence, and what has changed."""

from __future__ import annotations

import re
import subprocess
import sys

import yaml

from grader import __version__
from scripts.pages import ROOT


def test_the_citation_is_valid_and_of_this_version() -> None:
    checker = (sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.citation-file-format")
    done = subprocess.run([*checker, ROOT / "CITATION.cff"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"] == __version__


def test_the_licence_is_apache_2() -> None:
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert re.search(r"Apache License\s+Version 2\.0, January 2004", text)
    assert "END OF TERMS AND CONDITIONS" in text


def test_every_version_of_the_changelog_says_what_can_change_a_verdict() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.split(r"^## \[", text, flags=re.MULTILINE)[1:]
    assert versions
    for version in versions:
        headings = re.findall(r"^### (.+)$", version, re.MULTILINE)
        assert headings[0] == "Verdicts"
        assert set(headings) <= {"Verdicts", "Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
