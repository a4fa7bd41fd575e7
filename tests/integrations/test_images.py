"""The files that images are made from: one list of the system's packages, in one script, and nothing that drifts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]
FILES = REPO / "grader" / "integrations" / "files"
MAKERS = [REPO / "Dockerfile", FILES / "prairielearn.Dockerfile", FILES / "gradescope-setup.sh"]
KNOWN = {
    "name", "build", "image", "remoteUser", "containerUser", "postCreateCommand", "containerEnv", "customizations",
    "features", "runArgs", "mounts", "forwardPorts", "workspaceFolder",
}  # fmt: skip
"""Properties of a development container's file, as its specification has them."""


@pytest.mark.parametrize("maker", MAKERS, ids=lambda path: path.name)
def test_no_image_has_a_list_of_packages_of_its_own(maker) -> None:
    text = maker.read_text()
    assert "--system-only" in text
    assert "apt-get install" not in text
    assert "apt install" not in text


def test_the_image_is_debian_12_and_nobody_in_it_is_root() -> None:
    text = (REPO / "Dockerfile").read_text()
    assert re.findall(r"^FROM (.*)", text, re.MULTILINE) == ["debian:12-slim"]
    assert re.findall(r"^USER (.*)", text, re.MULTILINE) == ["grader"]
    assert re.findall(r"^ENTRYPOINT (.*)", text, re.MULTILINE) == ['["grader"]']


def test_what_is_left_out_of_the_image_is_not_needed_to_install_the_grader() -> None:
    left_out = (REPO / ".dockerignore").read_text().split()
    project = (REPO / "pyproject.toml").read_text()
    included = re.search(r"build\.targets\.sdist\][^\[]*include = \[(.*?)\]", project, re.DOTALL)
    assert included
    needed = {path.strip("/").split("/")[0] for path in re.findall(r'"(/[^"]*)"', included[1])}
    assert needed >= {"grader", "rubrics", "reference_solutions", "scripts"}
    assert needed.isdisjoint(left_out)


def test_the_development_container_is_plain_json_of_known_properties() -> None:
    settings = json.loads((REPO / ".devcontainer" / "devcontainer.json").read_text())
    assert settings.keys() <= KNOWN
    assert settings["build"] == {"dockerfile": "../Dockerfile", "context": ".."}


def test_the_file_for_students_in_the_documents_is_one_too() -> None:
    text = (REPO / "docs" / "how-to" / "docker.md").read_text()
    (block,) = re.findall(r"^```json\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    settings = json.loads(block)
    assert settings.keys() <= KNOWN
    assert (settings["remoteUser"], settings["postCreateCommand"]) == ("grader", "grader doctor")
