"""What a launch file's tag sees where it stands: arguments, namespace, remaps; and `$(…)` as far as it is literal."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePosixPath

from lxml import etree
from pydantic import Field

from grader.model.package import LaunchParam
from grader.model.record import Record

_SUBSTITUTION = re.compile(r"\$\(([^()]*)\)")
_SLASHES = re.compile(r"//+")
# Of one value: arguments that name each other can double at every step.
_LETTERS = 4_000
_TRUE, _FALSE = frozenset({"true", "1"}), frozenset({"false", "0"})

Remaps = tuple[tuple[str, str], ...]


class Scope(Record):
    """`own` are the package's names, the first its usual one; `private` are `<param name="~…">` for later nodes.

    `uncertain`: an `if` or `unless` that only roslaunch can work out decides whether the tag counts.
    """

    file: str
    own: tuple[str, ...]
    namespace: str = "/"
    args: Mapping[str, str] = Field(default_factory=dict)
    remaps: Remaps = ()
    private: tuple[LaunchParam, ...] = ()
    uncertain: bool = False

    def text(self, written: str) -> str:
        """`$(arg …)`, `$(dirname)` and `$(optenv NAME DEFAULT)` resolved; what only roslaunch knows stays as it is."""
        text = _SUBSTITUTION.sub(lambda match: self._value(match[0], match[1].split()), written[:_LETTERS])
        return text[:_LETTERS]

    def get(self, element: etree._Element, name: str) -> str | None:
        """An attribute resolved, None where it is not there."""
        written = element.get(name)
        return None if written is None else self.text(written)

    def of(self, element: etree._Element) -> Scope:
        """The scope in the element, as far as its own conditions go."""
        conditions = f"{self.get(element, 'if') or ''}{self.get(element, 'unless') or ''}"
        return self.model_copy(update={"uncertain": True}) if "$(" in conditions else self

    def below(self, namespace: str | None) -> Scope:
        """The scope in a group, node or include with this `ns`."""
        if not namespace:
            return self
        whole = namespace if namespace.startswith("/") else f"{self.namespace}{namespace}"
        return self.model_copy(update={"namespace": _SLASHES.sub("/", f"/{whole[:_LETTERS]}/")})

    def resolved(self, name: str) -> str:
        """A parameter's whole name."""
        whole = name if name.startswith("/") else f"{self.namespace}{name}"
        return _SLASHES.sub("/", whole.rstrip("/") or "/")

    def own_path(self, path: str) -> str | None:
        """The package's own path behind `$(find <package>)/…`, None for any other."""
        found = re.fullmatch(r"\$\(find\s+([^()\s]+)\s*\)/+(.+)", path.strip())
        return _plain(found[2]) if found and found[1] in self.own else None

    def _value(self, whole: str, words: list[str]) -> str:
        match words:
            case ["arg", name] if name in self.args:
                return self.args[name]
            case ["dirname"] if self.own:
                folder = PurePosixPath(self.file).parent.as_posix()
                return f"$(find {self.own[0]})" + ("" if folder == "." else f"/{folder}")
            case ["optenv", _, *default] if default:
                return " ".join(default)
        return whole


def wanted(element: etree._Element, scope: Scope | None = None) -> bool:
    """False where `if` or `unless` switches the element off; what is not known before run time does not."""
    on, off = (element.get(name) or "" for name in ("if", "unless"))
    if scope is not None:
        on, off = scope.text(on), scope.text(off)
    return on.strip().lower() not in _FALSE and off.strip().lower() not in _TRUE


def _plain(path: str) -> str | None:
    """`launch/../config/a.yaml` as `config/a.yaml`; None where it leads out of the package."""
    parts: list[str] = []
    for part in PurePosixPath(path).parts:
        if part == ".." and not parts:
            return None
        if part == "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return "/".join(parts)
