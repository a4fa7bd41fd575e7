"""The files that CI systems read keep to the systems' own schemas; what they run is sound shell."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.integrations.runner import ACTION, ROOT

PROGRAMS = Path(sys.executable).parent
EXAMPLES = sorted((ROOT / "ci" / "examples").glob("github*.yml"))
OWN = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
SCRIPTS = sorted((ROOT / "ci").glob("*.sh"))
TEMPLATE = ROOT / "ci" / "gitlab.yml"


def _faults(*command: object) -> str:
    """Return what a program that looks for faults prints; nothing where it ends with 0."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, cwd=ROOT
    )
    return done.stdout + done.stderr if done.returncode else ""


@pytest.mark.full
@pytest.mark.parametrize(
    ("schema", "files"),
    [
        (["github-actions"], [ROOT / "action.yml"]),
        (["github-workflows"], [*EXAMPLES, *OWN]),
        (["gitlab-ci", "--data-transform", "gitlab-ci"], [TEMPLATE]),
    ],
    ids=["action", "workflows", "gitlab"],
)
def test_the_schemas(schema, files):
    name, *more = schema
    assert _faults(PROGRAMS / "check-jsonschema", "--builtin-schema", f"vendor.{name}", *more, *files) == ""


def test_the_shell_scripts():
    assert SCRIPTS
    assert _faults(PROGRAMS / "shellcheck", *SCRIPTS) == ""
    assert all(path.stat().st_mode & 0o111 for path in SCRIPTS)


def test_the_template_of_gitlab_is_plain_shell(tmp_path):
    job = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))["ros-lab"]
    script = tmp_path / "script.sh"
    for part in ("before_script", "script", "after_script"):
        script.write_text("#!/bin/sh\n" + "\n".join(job[part]) + "\n")
        assert _faults(PROGRAMS / "shellcheck", "--shell", "sh", script) == ""


def _workflows_in_docs(folder: Path) -> list[Path]:
    """Write the whole workflows that pages show into a folder."""
    folder.mkdir()
    for page in (ROOT / "docs").rglob("*.md"):
        blocks = re.findall(
            r"^```yaml\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
        )
        for number, block in enumerate(blocks):
            if re.search(r"^on:", block, re.MULTILINE) and "\njobs:" in block:
                (folder / f"{page.stem}-{number}.yml").write_text(block, encoding="utf-8")
    return sorted(folder.iterdir())


def test_no_security_fault_is_known_of_the_workflows(tmp_path):
    """The examples name this action by its tag: users of hashes are told how. Everything else is pinned."""
    (tmp_path / "zizmor.yml").write_text(
        "rules:\n  unpinned-uses:\n    config:\n      policies:\n"
        "        OWNER/ros-lab-grader: ref-pin\n        '*': hash-pin\n"
    )
    shown = _workflows_in_docs(tmp_path / "docs")
    assert len(shown) > 1
    zizmor = (PROGRAMS / "zizmor", "--offline", "--config", tmp_path / "zizmor.yml")
    assert _faults(*zizmor, ROOT / "action.yml", *EXAMPLES, *shown) == ""
    schema = ("--builtin-schema", "vendor.github-workflows")
    assert _faults(PROGRAMS / "check-jsonschema", *schema, *shown) == ""


def test_what_the_docs_use_of_others_is_pinned_to_commits():
    docs = {path: path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md")}
    used = [(path.name, use) for path, text in docs.items() for use in re.findall(r"\buses: *(\S+)", text)]
    others = [(name, use) for name, use in used if not use.startswith(("OWNER/", "./"))]
    assert others
    assert [one for one in others if not re.search(r"@[0-9a-f]{40}$", one[1])] == []


def test_no_input_is_pasted_into_a_script():
    for step in ACTION["runs"]["steps"]:
        assert "${{" not in step.get("run", "")


def test_every_variable_of_the_grader_can_be_set_by_an_input():
    from grader.cli.commands.integrations import CI_VARIABLES  # noqa: PLC0415 - the help's text

    known = set(re.findall(r"GRADER_\w+", CI_VARIABLES))
    grade = next(step for step in ACTION["runs"]["steps"] if step.get("id") == "grade")
    assert known <= set(grade["env"])
    assert known - {"GRADER_OUT"} <= set(yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))["variables"])


@pytest.mark.parametrize("page", ["github", "gitlab"])
def test_the_docs_name_every_input(page):
    text = (ROOT / "docs" / "how-to" / f"{page}.md").read_text(encoding="utf-8")
    if page == "github":
        wanted = [f"`{name}`" for name in (*ACTION["inputs"], *ACTION["outputs"])]
    else:
        wanted = [f"`{name}`" for name in yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))["variables"]]
    assert [name for name in wanted if name not in text] == []
    for example in EXAMPLES if page == "github" else ():
        steps = example.read_text(encoding="utf-8").split("steps:\n")[1]
        assert steps.strip() in text, f"{example.name} is not as the page prints it"


def test_the_reporter_finds_the_result_by_its_id():
    job = yaml.safe_load((ROOT / "ci" / "examples" / "github-classroom.yml").read_text(encoding="utf-8"))[
        "jobs"
    ]
    *_, lab, reporter = job["run-autograding-tests"]["steps"]
    assert reporter["with"]["runners"] == lab["id"]
    assert reporter["env"] == {f"{lab['id'].upper()}_RESULTS": f"${{{{ steps.{lab['id']}.outputs.result }}}}"}
    assert re.fullmatch(r"([a-zA-Z0-9]+,)*[a-zA-Z0-9]+", reporter["with"]["runners"])
    assert set(lab["with"]) <= set(ACTION["inputs"])


BLOCK = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.mark.full
@pytest.mark.parametrize(("page", "schema"), [("github", "github-workflows"), ("gitlab", "gitlab-ci")])
def test_what_the_pages_print_is_what_the_systems_read(tmp_path, page, schema):
    """Whole files by their schema; parts of one are YAML at least."""
    text = (ROOT / "docs" / "how-to" / f"{page}.md").read_text(encoding="utf-8")
    whole = []
    for number, block in enumerate(BLOCK.findall(text)):
        data = yaml.safe_load(block)
        if page == "gitlab" or "jobs" in data:
            whole.append(tmp_path / f"{number}.yml")
            whole[-1].write_text(block)
    assert len(whole) >= 3
    assert _faults(PROGRAMS / "check-jsonschema", "--builtin-schema", f"vendor.{schema}", *whole) == ""
