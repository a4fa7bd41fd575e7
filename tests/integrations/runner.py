"""GitHub's runner, as far as a composite action can see it: the steps of `action.yml` are run by bash, with what they
print and write read as the runner reads it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
EXPRESSION = re.compile(r"\$\{\{(.*?)\}\}")
COMMAND = re.compile(r"\s*::([^\s:]+)(?: ([^\r\n]*?))?::(.*)")
KNOWN = {
    "add-mask", "add-matcher", "add-path", "debug", "echo", "endgroup", "error", "group", "notice", "remove-matcher",
    "save-state", "set-env", "set-output", "stop-commands", "warning",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Ran:
    """What became of a use of the action. `heard` are the commands that were obeyed: name, properties, message."""

    code: int
    outputs: dict[str, str]
    log: str
    heard: tuple[tuple[str, dict[str, str], str], ...]
    summary: str
    artifact: Path | None

    def annotations(self, kind: str) -> list[str]:
        """`title: message` of each."""
        return [f"{told.get('title', '')}: {text}" for name, told, text in self.heard if name == kind]


@dataclass(kw_only=True)
class Runner:
    """A machine. `workspace` is the checkout; `more` are variables that it sets besides, `path` programs before its
    own."""

    temp: Path
    workspace: Path
    path: str = SYSTEM_PATH
    more: dict[str, str] = field(default_factory=dict)

    def use(self, **given: str) -> Ran:
        """`uses:` of the action with these inputs, `_` for `-`."""
        known = {name: told["default"] for name, told in ACTION["inputs"].items()}
        inputs = known | {name.replace("_", "-"): text for name, text in given.items()}
        assert inputs.keys() == known.keys()
        steps: dict[str, dict[str, str]] = {}
        code, log, summary, artifact = 0, "", "", None
        for number, step in enumerate(ACTION["runs"]["steps"]):
            if "run" not in step:
                artifact = self._uploaded(step, inputs, steps)
            elif code == 0:
                ended, said, told = self._run(step, number, inputs, steps)
                code, log, summary = code or ended, log + said, summary + told
        outputs = {name: _filled(told["value"], inputs, steps) for name, told in ACTION["outputs"].items()}
        return Ran(
            code=code, outputs=outputs, log=log, heard=tuple(heard(log)), summary=summary, artifact=artifact
        )

    def _run(self, step: dict, number: int, inputs: dict, steps: dict) -> tuple[int, str, str]:
        files = self.temp / "_runner_file_commands"
        files.mkdir(parents=True, exist_ok=True)
        output, summary = files / f"set_output_{number}", files / f"step_summary_{number}"
        output.touch()
        summary.touch()
        variables = {
            "PATH": self.path,
            "HOME": str(self.temp / "home"),
            "CI": "true",
            "GITHUB_ACTIONS": "true",
            "GITHUB_ACTION_PATH": str(ROOT),
            "GITHUB_ENV": str(files / f"set_env_{number}"),
            "GITHUB_OUTPUT": str(output),
            "GITHUB_REPOSITORY": "course/lab-student",
            "GITHUB_STEP_SUMMARY": str(summary),
            "GITHUB_WORKSPACE": str(self.workspace),
            "RUNNER_OS": "Linux",
            "RUNNER_TEMP": str(self.temp),
            **{name: _filled(text, inputs, steps) for name, text in step["env"].items()},
            **self.more,
        }
        assert step["shell"] == "bash"
        done = subprocess.run(
            ["/bin/bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            env=variables,
            cwd=self.workspace,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        steps[step["id"]] = outputs_in(output.read_text(encoding="utf-8"))
        return done.returncode, done.stdout.decode(errors="replace"), summary.read_text(encoding="utf-8")

    def _uploaded(self, step: dict, inputs: dict, steps: dict) -> Path | None:
        """What `if: always() && …` lets through."""
        assert step["if"].startswith("always() && ")
        conditions = step["if"].removeprefix("always() && ").split(" && ")
        values = [_value(condition.removesuffix(" != ''"), inputs, steps) for condition in conditions]
        assert re.fullmatch(r"actions/upload-artifact@[0-9a-f]{40}", step["uses"])
        return Path(_filled(step["with"]["path"], inputs, steps)) if all(values) else None


def _filled(text: str, inputs: dict, steps: dict) -> str:
    return EXPRESSION.sub(lambda found: _value(found[1], inputs, steps), text)


def _value(expression: str, inputs: dict, steps: dict) -> str:
    for part in (part.strip() for part in expression.split("||")):
        if part.startswith("'"):
            found = part.strip("'")
        elif part.startswith("inputs."):
            found = inputs[part.removeprefix("inputs.")]
        else:
            _, step, word, name = part.split(".")
            assert word == "outputs"
            found = steps.get(step, {}).get(name, "")
        if found:
            return found
    return ""


def outputs_in(text: str) -> dict[str, str]:
    """A file of outputs: `name=value`, or `name<<end`, lines, `end`."""
    found, rows = {}, iter(text.split("\n"))
    for row in rows:
        if not row:
            continue
        equals, block = row.find("="), row.find("<<")
        if block >= 0 and (equals < 0 or block < equals):
            name, end = row.split("<<", 1)
            value = []
            for line in rows:
                if line == end:
                    break
                value.append(line)
            else:
                raise AssertionError(f"{name} has no end")
            found[name] = "\n".join(value)
        else:
            assert equals > 0, row
            found[row[:equals]] = row[equals + 1 :]
    return found


def heard(log: str):
    """The commands in a log that the runner obeys."""
    silent = ""
    for row in re.split(r"\r\n|\n|\r", log):
        assert "##[" not in row, "the runner's older form of a command"
        found = COMMAND.match(row)
        if found is None:
            continue
        name, properties, text = found[1], found[2] or "", found[3]
        if silent:
            silent = "" if name == silent else silent
        elif name == "stop-commands":
            silent = text
        elif name in KNOWN:
            told = dict(pair.split("=", 1) for pair in properties.split(",") if "=" in pair)
            yield name, {key: _read(value) for key, value in told.items()}, _read(text)
    assert not silent, "commands are heard again in the end"


def _read(text: str) -> str:
    for code, sign in {"%3A": ":", "%2C": ",", "%0D": "\r", "%0A": "\n", "%25": "%"}.items():
        text = text.replace(code, sign)
    return text


def installed(home: Path) -> None:
    """The grader is there already: that of this checkout, without what pip would do for a minute."""
    (home / "venv" / "bin").mkdir(parents=True)
    (home / "venv" / "bin" / "grader").symlink_to(grader())
    (home / "installed").write_text(version())


def version() -> str:
    """What `ci/install.sh` calls this checkout."""
    ask = f'git -C "{ROOT}" rev-parse HEAD 2>/dev/null || cksum <"{ROOT}/pyproject.toml"'
    done = subprocess.run(["/bin/bash", "-c", ask], capture_output=True, text=True, check=True)
    return f"{ROOT} {done.stdout.strip()}"


def grader() -> Path:
    """The program of the environment in which the tests run."""
    found = Path(sys.executable).parent / "grader"
    assert os.access(found, os.X_OK)
    return found
