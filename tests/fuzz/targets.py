"""What is fuzzed: each parser of foreign data by name, and where it runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.grammars import GRAMMARS
from tests.fuzz.parent import Outcome, Runner, Side

CORPUS = Path(__file__).resolve().parent / "corpus"
ROS_SIDE = frozenset({"header", "xmlrpc", "service-answer", "topic-stream"})


@dataclass(frozen=True, kw_only=True)
class Target:
    """`seeds` are all files of its folder of the corpus: sound ones, and whatever was found."""

    name: str

    @property
    def side(self) -> Side:
        return "ros" if self.name in ROS_SIDE else "grader"

    @property
    def folder(self) -> Path:
        return CORPUS / self.name

    @property
    def seeds(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in sorted(self.folder.glob("*"))}

    def run(self, runner: Runner, data: bytes) -> Outcome:
        return runner.run(self.side, self.name, data)


TARGETS = {name: Target(name=name) for name in GRAMMARS}
