"""Errors of git in a user's words: one line with the cause, and what to do."""

from __future__ import annotations

import re

from grader.errors import SubmissionError, Unreachable
from grader.intake.credentials import without_password
from grader.intake.git import GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.names import brief
from grader.intake.source import Source

_PRIVATE = (
    "If it is private, store its credentials with git first: `git ls-remote URL` must work without asking."
)
_NETWORK = "Check the address and the network, and try `git ls-remote URL`."
_PAGE = "This looks like a page of the website: give the repository's own address, then @branch."
_NOT_THEIRS = re.compile(r"this machine|name was not found|cannot be reached|has failed|broke off")
_MAY_PASS = re.compile(r"name was not found|cannot be reached|has failed|broke off")
# In this order: the first that fits what git said is the cause.
_CAUSES: tuple[tuple[str, str, str], ...] = (
    (
        r"^prlimit: ",
        "the limits of git cannot be set on this machine",
        "Raise what this shell allows (`ulimit -Ha` shows it).",
    ),
    (
        r"invalid path",
        "it holds a path that git itself does not write (`.git`, `..`)",
        "Take it out of the repository, commit and push.",
    ),
    (
        r"No space left",
        "it could not be written to this machine's disk",
        "Free some room (`df -h`) and try again.",
    ),
    (
        r"(?:error: |HTTP (?:code )?)(?:429|5\d\d)\b",
        "the server has failed, or has too much to do",
        "Try again later.",
    ),
    (
        r"Host key verification failed",
        "this machine does not know the server's ssh key",
        "Connect once by hand (`ssh HOST`) and accept the key.",
    ),
    (
        r"Permission denied|publickey",
        "the server refused the ssh key",
        "Add a key of this machine to the account (`ssh -T git@HOST` shows it), or use the https:// address.",
    ),
    (
        r"Could not resolve host|Couldn't resolve host|Name or service not known|Temporary failure in name",
        "the server's name was not found",
        _NETWORK,
    ),
    (
        (
            r"Connection refused|Connection timed out|Failed to connect|Network is unreachable"
            r"|No route to host|Couldn't connect|unable to connect|Operation timed out"
        ),
        "the server cannot be reached",
        _NETWORK,
    ),
    (
        (
            r"Connection (was )?reset|Connection closed by|SSL_read|SSL_ERROR_SYSCALL|recv error|early EOF"
            r"|Empty reply|transfer closed|unexpected disconnect|HTTP/2 stream|Broken pipe"
        ),
        "the connection broke off",
        _NETWORK,
    ),
    (
        r"SSL|certificate",
        "the server's certificate is not trusted by this machine",
        "Ask for the server's certificate to be installed, or use the ssh address.",
    ),
    (
        (
            r"could not read (Username|Password)|terminal prompts disabled|Authentication failed"
            r"|Access denied|error: 40[13]|HTTP 40[13]"
        ),
        "it does not exist, or it needs a password",
        _PRIVATE,
    ),
    (
        (
            r"not found|does not exist|does not appear to be a git repository|not a git repository|error: 404"
            r"|not valid: is this a git|[Nn]o such (file|repository|project)"
        ),
        "there is no such repository",
        f"Check the address. {_PRIVATE}",
    ),
    (
        r"unable to write|cannot create|could not create",
        "it could not be written to this machine's disk",
        "Free some room (`df -h`) and try again.",
    ),
    (
        r"RPC failed|hung up unexpectedly",
        "the connection broke off",
        _NETWORK,
    ),
)


def explained(failure: GitFailed, source: Source) -> SubmissionError:
    """Return the error to raise for what git said about `source`."""
    if isinstance(failure, GitMissing):
        return Unreachable(
            f"{source.given}: git is not installed here, so no repository can be read",
            hint="Install it (`sudo apt install git`), or give a folder or an archive.",
        )
    if isinstance(failure, GitTimeout):
        return Unreachable(
            f"{source.given}: {failure.stderr}",
            hint="Check the network, or clone it by hand and give the folder.",
        )
    if isinstance(failure, GitTooMuch):
        return SubmissionError(
            f"{source.given}: the repository is larger than a lab's submission may be",
            hint="Hand in the package's folder alone, without recordings and data.",
        )
    if known := _cause(failure):
        cause, hint = known
        page = re.search(r"/(tree|blob)/|/-/", source.url)
        kind = Unreachable if _NOT_THEIRS.search(cause) else SubmissionError
        return kind(f"{source.given}: {cause}", hint=_PAGE if page else hint)
    return SubmissionError(f"{source.given}: git says: {said(failure, source)}", hint=_NETWORK)


def may_pass(failure: GitFailed) -> bool:
    """Return whether the same may go well a little later: the network or the server has failed."""
    if isinstance(failure, GitMissing | GitTimeout | GitTooMuch):
        return isinstance(failure, GitTimeout)
    known = _cause(failure)
    return known is not None and _MAY_PASS.search(known[0]) is not None


def _cause(failure: GitFailed) -> tuple[str, str] | None:
    """The cause and the hint, where what git said is known."""
    fitting = ((cause, hint) for pattern, cause, hint in _CAUSES if re.search(pattern, failure.stderr))
    return next(fitting, None)


def said(failure: GitFailed, source: Source) -> str:
    """Return the line of git's that names the cause, without a password that the address may hold."""
    lines = [line.strip() for line in failure.stderr.splitlines() if line.strip()]
    fatal = [line for line in lines if line.startswith(("fatal:", "error:", "remote:"))]
    line = (fatal or lines or ["nothing"])[-1].removeprefix("fatal: ").removeprefix("error: ")
    for url in {source.url, without_password(source.url)} - {""}:
        line = line.replace(url, source.given)
    return brief(line)
