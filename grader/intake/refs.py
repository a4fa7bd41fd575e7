"""Which commit an `@ref` means, from what `git ls-remote` lists."""

from __future__ import annotations

import re
from dataclasses import dataclass

from grader.errors import SubmissionError
from grader.intake.names import listing, printable
from grader.suggest import closest

_HASH = re.compile(r"[0-9a-fA-F]{4,64}")
# Shorter ones may mean another commit than the one that a ref happens to point to.
_TELLING_HASH = 7
_USUAL_BRANCHES = ("main", "master")


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """`refspec` can be fetched alone. Without one, `commit` (a hash, or its beginning) is looked for."""

    refspec: str | None = None
    commit: str | None = None
    hint: str = ""


def parse_refs(text: str) -> dict[str, str]:
    """`git ls-remote`'s lines as ref to hash; `v1^{}` is the commit that the tag `v1` stands for."""
    pairs = (line.split("\t", 1) for line in text.splitlines() if "\t" in line)
    return {ref: commit for commit, ref in pairs}


def choose_ref(refs: dict[str, str], ref: str | None, *, given: str) -> Wanted:
    """What to fetch for `@ref`, or for none. Raises SubmissionError, naming what is there."""
    if not refs:
        raise SubmissionError(
            f"{given}: the repository is empty, it has no commit", hint="Commit and `git push` first."
        )
    if ref is None:
        return _default(refs, given)
    for name in (f"refs/heads/{ref}", f"refs/tags/{ref}", f"refs/remotes/{ref}", ref):
        if name in refs:
            return Wanted(refspec=name)
    if _HASH.fullmatch(ref):
        return _by_hash(refs, ref.lower())
    raise no_such_ref(refs, ref, given=given)


def no_such_ref(refs: dict[str, str], ref: str, *, given: str) -> SubmissionError:
    """The error for a ref that is not there, with the nearest that is."""
    names = [re.sub(r"^refs/(heads|tags)/", "", name) for name in refs if name.startswith("refs/heads/")]
    names += [name[len("refs/tags/") :] for name in refs if re.fullmatch(r"refs/tags/.*(?<!\^\{\})", name)]
    near = closest(ref, names)
    hint = f"Did you mean @{printable(near)}?" if near else f"There are: {listing(names) or 'no branches'}."
    return SubmissionError(f"{given}: there is no branch, tag or commit '{printable(ref)}'", hint=hint)


def _default(refs: dict[str, str], given: str) -> Wanted:
    if "HEAD" in refs:
        return Wanted(refspec="HEAD")
    branches = [name for name in refs if name.startswith("refs/heads/")]
    usual = [f"refs/heads/{name}" for name in _USUAL_BRANCHES if f"refs/heads/{name}" in branches]
    chosen = (usual or branches)[:1]
    if not chosen or (len(branches) > 1 and not usual):
        names = listing([name.removeprefix("refs/heads/") for name in branches])
        raise SubmissionError(
            f"{given}: the repository's default branch does not exist",
            hint=f"Add the branch to mark, as in @{names}." if branches else "Push a branch.",
        )
    branch = printable(chosen[0].removeprefix("refs/heads/"))
    return Wanted(
        refspec=chosen[0], hint=f"the repository's default branch does not exist: {branch} was taken instead"
    )


def _by_hash(refs: dict[str, str], commit: str) -> Wanted:
    if len(commit) >= _TELLING_HASH:
        for name, tip in refs.items():
            if tip.startswith(commit):
                return Wanted(refspec=name.removesuffix("^{}"))
    return Wanted(commit=commit)
