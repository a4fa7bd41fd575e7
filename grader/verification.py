"""Is a result what it says? It is signed, its evidence is judged again, and everything that does not fit is named.

    result.json, evidence/ → judge again by the rubric → criterion by criterion, total
    SHA256SUMS, .sig       → who signed, and which files are not what was signed
    another result.json    → what a student's own run and the official one have in common

Verifying runs nothing and writes nothing. `sign` signs with an SSH key as git signs commits: `SHA256SUMS` names the
result and every file of the evidence with their sha256, and `SHA256SUMS.sig` is `ssh-keygen`'s signature of it, so
`sha256sum -c` and `ssh-keygen -Y verify` check the same without a grader. The rubric's digest and the submission's
stand in the result. Whatever changes a result removes its signature (`results.py`).
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from grader import __version__
from grader.errors import EvidenceError, HostError, UsageError
from grader.evidence.reader import load_evidence
from grader.evidence.run import Run
from grader.files import atomic_write, open_untrusted, read_untrusted
from grader.host_programs import find_user_program, with_absolute_paths
from grader.intake.names import safe_name
from grader.judging import judge
from grader.judging.settle import awarded, settle
from grader.judging.summary import overall_status, total_fields
from grader.model.result import Automatic, CriterionResult, GradingResult
from grader.report.files import result_text
from grader.report.sentences import RUBRIC_FROM
from grader.report.view import hidden_ids, without_hidden
from grader.results import EVIDENCE, RESULT, SIGNATURE, SUMS, load_result
from grader.rubric.load import LoadedRubric
from grader.wording import number, plural

NAMESPACE = "grader"  # ssh-keygen accepts no signature that was made for something else, as git's are
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
            f"{key}: ssh-keygen cannot sign with it: {_printed_text(done)}",
            hint=f"chmod 600 {key}" if b"UNPROTECTED" in done.stderr else LOCKED_KEY,
        )
    # the old one first: if this is killed, the result is unsigned, and not signed wrongly
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
            # a name with a line end in it could pass for another line of SHA256SUMS
            if not name.isprintable():
                raise EvidenceError(f"{name!r} is not a name that the grader gives to evidence")
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
    # this one checks the signature without a list of signers, and says whose key it is
    checked = _ssh_keygen(["-Y", "check-novalidate", "-n", NAMESPACE, *signature], text)
    key = KEY.search(_printed_text(checked))
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
            # English, since its words are parsed
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


def _printed_text(done: subprocess.CompletedProcess[bytes]) -> str:
    text = (done.stdout + b"\n" + done.stderr).decode("utf-8", "replace")
    return " ".join(text.split())[:300]


About = Literal["rubric", "result", "evidence", "signature", "code", "grader"]


class PartFinding(NamedTuple):
    """What was found about a part. With `wrong`, the result is not to be trusted for it."""

    about: About
    text: str
    wrong: bool = True


def result_folders(paths: list[Path]) -> list[Path]:
    """Return the folders of the results that these stand for: `result.json`, its folder, or a folder of such folders.

    Raises EvidenceError where there is none.
    """
    found = []
    for path in paths:
        folder = path.parent if path.is_file() else path
        inside = (
            [folder] if (folder / RESULT).is_file() else sorted(p.parent for p in folder.glob(f"*/{RESULT}"))
        )
        if not inside:
            raise EvidenceError(
                f"{path}: there is no {RESULT}", hint="give the folder of a submission's results"
            )
        found += inside
    return found


def verify(
    folder: Path, rubric: LoadedRubric, allowed: Path | None, *, of_class: bool = False
) -> list[PartFinding]:
    """Judge the evidence in a result's folder again, and return what was found about result, rubric, evidence and
    signature. `of_class`: the folder is one of a class, where it has its submission's name.

    Raises EvidenceError where there is nothing to judge.
    """
    result = load_result(folder / RESULT)
    if result.error is not None:
        raise EvidenceError(
            f"{folder}: it was not graded, so there is nothing to judge: {result.error.message}"
        )
    found = [*_owner_findings(folder, result, of_class=of_class), *_rubric_findings(result, rubric)]
    found += _signature_findings(folder, allowed)
    try:
        runs = load_evidence([folder / EVIDENCE])
    except EvidenceError as error:
        return [*found, PartFinding("evidence", error.message)]
    return [*found, *_evidence_findings(result, runs), *_result_findings(result, runs, rubric)]


def _owner_findings(folder: Path, result: GradingResult, *, of_class: bool) -> Iterator[PartFinding]:
    """The whole of another student's folder, signature and all, fits in itself."""
    owner, name = result.submission.id, folder.resolve().name
    if name != safe_name(owner):
        yield PartFinding("result", f"it is the result of {owner}, in the folder {name}", wrong=of_class)


