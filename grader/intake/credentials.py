"""Who the grader is for a server: from the address, the environment, or git's own helpers.

git gets a password through a helper that reads it from its environment, and only for the server that it belongs to:
it stands in no command line, no error and no file. While it is used, git's own helpers are not: they would store it.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from urllib.parse import unquote, urlsplit

from grader.errors import UsageError
from grader.host_programs import find_user_program, with_absolute_paths

HELPER_S = 30
SILENT = {"GIT_TERMINAL_PROMPT": "0", "GIT_ASKPASS": "", "SSH_ASKPASS": "", "GCM_INTERACTIVE": "never"}
"""With these, git starts no program that would ask a person for a password, nor asks itself."""
USER, PASSWORD = "GRADER_LOGIN_USER", "GRADER_LOGIN_PASSWORD"
# git runs what begins with `!` in a shell; `store` and `erase`, which it also asks for, do nothing
_HELPER = (
    f'!f() {{ test "$1" = get || exit 0; printf "username=%s\\npassword=%s\\n" "${USER}" "${PASSWORD}"; }}; f'
)
_URL = re.compile(
    r"(?P<scheme>[a-z][a-z0-9+.-]*)://(?:(?P<login>[^/]*)@)?(?P<host>[^/@]*)(?P<path>.*)", re.DOTALL
)
_HOST = re.compile(r"(?:[\w.-]+|\[[0-9A-Fa-f:.]+\])(?::\d*)?")
_UNFIT = re.compile(r"[\x00-\x1f\x7f]")
_AUTHORITY = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*)://(?P<user>[^/?#]*)@")
# A colon with no port after it: a password with a slash in it, of which the end is not known.
_TORN = re.compile(r"(?P<scheme>https?)://[^/?#@\[\]]*:(?!\d*(?:[/?#]|$)).*", re.IGNORECASE | re.DOTALL)
_REFUSED = re.compile(
    r"could not read (?:Username|Password)|terminal prompts disabled|Authentication failed|Access denied"
    r"|error: 40[134]|HTTP 40[134]|[Nn]ot found"
)


@dataclass(frozen=True, kw_only=True)
class Login:
    """`password` is None where the address names a user alone."""

    user: str = field(repr=False)
    password: str | None = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class Access:
    """What git is called with to be let in; `secrets` are to be found in nothing that it says."""

    options: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict, repr=False)
    secrets: tuple[str, ...] = field(default=(), repr=False)


def split_address(url: str) -> tuple[str, Login | None]:
    """Return the address without the login that stands in it, and that login; ssh and git know no password.

    Raises UsageError for an address in which they cannot be told apart.
    """
    match = _URL.fullmatch(url)
    if match is None:
        return url, None
    if _HOST.fullmatch(match["host"]) is None:
        raise UsageError(
            f"the server of this {match['scheme']}:// address cannot be read",
            hint="In a user's name or password write / as %2F, @ as %40 and : as %3A.",
        )
    if match["login"] is None:
        return url, None
    user, colon, password = match["login"].partition(":")
    if match["scheme"] not in ("http", "https"):
        return f"{match['scheme']}://{user}@{match['host']}{match['path']}", None
    login = Login(user=unquote(user), password=unquote(password) if colon else None)
    if _UNFIT.search(login.user + (login.password or "")):
        raise UsageError(
            "the user's name or password in this address contains characters that are not allowed in a login"
        )
    return f"{match['scheme']}://{match['host']}{match['path']}", login


def accesses(url: str, login: Login | None) -> tuple[Access, ...]:
    """Return every way to be let in at `url` (an address without a login), in the order in which they are tried.

    A token of the environment is for its own server, and never for http://. A login of the address is for that alone.
    """
    match = _URL.fullmatch(url)
    if match is None or match["scheme"] not in ("http", "https"):
        return (Access(),)
    place = f"{match['scheme']}://{match['host']}"
    if login is not None and login.password is not None:
        return (_with(place, login),)
    token = _token(match["host"].lower()) if match["scheme"] == "https" else None
    first = (_with(place, token),) if token else ()
    if login is None:
        return (*first, Access())
    # A token may stand in the place of the user.
    return (*first, _ask_helpers(place, login.user), _with(place, Login(user=login.user, password="")))


def helper_password(server: str) -> str:
    """Return what git's own helpers have as the password for a server's address; empty if they have none.

    Nobody is asked for it: a program that would ask is not started.
    """
    parts = urlsplit(server)
    wanted = f"protocol={parts.scheme}\nhost={parts.netloc}\n\n"
    options = (
        "-c",
        "credential.interactive=false",
        "-c",
        "credential.guiPrompt=false",
        "-c",
        "core.askPass=",
    )
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(
            [find_user_program("git") or "/usr/bin/git", *options, "credential", "fill"],
            input=wanted,
            env={**with_absolute_paths(os.environ), **SILENT},
            cwd="/",
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=HELPER_S,
            check=True,
        )
        said = dict(row.split("=", 1) for row in done.stdout.splitlines() if "=" in row)
        return said.get("password", "")
    return ""


def is_refusal(stderr: str) -> bool:
    """Return whether the server did not let git in. Servers say of what is private that it is not there."""
    return _REFUSED.search(stderr) is not None


def scrubbed(text: str, secrets: tuple[str, ...]) -> str:
    """Return `text` without the secrets, should a server say them again."""
    for secret in secrets:
        text = text.replace(secret, "***")
    return text


def _with(place: str, login: Login) -> Access:
    password = login.password or ""
    key = f"credential.{place}.helper"
    secrets = (password, login.user if not password else "")
    return Access(
        # the empty one first makes git forget its own helpers, which would store the password
        options=("-c", f"{key}=", "-c", f"{key}={_HELPER}"),
        environment={USER: login.user, PASSWORD: password},
        # to replace shorter ones would make a message unreadable
        secrets=tuple(secret for secret in secrets if len(secret) >= 4),
    )


def _ask_helpers(place: str, user: str) -> Access:
    """Return what makes git ask its own helpers for this user's password, by the environment (since git 2.31)."""
    count = os.environ.get("GIT_CONFIG_COUNT", "")
    number = int(count) if count.isdecimal() else 0
    return Access(
        environment={
            "GIT_CONFIG_COUNT": str(number + 1),
            f"GIT_CONFIG_KEY_{number}": f"credential.{place}.username",
            f"GIT_CONFIG_VALUE_{number}": user,
        }
    )


