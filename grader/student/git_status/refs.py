"""What is known of the server from the last fetch or push: which commits it lacks, and which branch is marked."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from grader.intake.git import GitFailed, GitTimeout
from grader.student.git_status.state import Head, Remote
from grader.student.git_status.view import View

_USUAL = ("main", "master")
_TRACKING = "refs/remotes/"


def remote_of(view: View, package: Path, head: Head) -> Remote:
    """How the commit here stands to the server. Raises GitFailed."""
    names = view.remote_names
    refs, links = _refs(view)
    name = _pushed_to(view.settings, head.branch, names)
    if name is None:
        return Remote(names=names, elsewhere=bool(refs) and _is_known(view))
    default = _default(name, refs, links)
    ref = _tracked(view.settings, head.branch, name, refs)
    ahead, behind = _counts(view, ref) if ref else (None, None)
    marked = default or ref
    return Remote(
        names=names,
        name=name,
        ref=ref,
        ahead=ahead,
        behind=behind,
        default=default,
        off_default=_counts(view, default)[0] if default and default != ref else None,
        differing=_differing(view, package, marked) if marked and refs[marked] != head.commit else (),
        elsewhere=ref is None and _is_known(view),
    )


def _refs(view: View) -> tuple[dict[str, str], dict[str, str]]:
    """The server's branches with their commits, as `origin/main`, and those that only name another."""
    said = view.run("for-each-ref", "--format=%(refname) %(objectname) %(symref)", _TRACKING)
    refs, links = {}, {}
    for line in os.fsdecode(said).splitlines():
        name, commit, *link = line.removeprefix(_TRACKING).split(" ")
        if link and link[0]:
            links[name] = link[0].removeprefix(_TRACKING)
        else:
            refs[name] = commit
    return refs, links


def _pushed_to(settings: Mapping[str, str], branch: str | None, names: tuple[str, ...]) -> str | None:
    told = (
        settings.get(f"branch.{branch}.pushremote"),
        settings.get("remote.pushdefault"),
        settings.get(f"branch.{branch}.remote"),
        names[0] if len(names) == 1 else None,
        "origin",
    )
    return next((name for name in told if name in names), None)


def _tracked(
    settings: Mapping[str, str], branch: str | None, name: str, refs: Mapping[str, str]
) -> str | None:
    """Where the branch is pushed to; None where it never was."""
    if branch is None:
        return None
    merged = settings.get(f"branch.{branch}.merge", "").removeprefix("refs/heads/")
    own = merged if merged and settings.get(f"branch.{branch}.remote") == name else branch
    return f"{name}/{own}" if f"{name}/{own}" in refs else None


def _default(name: str, refs: Mapping[str, str], links: Mapping[str, str]) -> str | None:
    """The branch that a fresh clone has, as far as it can be told."""
    link = links.get(f"{name}/HEAD")
    if link in refs:
        return link
    own = [ref for ref in refs if ref.startswith(f"{name}/")]
    usual = [f"{name}/{word}" for word in _USUAL if f"{name}/{word}" in refs]
    found = usual if len(usual) == 1 else own
    return found[0] if len(found) == 1 else None


def _counts(view: View, ref: str) -> tuple[int, int]:
    """Commits that only this side has, and that only the server has."""
    args = ("rev-list", "--left-right", "--count", f"HEAD...{_TRACKING}{ref}", "--")
    here, there = view.run(*args).split()
    return int(here), int(there)


def _differing(view: View, package: Path, ref: str) -> tuple[str, ...]:
    args = ("diff-tree", "-r", "-z", "--name-only", "--no-renames", "--relative", f"{_TRACKING}{ref}", "HEAD")
    said = view.run(*args, "--", ".", cwd=package)
    return tuple(os.fsdecode(path) for path in said.split(b"\0") if path)


def _is_known(view: View) -> bool:
    """Whether the commit here is on some branch of the server."""
    try:
        return bool(view.run("for-each-ref", "--count=1", "--contains=HEAD", _TRACKING).strip())
    except GitTimeout:
        raise
    except GitFailed:
        return False
