"""A Dockerfile's steps, run one by one in a fresh root: as much of Docker as our own files ask for."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from dockerfile_parse import DockerfileParser

from tests.fresh.room import PATH, Root

BASES = {"debian:12-slim"}


@dataclass
class Image:
    """What the steps have made of the root: its variables, the user, the folder and the command that it begins with."""

    root: Root
    env: dict[str, str] = field(default_factory=lambda: {"PATH": PATH})
    arguments: dict[str, str] = field(default_factory=dict)
    user: str | None = None
    folder: str = "/"
    entrypoint: Sequence[str] = ()
    command: Sequence[str] = ()


def build(
    root: Root, dockerfile: Path, files: Sequence[str], arguments: Mapping[str, str] | None = None
) -> Image:
    """Run every step. `files` are those of the Dockerfile's folder that its .dockerignore lets through.

    Raises KeyError for an instruction that is not known here, AssertionError for a base.
    """
    with dockerfile.open("rb") as text:
        steps = DockerfileParser(fileobj=text).structure
    image = Image(root=root, arguments=dict(arguments or {}))
    for step in steps:
        name, value = step["instruction"], step["value"]
        if name == "COPY":
            _copy(image, dockerfile.parent, files, value)
        else:
            STEPS[name](image, value)
    return image


def _from(_: Image, value: str) -> None:
    assert value in BASES, value


def _run(image: Image, value: str) -> None:
    env = {**image.arguments, **image.env}
    image.root.run(["/bin/sh", "-c", value], env=env, network=True, cwd=image.folder, user=image.user)


def _argument(image: Image, value: str) -> None:
    name, _, default = value.partition("=")
    image.arguments.setdefault(name, default.strip('"'))


def _env(image: Image, value: str) -> None:
    for pair in shlex.split(value):
        name, _, text = pair.partition("=")
        image.env[name] = re.sub(r"\$(\w+)", lambda match: image.env[match[1]], text)


def _folder(image: Image, value: str) -> None:
    image.folder = value
    (image.root.path / value.lstrip("/")).mkdir(parents=True, exist_ok=True)


STEPS: Mapping[str, Callable[[Image, str], None]] = {
    "COMMENT": lambda _image, _value: None,
    "FROM": _from,
    "RUN": _run,
    "ARG": _argument,
    "ENV": _env,
    "USER": lambda image, value: setattr(image, "user", value),
    "WORKDIR": _folder,
    "ENTRYPOINT": lambda image, value: setattr(image, "entrypoint", json.loads(value)),
    "CMD": lambda image, value: setattr(image, "command", json.loads(value)),
}


def _copy(image: Image, context: Path, files: Sequence[str], value: str) -> None:
    *sources, target = shlex.split(value)
    goal = PurePosixPath(image.folder, target)
    for source in sources:
        if source == ".":
            chosen = {path: goal / path for path in files}
        else:
            found = [path for path in files if PurePosixPath(path).match(source)]
            assert found, f"COPY {source}: no such file"
            into = target.endswith("/")
            chosen = {path: goal / PurePosixPath(path).name if into else goal for path in found}
        for path, place in chosen.items():
            image.root.copy_in(context / path, str(place))