def _token(host: str) -> Login | None:
    """Return the environment's token for that server; None if it has none."""
    github = _https_host(os.environ.get("GITHUB_SERVER_URL") or "https://github.com")
    known = (
        # the course's own setting wins over what a CI system sets
        (_named_host(), os.environ.get("GRADER_GIT_USER") or "oauth2", ("GRADER_GIT_TOKEN",)),
        (github, "x-access-token", ("GITHUB_TOKEN", "GH_TOKEN")),
        (_gitlab_host(), "oauth2", ("GITLAB_TOKEN",)),
        (_gitlab_host(), "gitlab-ci-token", ("CI_JOB_TOKEN",)),
    )
    for server, user, variables in known:
        for variable in variables:
            token = os.environ.get(variable, "").strip()
            if token and server == host.removesuffix(":443") and not _UNFIT.search(token + user):
                return Login(user=user, password=token)
    return None


def _named_host() -> str:
    name = os.environ.get("GRADER_GIT_HOST", "").strip()
    return _https_host(name if "://" in name else f"https://{name}")


def _gitlab_host() -> str:
    name = os.environ.get("CI_SERVER_HOST", "").strip() or "gitlab.com"
    port = os.environ.get("CI_SERVER_PORT", "").strip() or "443"
    secure = os.environ.get("CI_SERVER_PROTOCOL", "https").strip() == "https"
    return _https_host(f"https://{name}:{port}") if secure else ""


def _https_host(url: str) -> str:
    """Return the server of an https address as it is compared; "" for any other address."""
    match = _URL.fullmatch(url.strip())
    return match["host"].lower().removesuffix(":443") if match and match["scheme"] == "https" else ""


def without_password(source: str) -> str:
    """Return SOURCE as it may be kept and shown: of `https://` nothing before the `@` of the server (a token may stand
    in place of a user), of other schemes the user alone. What is not an address stays as it is."""
    return _TORN.sub(r"\g<scheme>://…", _AUTHORITY.sub(_without_secret, source, count=1))


def _without_secret(match: re.Match[str]) -> str:
    scheme, user = match["scheme"], match["user"].split(":", 1)[0]
    web = scheme.lower() in ("http", "https")
    return f"{scheme}://" if web or not user else f"{scheme}://{user}@"
