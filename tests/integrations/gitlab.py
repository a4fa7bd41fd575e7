"""`ci/gitlab.yml`, and the variables that GitLab's runner makes of it."""

from __future__ import annotations

import re

import yaml

from tests.integrations.runner import ROOT

TEMPLATE = yaml.safe_load((ROOT / "ci" / "gitlab.yml").read_text(encoding="utf-8"))
JOB = TEMPLATE["ros-lab"]
VARIABLE = re.compile(r"\$(\w+)|\$\{(\w+)\}")


def variables_of(project: str, **given: str) -> dict[str, str]:
    """Those of a job in the folder `project`: the system's, the template's with what the including file says instead,
    and the job's own."""
    system = {
        "CI": "true",
        "CI_COMMIT_SHORT_SHA": "0a1b2c3d",
        "CI_JOB_ID": "4711",
        "CI_PROJECT_DIR": project,
        "GITLAB_CI": "true",
    }
    assert given.keys() <= TEMPLATE["variables"].keys()
    named = system | TEMPLATE["variables"] | given | JOB["variables"]
    return {
        name: VARIABLE.sub(lambda found: named.get(found[1] or found[2], ""), text)
        for name, text in named.items()
    }
