"""Elements of an XML file with their exact places, for edits that keep everything else as it is."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from grader.authoring.mutation.text_edits import Edit, whole_lines

ATTRIBUTE = re.compile(rb"""([\w:.-]+)\s*=\s*("[^"]*"|'[^']*')""")
START_TAG = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*>""")


@dataclass(kw_only=True)
class Element:
    """`start` to `end` is the whole element, `inner` what begins after its start tag; places in bytes."""

    tag: str
    attributes: dict[str, str]
    start: int
    inner: int
    end: int = 0
    parent: Element | None = None
    children: list[Element] = field(default_factory=list)

    def all(self) -> Iterator[Element]:
        yield self
        for child in self.children:
            yield from child.all()


class Document:
    """An XML file. Raises ValueError where it is not well-formed."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self._open: list[Element] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._started
        self._parser.EndElementHandler = self._ended
        self.root: Element | None = None
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            raise ValueError(str(error)) from error

    def _started(self, tag: str, attributes: dict[str, str]) -> None:
        start = self._parser.CurrentByteIndex
        match = START_TAG.match(self.data, start)
        inner = match.end() if match else start
        parent = self._open[-1] if self._open else None
        element = Element(tag=tag, attributes=attributes, start=start, inner=inner, parent=parent)
        if parent is None:
            self.root = element
        else:
            parent.children.append(element)
        self._open.append(element)

    def _ended(self, _tag: str) -> None:
        element = self._open.pop()
        closed_itself = self.data[: element.inner].endswith(b"/>")
        index = self._parser.CurrentByteIndex
        element.end = element.inner if closed_itself else self.data.index(b">", index) + 1

    def elements(self, *tags: str) -> list[Element]:
        return [e for e in (self.root.all() if self.root else ()) if e.tag in tags]

    @property
    def text(self) -> str:
        """One character a byte, so that places are the parser's."""
        return self.data.decode("latin-1")

    def content(self, element: Element) -> str:
        """Return the element's own text, without the space around it."""
        end = self.data.rfind(b"</", element.inner, element.end)
        return self.data[element.inner : max(end, element.inner)].decode(errors="replace").strip()

    def line(self, element: Element) -> int:
        return self.data.count(b"\n", 0, element.start) + 1

    # ---- edits, in places of `text`

    def remove(self, element: Element) -> Edit:
        return Edit(*whole_lines(self.text, element.start, element.end), "")

    def set_content(self, element: Element, content: str) -> Edit:
        end = self.data.rfind(b"</", element.inner, element.end)
        return Edit(element.inner, end, content)

    def set_attribute(self, element: Element, name: str, value: str) -> Edit:
        start, end = self._attribute(element, name)
        return Edit(start, end, f'{name}="{value}"')

    def remove_attribute(self, element: Element, name: str) -> Edit:
        start, end = self._attribute(element, name)
        while self.data[start - 1 : start].isspace():
            start -= 1
        return Edit(start, end, "")

    def _attribute(self, element: Element, name: str) -> tuple[int, int]:
        found = ATTRIBUTE.finditer(self.data, element.start, element.inner)
        return next(m.span() for m in found if m[1].decode() == name)