def _rubric_findings(result: GradingResult, rubric: LoadedRubric) -> Iterator[PartFinding]:
    used, lab = result.rubric, rubric.rubric
    if (used.id, used.digest) == (lab.id, rubric.digest):
        words = f"{lab.id}, digest {rubric.digest[:12]}"
        yield PartFinding("rubric", f"{words} ({RUBRIC_FROM[rubric.origin]})", wrong=False)
        return
    origin = RUBRIC_FROM[result.rubric_origin]
    words = f"it was judged by {used.id} with digest sha256:{used.digest}{f' ({origin})' if origin else ''}"
    other = (
        f"{lab.id} with digest sha256:{rubric.digest}; give the course's own with --rubric, if it is another"
    )
    yield PartFinding("rubric", f"{words}, not by {other}")


def _signature_findings(folder: Path, allowed: Path | None) -> Iterator[PartFinding]:
    """Yield what is found about the signature. None, or one without a name, is wrong only where signers are
    asked for."""
    signature = read_signature(folder, allowed)
    wrong = signature.state == "bad" or (allowed is not None and signature.state != "good")
    yield PartFinding("signature", _signature_words(signature, asked=allowed is not None), wrong=wrong)
    if signature.state == "unsigned":
        return
    for name, what in sorted(changed_files(folder).items()):
        since = "was signed, and is gone" if what == "missing" else f"was {what} since it was signed"
        yield PartFinding("result" if name == RESULT else "evidence", f"{name} {since}")


def _signature_words(signature: Signature, *, asked: bool) -> str:
    if signature.state == "unsigned":
        return "not signed: if result and evidence were changed together, nobody sees it"
    if signature.state == "bad":
        return "SHA256SUMS is not what was signed"
    if signature.state == "good":
        return f"signed by {signature.by}"
    who = ", none of the allowed signers" if asked else " (--allowed-signers says whose that is)"
    return f"signed with the {signature.by}{who}"


def _evidence_findings(result: GradingResult, runs: Mapping[str, Run]) -> Iterator[PartFinding]:
    """Evidence says whose it is, and of which files."""
    for key, said in (("commit", result.submission.commit or ""), ("digest", result.submission.digest)):
        other = {
            run.metadata.get(f"submission.{key}", said) for name, run in runs.items() if "/" not in name
        } - {said}
        if other:
            text = (
                f"it is of a submission with the {key} {min(other)[:40] or 'none'}, not {said[:40] or 'none'}"
            )
            yield PartFinding("evidence", text)


def _result_findings(
    result: GradingResult, runs: Mapping[str, Run], rubric: LoadedRubric
) -> Iterator[PartFinding]:
    again = _judge_again(result, runs, rubric)
    before, after = ({c.id: c for c in one.criteria} for one in (result, again))
    differing = []
    for name in dict.fromkeys((*before, *after)):
        text = _difference(before.get(name), after.get(name))
        differing += [f"{name}: {text}"] if text else []
    for said, now in zip(result.overrides, again.overrides, strict=False):
        if _verdict(said.automatic) != _verdict(now.automatic):
            words = f"{_verdict(said.automatic)}; the evidence gives {_verdict(now.automatic)}"
            differing.append(f"{said.criterion}: before a person decided, result.json says {words}")
    # A course's terms for late work are not those of its labs' rubrics.
    late = None if rubric.rubric.deadline or rubric.rubric.late else result.late
    for key in ("status", "points", "max_points", "gate"):
        told = late.points_before if late and key == "points" else getattr(result, key)
        if told != (now := getattr(again, key)):
            differing.append(f"{key}: result.json says {told}, it comes to {now}")
    if late:
        cost = f"{number(late.points_before)} points before, {number(result.points)} after"
        words = f"{late.text} ({cost}), by a deadline that this rubric does not have: course.yaml#LAB has it"
        fits = late.points == result.points <= late.points_before
        yield PartFinding("rubric", words, wrong=not fits)
    yield from (PartFinding("result", text) for text in differing)
    yield from _remarks(result, again)
    if not differing:
        judged = plural(len(before), "criterion", "criteria")
        text = f"{judged} and {number(result.points)} points, as the evidence gives"
        yield PartFinding("result", text, wrong=False)


