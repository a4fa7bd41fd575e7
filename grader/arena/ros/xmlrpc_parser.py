"""Reads XML-RPC as ROS's clients write it, and nothing that is made to break a reader.

What is left out no client of ROS sends: document types, entities, comments, elements with long attributes, other
encodings than UTF-8, `nil`, numbers that do not fit into 32 bits, names that are not text. The parser is expat, the
rest Python's own `xmlrpc.client`.
"""

import re
import xmlrpc.client
from xml.parsers import expat

ELEMENTS_MAX = 200000
DEPTH_MAX = 120
"""Of elements: a value inside of a value takes four or five."""
# `int` takes time with the square of the number of digits.
DIGITS_MAX = 40
TAG_BYTES_MAX = 200
PIECE_BYTES = 1 << 16
"""Read at once: other threads have their turn in between."""
_LONG_TAG = re.compile(rb"<[^<>]{%d}" % TAG_BYTES_MAX)
_LEFT_OUT = ("nil", "i1", "i2", "biginteger", "bigdecimal")


class Malformed(ValueError):
    """No XML-RPC that a client of ROS would send; says what it is in a few words."""


def read(data):
    """Return (values, method name or None) of a whole call or answer; raise Malformed, or the xmlrpc.client.Fault in
    it."""
    if b"\0" in data:  # two bytes a character, too: what follows looks for one
        raise Malformed("bytes that are not text")
    if b"<!" in data:
        raise Malformed("a document type, entities or comments")
    for start in range(0, len(data), PIECE_BYTES):
        # The pieces overlap by one tag, so that none hides between two.
        if _LONG_TAG.search(data, start, start + PIECE_BYTES + TAG_BYTES_MAX):
            raise Malformed("an element with more than a name")
    target = _Unmarshaller()
    try:
        _parse(data, target)
        return target.close(), target.getmethodname()
    except xmlrpc.client.Fault:
        raise
    except Malformed:
        raise
    except Exception as error:
        raise Malformed("no XML-RPC ({})".format(type(error).__name__)) from error


def _parse(data, target):
    elements = depth = 0

    def start(tag, attributes):
        nonlocal elements, depth
        elements += 1
        depth += 1
        if elements > ELEMENTS_MAX:
            raise Malformed("more than {} elements".format(ELEMENTS_MAX))
        if depth > DEPTH_MAX:
            raise Malformed("values nested too deeply")
        target.start(tag, attributes)

    def end(tag):
        nonlocal depth
        depth -= 1
        target.end(tag)

    # The parser has turned everything into text already: no encoding is left to be applied.
    target.xml(None, None)
    parser = expat.ParserCreate("UTF-8")
    parser.buffer_text = True
    # `read` has refused these already: a second wall, should expat know other ways to write them.
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = _refuse
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = target.data
    for piece in range(0, len(data), PIECE_BYTES):
        parser.Parse(data[piece : piece + PIECE_BYTES], False)
    parser.Parse(b"", True)


def _refuse(*_):
    raise Malformed("a document type, entities or comments")


class _Unmarshaller(xmlrpc.client.Unmarshaller):
    def end_number(self, data):
        if len(data) > DIGITS_MAX or not xmlrpc.client.MININT <= int(data) <= xmlrpc.client.MAXINT:
            raise Malformed("a number that is too large")
        self.append(int(data))
        self._value = 0

    def end_map(self, data):
        mark = self._marks[-1]
        if not all(isinstance(name, str) for name in self._stack[mark::2]):
            raise Malformed("a name that is not a string")
        self.end_struct(data)


_Unmarshaller.dispatch = dict(
    {tag: end for tag, end in xmlrpc.client.Unmarshaller.dispatch.items() if tag not in _LEFT_OUT},
    int=_Unmarshaller.end_number,
    i4=_Unmarshaller.end_number,
    i8=_Unmarshaller.end_number,
    struct=_Unmarshaller.end_map,
)
