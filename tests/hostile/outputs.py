"""Looks through all that a grading wrote and printed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from mcap.reader import make_reader

CONTROL = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\udc80-\udcff]"
    r"|^\s*::[a-z]|##[A-Za-z]*\[",  # turned-around text, and what CI systems take for a command
    re.MULTILINE,
)
SHOWN = (".md", ".xml", ".json", ".log", ".html", ".csv")


def secrets_in(secret: str, folder: Path, texts: Mapping[str, str]) -> Iterator[str]:
    """Where the secret is: in files as they are, in evidence unpacked too, and in what was printed."""
    wanted = re.compile(re.escape(secret.encode()) + rb"[\w.-]*")
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        name = path.relative_to(folder).as_posix()
        chunks = [("", path.read_bytes()), *(_unpacked(path) if path.suffix == ".mcap" else ())]
        for part, data in chunks:
            if found := wanted.search(data):
                yield f"{name} {part}: {found[0].decode(errors='replace')}".replace(secret, "")
    for name, text in texts.items():
        if found := wanted.search(text.encode(errors="surrogateescape")):
            yield f"{name}: {found[0].decode()}".replace(secret, "")


def _unpacked(path: Path) -> Iterator[tuple[str, bytes]]:
    with path.open("rb") as file:
        reader = make_reader(file)
        for _, channel, message in reader.iter_messages():
            yield channel.topic, message.data
        for attachment in reader.iter_attachments():
            yield attachment.name, attachment.data
        for record in reader.iter_metadata():
            yield record.name, repr(record.metadata).encode()


def control_characters(folder: Path, texts: Mapping[str, str]) -> Iterator[str]:
    """Escape codes and the like in what people look at."""
    shown = dict(texts)
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.suffix in SHOWN:
            shown[path.name] = path.read_bytes().decode(errors="surrogateescape")
    for name, text in shown.items():
        if found := CONTROL.search(text):
            around = text[max(0, found.start() - 40) : found.end() + 40]
            yield f"{name}: {around!r}"