def _remarks(result: GradingResult, again: GradingResult) -> Iterator[PartFinding]:
    """Yield what changes no points. Words differ from one build of the grader to the next."""
    texts = {c["id"]: c for c in json.loads(result_text(again))["criteria"]}
    said = {c["id"]: c for c in json.loads(result_text(result))["criteria"]}
    other = [name for name in said if name in texts and said[name] != texts[name]]
    if other:
        text = f"worded otherwise, by another build of the grader or by hand: {', '.join(other)}"
        yield PartFinding("result", text, wrong=False)
    if result.environment.grader != __version__:
        text = f"graded by {result.environment.grader}, judged again by {__version__}"
        yield PartFinding("grader", text, wrong=False)
    if decided := awarded(result.overrides):
        who = ", ".join(sorted({o.author or "someone unnamed" for o in decided.values()}))
        text = f"people decided {plural(len(decided), 'criterion', 'criteria')}: {who}"
        yield PartFinding("result", text, wrong=False)


def _judge_again(result: GradingResult, runs: Mapping[str, Run], rubric: LoadedRubric) -> GradingResult:
    """Return what the evidence comes to with what people decided and what being late costs, as the result has them."""
    lab = rubric.rubric
    criteria = judge(lab, runs, rubric.checks, rubric.handed_out)
    fresh = {
        "criteria": criteria,
        "status": overall_status(criteria),
        **total_fields(lab, criteria),
        "max_points": lab.max_points,
        "overrides": (),
        "handed_in": None,
        "late": None,
    }
    automatic = result.model_copy(update=fresh)
    if result.overrides or result.handed_in or result.late:
        automatic = settle(
            automatic,
            lab,
            overrides={override.criterion: override for override in result.overrides},
            handed_in=result.handed_in,
            before=result.overrides,
        )
    shown = {criterion.id for criterion in result.criteria}
    return automatic if shown & hidden_ids(lab) else without_hidden(automatic, lab)


def _difference(before: CriterionResult | None, after: CriterionResult | None) -> str:
    if before is None or after is None:
        return "the rubric has no such criterion" if after is None else "it is missing in result.json"
    old, new = (f"{_verdict(c)} of {number(c.max_points)} points" for c in (before, after))
    return "" if old == new else f"result.json says {old}; the evidence gives {new}: {after.message}"


def _verdict(of: CriterionResult | Automatic) -> str:
    """Return `pass, 20`."""
    return f"{of.status.value}, {number(of.points)}"


def compare(own: GradingResult, official: GradingResult) -> list[PartFinding]:
    """Return what differs between a student's own result and the official one: code, rubric, grader, and criteria."""
    return [*_compare_causes(own, official), *_compare_criteria(own, official)]


def _compare_causes(own: GradingResult, official: GradingResult) -> Iterator[PartFinding]:
    same = own.submission.digest == official.submission.digest
    commits = " and ".join((one.submission.commit or "no commit")[:12] for one in (own, official))
    words = "the same files were graded" if same else f"other files were graded ({commits})"
    yield PartFinding("code", words, wrong=not same)
    if (own.rubric.id, own.rubric.digest) != (official.rubric.id, official.rubric.digest):
        used = [f"{one.rubric.id} {one.rubric.digest[:12]}" for one in (own, official)]
        origin = f" ({RUBRIC_FROM[own.rubric_origin]})" if own.rubric_origin else ""
        yield PartFinding("rubric", f"own run by {used[0]}{origin}, official by {used[1]}")
    for name in ("grader", "ROS", "sandbox"):
        one, other = (getattr(result.environment, name.lower()) for result in (own, official))
        if one != other:
            yield PartFinding("grader", f"{name}: {one or 'none'}, official: {other or 'none'}", wrong=False)


def _compare_criteria(own: GradingResult, official: GradingResult) -> Iterator[PartFinding]:
    mine = {criterion.id: criterion for criterion in own.criteria}
    for theirs in official.criteria:
        ours = mine.get(theirs.id)
        if ours is None:
            yield PartFinding("result", f"{theirs.id}: only in the official result", wrong=False)
        elif (ours.status, ours.points) != (theirs.status, theirs.points):
            old, new = (f"{_verdict(c)} of {number(c.max_points)}" for c in (ours, theirs))
            yield PartFinding("result", f"{theirs.id}: own run {old}; official {new}: {theirs.message}")
    for name in mine.keys() - {criterion.id for criterion in official.criteria}:
        yield PartFinding("result", f"{name}: only in the own run", wrong=False)
    points = [f"{number(one.points)} of {number(one.max_points)}" for one in (own, official)]
    yield PartFinding("result", f"own run {points[0]} points, official {points[1]}", wrong=False)
