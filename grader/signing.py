"""Who graded: the result and its evidence, signed with an SSH key as git signs commits.

`SHA256SUMS` names the result and every file of the evidence with their sha256, and `SHA256SUMS.sig` is `ssh-keygen`'s
signature of it, so `sha256sum -c` and `ssh-keygen -Y verify` check the same without a grader. The rubric's digest and
the submission's stand in the result. Whatever changes a result removes its signature (`results.py`).
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from grader.errors import EvidenceError, HostError, UsageError
from grader.files import atomic_write, open_untrusted, read_untrusted
from grader.host_programs import find_user_program, with_absolute_paths
from grader.results import EVIDENCE, RESULT, SIGNATURE, SUMS

NAMESPACE = "grader"
BYTES_MAX, BLOCK_BYTES = 4 << 20, 1 << 20
TIMEOUT_S = 60.0
LINE = re.compile(r"(?P<sum>[0-9a-f]{64})  (?P<name>[^\n]+)")
KEY = re.compile(r"with (?P<key>\S+ key SHA256:\S+)")
LOCKED_KEY = "a key with a passphrase has to be in ssh-agent; name its .pub file then"


@dataclass(frozen=True, kw_only=True)
class Signature:
    """`unknown`: a good signature of someone who is not among the allowed signers; `bad`: `SHA256SUMS` is not what was
    signed. `by` is the signer's name, or the key where no name is known."""

    state: Literal["unsigned", "good", "unknown", "bad"]
    by: str = ""


def sign(folder: Path, key: Path) -> None:
    """Sign the result in a folder and the evidence beside it. Raises UsageError where the key cannot be used."""
    if not key.is_file():
        raise UsageError(f"{key}: there is no such file", hint="ssh-keygen -t ed25519 -f KEY makes a key")
    text = "".join(f"{digest}  {name}\n" for name, digest in sorted(file_sums(folder).items())).encode()
    done = _ssh_keygen(["-Y", "sign", "-f", str(key.absolute()), "-n", NAMESPACE], text)
    if done.returncode or not done.stdout:
        raise UsageError(
            f"{key}: ssh-keygen cannot sign with it: {_said(done)}",
            hint=f"chmod 600 {key}" if b"UNPROTECTED" in done.stderr else LOCKED_KEY,
        )
    (folder / SIGNATURE).unlink(missing_ok=True)
    atomic_write(folder / SUMS, text)
    atomic_write(folder / SIGNATURE, done.stdout)


def file_sums(folder: Path) -> dict[str, str]:
    """Return the sha256 of the result and of each file of the evidence, by their paths from the folder.

    Raises EvidenceError where one cannot be read.
    """
    return {name: _sum(folder, name) for name in (RESULT, *_evidence_files(folder))}


def _sum(folder: Path, name: str) -> str:
    digest = hashlib.sha256()
    try:
        with open_untrusted(folder, *name.split("/")) as file:
            while block := file.read(BLOCK_BYTES):
                digest.update(block)
    except OSError as error:
        raise EvidenceError(f"{folder / name} cannot be read: {error.strerror}") from error
    return digest.hexdigest()


def _evidence_files(folder: Path) -> Iterator[str]:
    for place, _, files in os.walk(folder / EVIDENCE):
        for file in files:
            name = Path(place, file).relative_to(folder).as_posix()
            if not name.isprintable():
                raise EvidenceError(f"{name!r} is no name that the grader gives to evidence")
            yield name


def changed_files(folder: Path) -> dict[str, str]:
    """Return by name what became of the files that `SHA256SUMS` names: `changed`, `missing`, or `added` since."""
    text = (read_untrusted(folder / SUMS, BYTES_MAX) or b"").decode("utf-8", "replace")
    signed = {row["name"]: row["sum"] for row in map(LINE.fullmatch, text.splitlines()) if row}
    return _differences(signed, file_sums(folder))


def _differences(signed: Mapping[str, str], now: Mapping[str, str]) -> dict[str, str]:
    found = dict.fromkeys(signed.keys() - now.keys(), "missing")
    found |= dict.fromkeys(now.keys() - signed.keys(), "added")
    return found | {name: "changed" for name in signed.keys() & now.keys() if signed[name] != now[name]}


def read_signature(folder: Path, allowed: Path | None) -> Signature:
    """Return who signed the folder's `SHA256SUMS`; `allowed` is a file of allowed signers, as git has it.

    Raises UsageError where that file cannot be read.
    """
    if allowed is not None and not os.access(allowed, os.R_OK):
        raise UsageError(f"{allowed} cannot be read", hint="give a file of allowed signers: man ssh-keygen")
    text = read_untrusted(folder / SUMS, BYTES_MAX)
    if text is None or read_untrusted(folder / SIGNATURE, BYTES_MAX) is None:
        return Signature(state="unsigned")
    signature = ["-s", str((folder / SIGNATURE).absolute())]
    checked = _ssh_keygen(["-Y", "check-novalidate", "-n", NAMESPACE, *signature], text)
    key = KEY.search(_said(checked))
    if checked.returncode or key is None:
        return Signature(state="bad")
    if allowed is None:
        return Signature(state="unknown", by=key["key"])
    signers = ["-f", str(allowed.absolute())]
    named = _ssh_keygen(["-Y", "find-principals", *signers, *signature], b"")
    for name in re.split("[,\n]", named.stdout.decode("utf-8", "replace").strip()):
        words = ["-Y", "verify", *signers, "-I", name, "-n", NAMESPACE, *signature]
        if _ssh_keygen(words, text).returncode == 0:
            return Signature(state="good", by=name)
    return Signature(state="unknown", by=key["key"])


def _ssh_keygen(words: Sequence[str], data: bytes) -> subprocess.CompletedProcess[bytes]:
    """Run it without a terminal, so that it asks nothing. Raises HostError where there is none."""
    program = find_user_program("ssh-keygen")
    if program is None:
        raise HostError("there is no ssh-keygen here", hint="apt-get install openssh-client")
    try:
        return subprocess.run(
            [program, *words],
            env={**with_absolute_paths(os.environ), "LC_ALL": "C", "SSH_ASKPASS_REQUIRE": "never"},
            cwd="/",
            input=data,
            capture_output=True,
            timeout=TIMEOUT_S,
            check=False,
            start_new_session=True,
        )
    except subprocess.TimeoutExpired as error:
        raise HostError(f"ssh-keygen did not end within {TIMEOUT_S:g} s") from error


def _said(done: subprocess.CompletedProcess[bytes]) -> str:
    text = (done.stdout + b"\n" + done.stderr).decode("utf-8", "replace")
    return " ".join(text.split())[:300]
