"""In whose hands `grader check` runs: a student's, a CI system's, or those of git just before a commit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

_CI = ("CI", "GITHUB_ACTIONS", "GITLAB_CI", "JENKINS_URL", "TF_BUILD", "BUILDKITE", "TEAMCITY_VERSION")
_NO = ("", "0", "false", "no")


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """In `ci` a commit was pushed already, and is checked out by itself. While git is `committing`, what is staged is
    on its way, and pushing comes later. `here` is the folder that commands are typed in."""

    here: Path
    ci: bool = False
    committing: bool = False


def surroundings(environment: Mapping[str, str], here: Path) -> Surroundings:
    """What the variables that CI systems, git and pre-commit set tell."""
    ci = any(environment.get(name, "").lower() not in _NO for name in _CI)
    committing = not ci and bool(environment.get("PRE_COMMIT") or environment.get("GIT_INDEX_FILE"))
    return Surroundings(here=here, ci=ci, committing=committing)
