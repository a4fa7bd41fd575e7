"""XML of unknown origin: lxml for structure and lines; no entities, no DTD, no network, no huge trees."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from itertools import islice

from lxml import etree

from grader.line_slips.python_habits import LFS_BEGINS, LFS_POINTER, MERGED, Reason
from grader.line_slips.text import LineSlip, changed_line, doubled_and_turned
from grader.line_slips.xml import ATTRIBUTES, DECLARATION, TAGS, slips_of
from grader.model.file_fault import Fault

TYPOGRAPHIC = re.compile("[\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u2033\u00ab\u00bb]")

NO_END = r"Premature end of data in tag (\S+) line (\d+)"
_NO_NAME = "unparsable"
"""What libxml2 calls a tag without a name."""
_MISMATCH = r"tag mismatch: (\S+) line (\d+) and ([^\s,]+)"
_NO_QUOTE = (r"Unescaped '<' not allowed in attr", r"AttValue: ['\"] expected")
NEVER_ENDED = "a comment is opened by `<!--` and never closed"
# libxml2's message and what it means ({0}, {1}: the pattern's groups, {root}: the root tag)
_CAUSES: tuple[tuple[str, ...], ...] = (
    (r"Document is empty", "the file is empty", "write `<{root}>` and `</{root}>` into it"),
    (r"Start tag expected", "there is something before the first tag", "the file must start with `<{root}>`"),
    (NO_END, "`<{0}>` on line {1} is never closed", "add `</{0}>`"),
    (r"hyphen|must not contain '--'", "`--` is not allowed inside a comment `<!-- ... -->`", "delete it there"),
    (r"Comment not terminated", NEVER_ENDED, "write `-->` where it ends"),
    (r"Extra content at the end",
     "text comes after the first block", "delete it, since only one `<{root}>` is allowed"),
    (r"XML declaration allowed only", "something comes before `<?xml ... ?>`", "delete it, blank lines too"),
    (r"Unsupported version '(.*)'|Malformed declaration expecting version",
     "the only version of XML that is read here is 1.0", 'write `<?xml version="1.0"?>` for that line'),
    (r"Attribute (\S+) redefined", "the attribute `{0}` is given twice in one tag", "delete one of the two"),
    (_NO_QUOTE[0],
     "a closing quote is missing, so that the value runs on into the next tag", 'write `"` where it ends'),
    (_NO_QUOTE[1], "a closing quote is missing", 'write `"` where the value ends'),
    (r"AttValue: \" or ' expected", "the value of an attribute has no quotes around it", 'write name="value"'),
    (r"Specification mandates value for attribute (\S+)", "`{0}` has no value", 'write {0}="..."'),
    (r"invalid element name", "a `<` does not begin a tag",
     "delete the space after it, or write `&lt;` instead of `<`"),
    (r"EntityRef|Entity '.*' not defined", "a plain `&` is not allowed", "write `&amp;`"),
    (r"Unsupported encoding:? ?([^\s,]*)", "`{0}` is not the name of an encoding",
     'write `<?xml version="1.0" encoding="utf-8"?>` for that line'),
    (r"character encoding|not proper UTF-8|switch encoding",
     "the file is not saved in the encoding that it names", "save it as UTF-8"),
    (r"Invalid character|invalid Char|xmlChar", "an invisible control character", "type the line again"),
    (r"[Ee]ntity", "entities are not read", "write the text out"),
    (r"Excessive depth", "tags are nested more than 250 deep"),
    (r"Namespace prefix (\S+)", "`{0}:` is in front of a name", "remove it, since names have no colons"),
)  # fmt: skip


# A tag where it begins, after all in which a `<` begins none. What has no end, as it seems in the bytes of another
# encoding, goes on to the last byte: it is looked for once.
_TAGS = re.compile(
    rb"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)"
    rb"|<!DOCTYPE[^\[>]*(?:\[.*?(?:\]\s*>|\Z)|>|\Z)|(?P<tag><)[^\s/>!?]",
    re.DOTALL,
)
_VERSION = re.compile(rb"\A((?:\xef\xbb\xbf)?<\?xml\s+version\s*=\s*[\"'])[\w.:-]*([\"'])")
_ENCODING = re.compile(rb"\A(<\?xml\b[^>]{0,80}?\sencoding\s*=\s*[\"'])([\w.:-]{1,20})(?=[\"'])")
_MESSAGE_CHARS_MAX = 300
_TAGS_MAX = 2_000
_OPENERS_A_TAG = 20
_MESSAGES = 50
_LAST_LINE = 65_535
_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)
_SLIPS_CHARS_MAX = 20_000
_SLIPS_LINES_MAX = 300
_FURTHER_CHARS = 4
_OF_TEXT = ("param", "rosparam", "arg")


def parse_xml(
    data: bytes, file: str, *, root: str, encoding: str | None = None
) -> tuple[etree._Element | None, Fault | None]:
    """Return the root element, or None and the fault. `root` is the tag that the file should begin with.

    `encoding` overrides what the file says of itself. Nothing that a file declares is expanded or fetched, and
    nothing of more than `_TAGS_MAX` tags is looked at.
    """
    if data.count(b"<") > _OPENERS_A_TAG * _TAGS_MAX:
        return None, _too_many(file)
    parser = _parser(encoding)
    # catkin and roslaunch read a file of any version, and know encodings by the names that Python has for them
    readable = _ENCODING.sub(_as_libxml_names_it, _VERSION.sub(rb"\g<1>1.0\g<2>", data, count=1))
    try:
        element = etree.fromstring(readable, parser)
    except etree.XMLSyntaxError as error:
        return None, _fault(error, parser, data, file, root)
    dtd = element.getroottree().docinfo.internalDTD
    if dtd is not None and dtd.entities():  # type: ignore[union-attr] # lxml-stubs lack it
        words = {"cause": "`<!ENTITY ...>` is not read", "message": "declares entities"}
        fix = "delete the `<!DOCTYPE ...>` block and write the text out"
        return None, Fault(file=file, line=1, kind="Entity", fix=fix, **words)
    if sum(1 for _ in element.iter(etree.Element)) > _TAGS_MAX:
        return None, _too_many(file)
    _set_first_lines(element, data)
    return element, None


def _as_libxml_names_it(declared: re.Match[bytes]) -> bytes:
    try:
        name = codecs.lookup(declared[2].decode("ascii", "replace")).name
    except LookupError:
        return declared[0]
    return (
        declared[1] + name.replace("iso8859", "iso-8859").encode()
        if name.startswith("iso8859-")
        else declared[0]
    )


def parse_what_is_left(data: bytes) -> etree._Element | None:
    """Return what a lenient parser makes of a file that is not well-formed; None where that is nothing, or too much."""
    try:
        element = etree.fromstring(data, _parser(None, recover=True))
    except etree.XMLSyntaxError:
        return None
    few = element is not None and sum(1 for _ in element.iter(etree.Element)) <= _TAGS_MAX
    return element if few else None


def _parser(encoding: str | None, *, recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        dtd_validation=False,
        attribute_defaults=False,
        no_network=True,
        huge_tree=False,
        encoding=encoding,
        recover=recover,
    )


def _too_many(file: str) -> Fault:
    cause = f"`{file}` holds more than {_TAGS_MAX} tags and was not read"
    return Fault(file=file, line=None, kind="TooLarge", message="too many tags", cause=cause)


def _set_first_lines(root: etree._Element, data: bytes) -> None:
    """Move each element's line from where its tag ends, which is what libxml2 notes, to where it begins."""
    line, place, lines = 1, 0, []
    for found in _TAGS.finditer(data):
        if found["tag"]:
            line += data.count(b"\n", place, found.start())
            place = found.start()
            lines.append(line)
    elements = list(root.iter(etree.Element))
    if len(lines) == len(elements):  # in UTF-16, say, they are not
        for element, number in zip(elements, lines, strict=True):
            if number > _LAST_LINE:  # libxml2 keeps no larger number in an element
                break
            element.sourceline = number  # type: ignore[assignment] # lxml-stubs say `...`


def line_of(element: etree._Element) -> int | None:
    """Return the line where the element begins."""
    line = element.sourceline
    return line if isinstance(line, int) else None


def _fault(error: etree.XMLSyntaxError, parser: etree.XMLParser, data: bytes, file: str, root: str) -> Fault:
    line, column = error.position
    said = (error.msg or "not well-formed").strip()
    short = said[:_MESSAGE_CHARS_MAX] + said[_MESSAGE_CHARS_MAX:][-40:]
    message = re.sub(r", line \d+, column \d+$", "", short).strip()
    text = _line(data, line)
    of_root = _never_opened(message, data, root)
    slip = None if of_root else find_slip(data.decode("utf-8", "replace"), root)
    if slip is not None:
        words = {"cause": slip.why[:_MESSAGE_CHARS_MAX], "fix": slip.fix[:_MESSAGE_CHARS_MAX]}
        return Fault(file=file, line=slip.number, kind="XMLSyntaxError", message=message, **words)
    known = 0 < column <= len(text) + 1
    # the error's own log holds what went wrong with other files before, too
    log = [str(entry.message)[:_MESSAGE_CHARS_MAX] for entry in islice(parser.error_log, _MESSAGES)]
    by_text = _closed_early(message, data, root) or _never_begun(message, data, line)
    reason, opened = by_text or _stands_for_another(message, text) or _explain(message, log, text, root=root)
    if reason.why == NEVER_ENDED:  # libxml2 says where the file ends
        opened = data[: data.rfind(b"<!--")].count(b"\n") + 1
    reason = _by_columns(reason, data, opened) if opened else reason
    if opened and opened != line:
        line, text = opened, _line(data, opened)
        column = text.find("<") + 1
        known = column > 0
    reason = of_root or reason
    return Fault(
        file=file,
        line=line or None,
        column=column if known else None,
        kind="XMLSyntaxError",
        message=message[:_MESSAGE_CHARS_MAX],
        cause=reason.why[:_MESSAGE_CHARS_MAX],
        fix=reason.fix[:_MESSAGE_CHARS_MAX],
        source=text.rstrip("\r") if known else "",
    )


def _never_opened(message: str, data: bytes, root: str) -> Reason | None:
    """Return what is to be said where other tags stand outside of the root's, which is never opened; None where it is,
    or where one tag holds all the others."""
    text = data.decode("utf-8", "replace")
    first = first_tag(text, root)
    if "Extra content at the end" not in message or first is None:
        return None
    return Reason(f"`<{root}>` is missing", f"above line {first + 1}, write `{opening_tag(text, root)}`")


def _closed_early(message: str, data: bytes, root: str) -> tuple[Reason, int] | None:
    """Return what is to be said, with the line, where the root's end comes above other tags of its own; None where
    what follows begins another root."""
    plain = _without_comments(data.decode("utf-8", "replace"))
    before, end, behind = plain.partition(f"</{root}>")
    if "Extra content at the end" not in message or not end or not re.match(r"\s*<\w", behind):
        return None
    if re.match(rf"\s*<{re.escape(root)}[\s>/]", behind):
        return None
    number = before.count("\n") + 1
    why = f"`{end}` on line {number} ends the file, and more tags come below it"
    if end in behind:
        return Reason(why, f"delete that one, since there is another `{end}` further down"), number
    return Reason(why, f"move that `{end}` to the end of the file"), number


def _never_begun(message: str, data: bytes, line: int) -> tuple[Reason, int] | None:
    """Return what is to be said, with the line, of a tag that is closed in this line and begins nowhere above."""
    found = re.search(_MISMATCH, message)
    plain = _without_comments(data.decode("utf-8", "replace")).split("\n")[:line]
    tag, above = found[3] if found is not None else "", "\n".join(plain)
    begun = re.findall(rf"<{re.escape(tag)}\b[^<>]*(?<!/)>", above)
    if (
        found is None
        or len(begun) >= above.count(f"</{tag}>")
        or get_close_matches(tag, [found[1]], cutoff=0.7)
    ):
        return None
    fix = f"write the `<{tag} …>` that is missing above it, or delete `</{tag}>`"
    return Reason(f"`</{tag}>` closes nothing: no `<{tag}>` is open there", fix), line


def sub_comments(new: Callable[[re.Match[str]], str], text: str) -> str:
    """Return the text with each of its comments replaced."""
    end = text.rfind("-->") + len("-->")  # behind it, the end of each `<!--` is not to be found
    return _COMMENT.sub(new, text[:end]) + text[end:]


def _without_comments(text: str) -> str:
    """Return the text with the newlines alone of its comments."""
    return sub_comments(lambda found: "\n" * found[0].count("\n"), text)


def opening_tag(text: str, root: str) -> str:
    """Return the root's tag; that of a manifest with the format that its other tags are of (REP 127, 140)."""
    is_later = root == "package" and re.search(r"<(exec_)?depend>", text)
    return f'<{root} format="2">' if is_later else f"<{root}>"


def first_tag(text: str, root: str) -> int | None:
    """Return the line, from 0, of the first tag of a file that never opens its root's; None where it does."""
    plain = _without_comments(text)
    lines = (n for n, line in enumerate(plain.split("\n")) if re.match(r"\s*<\w", line))
    return None if re.search(rf"<{re.escape(root)}[\s>/]", plain) else next(lines, None)


def _line(data: bytes, number: int) -> str:
    line = b"".join(data.split(b"\n")[max(0, number - 1) : max(0, number)])
    return line[:_MESSAGE_CHARS_MAX].decode("utf-8", "replace")


_JOINED = re.compile(r"(node|param|rosparam|arg|remap|include|group)[-_.]?(pkg|type|name|file|from|ns|value)")
"""A tag's name and its first attribute, without the space between them."""


def _explain(message: str, log: list[str], line: str, *, root: str) -> tuple[Reason, int | None]:
    """Return libxml2's message in plain words, with the line of the tag that is not ended where it is that: libxml2
    says where it noticed. `log` holds all its messages, `line` the text of the faulty line."""
    if line.startswith((LFS_BEGINS, "<<<<<<<", "=======", ">>>>>>>")):
        merged = Reason(MERGED, "keep one version and delete the markers")
        return LFS_POINTER if line.startswith(LFS_BEGINS) else merged, None
    if "AttValue" in message and (quote := TYPOGRAPHIC.search(line)):
        why = f"a typographic quote {quote[0]} was copied from a PDF or a web page"
        return Reason(why, 'type plain quotes (")'), None
    if mismatch := re.search(_MISMATCH, message):
        return _mismatch(mismatch[1], int(mismatch[2]), mismatch[3], root)
    begun = next(filter(None, (re.search(r"end of Start Tag (\S+) line (\d+)", m) for m in log)), None)
    at = int(begun[2]) if begun else None
    if begun and re.search("attribute name|attributes construct", message):
        fix = "it needs a space before each attribute, quotes round each value, and `>` or `/>` at its end"
        if joined := _JOINED.fullmatch(begun[1]):
            fix = f"write `<{joined[1]} {joined[2]}`: without that space, `{begun[1]}` is the tag's name"
        return Reason(f"the tag `<{begun[1]}` is not finished properly", fix), at
    for pattern, *words in _CAUSES:
        if found := re.search(pattern, message):
            reason = Reason(*(text.format(*found.groups(), root=root) for text in words))
            return reason, int(found[2]) if pattern == NO_END else at if pattern in _NO_QUOTE else None
    return Reason(), None


def _mismatch(opened: str, line: int, closed: str, root: str) -> tuple[Reason, int | None]:
    tag, capitals = f"`<{opened}>` on line {line}", opened.lower() == closed.lower()
    if capitals or get_close_matches(closed, [opened], cutoff=0.7):
        other = ", with other capital letters" if capitals else ""
        return Reason(f"{tag} is closed by `</{closed}>`{other}", f"write `</{opened}>`"), None
    if opened == root:
        why = f"`</{closed}>` closes nothing, since only {tag} is open here"
        return Reason(why, f"delete `</{closed}>`"), None
    fix = f"end it with `/>` or with `</{opened}>`"
    return Reason(f"{tag} is still open where `</{closed}>` comes", fix), line


def _stands_for_another(message: str, line: str) -> tuple[Reason, None] | None:
    """Return what is wrong with `type="<your script>"`, as handouts write it; None for another fault."""
    found = re.search(r"=\s*[\"'](<[^<>=\"']+>)[\"']", line) if "Unescaped '<'" in message else None
    why = f"`{found[1]}` stands for what you have to write there" if found else ""
    return (Reason(why, "write that in its place, without `<` and `>`"), None) if found else None


def _by_columns(reason: Reason, data: bytes, line: int) -> Reason:
    """Return the reason for a tag that is not closed with the place where that belongs, where its columns show it."""
    end = end_of_children(data.decode("utf-8", "replace").split("\n"), line)
    tag = re.search(r"or with `(</\w+>)`$", reason.fix)
    return reason._replace(fix=f"above line {end}, write `{tag[1]}`") if end and tag else reason


def end_of_children(lines: Sequence[str], line: int) -> int | None:
    """Return the line above which a tag belongs closed that begins in `line`, both from 1, and has other tags below it,
    as their columns show; None where it has none."""
    begun = re.match(r"(\s*)<(?:node|group|include|test|export)\b", lines[line - 1])
    tags = [(n, one) for n, one in enumerate(lines[line:], line + 1) if re.match(r"\s*<(?!!)", one)]
    if begun is None or not tags:
        return None
    column = len(begun[1].expandtabs())
    ends = next(
        (n for n, one in tags if len(one.expandtabs()) - len(one.expandtabs().lstrip()) <= column), None
    )
    return ends if ends != tags[0][0] else None


# ---- slips of one line


def find_slip(text: str, root: str) -> LineSlip | None:
    """Return the one slip near the first error without which a file is a good one, or is read further; None where there
    is no error, no such slip, or what the parser says of the error is the slip."""
    if len(text) > _SLIPS_CHARS_MAX or re.search(r"^(<{7}|={7}|>{7})", text, re.MULTILINE):
        return None
    _, error = _tried(text)
    message = error.msg or "" if error is not None else ""
    mismatch = re.search(_MISMATCH, message)
    if error is None or (mismatch and _is_closed_wrongly(mismatch[1], mismatch[3], root)):
        return None
    at, further = error.position, None
    for slip in _slips_near(at[0], message, text, root):
        element, later = _tried(slip.text)
        if element is not None and not _strange_things(element, root):
            return slip
        if later is not None and _is_later(later.position, at) and further is None and slip.is_within:
            further = slip
    return further


def _is_later(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether a parser came further: to a later line, or on the same one so much further that what it passed is
    more than the slip itself."""
    return one[0] > other[0] or (one[0] == other[0] and one[1] > other[1] + _FURTHER_CHARS)


def find_strange(text: str, root: str) -> LineSlip | None:
    """Return a slip that leaves a file well-formed, and makes a tag or an attribute one that there is none of, or text:
    `<Node …/>`, `node …/>`; None where there is no such slip."""
    element, _ = _tried(text) if len(text) <= _SLIPS_CHARS_MAX else (None, None)
    before = _strange_things(element, root) if element is not None else 0
    lines = text.split("\n")
    for number in range(1, min(len(lines), _SLIPS_LINES_MAX) + 1) if before else ():
        for slip in _slips_in(lines, number, root):
            changed, _ = _tried(slip.text)
            if changed is not None and _strange_things(changed, root) < before:
                return slip
    return None


def _is_closed_wrongly(opened: str, closed: str, root: str) -> bool:
    """Return whether a tag that there is has a slip where it is closed."""
    return opened in TAGS.get(root, ()) and bool(get_close_matches(closed.lower(), [opened], cutoff=0.7))


def _tried(text: str) -> tuple[etree._Element | None, etree.XMLSyntaxError | None]:
    """Return the root of a text, or None and its first error."""
    try:
        return etree.fromstring(text.encode(errors="replace"), _parser("utf-8")), None
    except etree.XMLSyntaxError as error:
        return None, error


def _slips_near(at: int, message: str, text: str, root: str) -> Iterator[LineSlip]:
    """Yield the slips of the lines that the parser named and of those beside them."""
    lines = text.split("\n")
    mismatch = re.search(_MISMATCH, message)
    opened, closed = (mismatch[1], mismatch[3]) if mismatch else ("", "")
    begun = re.compile(
        rf"\s*(?:[^\w\s<]?(?:{re.escape(closed)}\b[^<]*|/{re.escape(opened)}\s*)|<{re.escape(opened)}\s*/)>"
    )
    told = [at, *map(int, re.findall(r"line (\d+)", message))]
    hidden = re.compile(rf"\s*<!--+\s*<{re.escape(closed)}\b[^<>]*(?<!/)>\s*--+>")
    told += [n for n, line in enumerate(lines, 1) if mismatch and (begun.match(line) or hidden.match(line))]
    if re.search("omment|hyphen|'--'", message):
        told += [n for n, line in enumerate(lines, 1) if "<!--" in line and "-->" not in line]
    named = [number for number in told if 0 < number <= len(lines)]
    above = [max((n for n in range(1, number) if lines[n - 1].strip()), default=0) for number in named]
    near = [number for number in dict.fromkeys((*named, *above)) if number]
    if closed == _NO_NAME:
        for number in (n for n, line in enumerate(lines, 1) if "</>" in line):
            line = lines[number - 1].replace("</>", f"</{opened}>", 1)
            yield changed_line(lines, number, line, "the name of the closing tag is missing")
    for number in near:
        yield from _slips_in(lines, number, root)
    yield from _declarations(lines, root)
    yield from _second_roots(lines, root)
    yield from doubled_and_turned(lines, near)


def _slips_in(lines: list[str], number: int, root: str) -> Iterator[LineSlip]:
    return (changed_line(lines, number, line, why) for why, line in slips_of(lines[number - 1], root))


def _declarations(lines: list[str], root: str) -> Iterator[LineSlip]:
    """Yield the lines with a good `<?xml … ?>` as their first one, where it is not, or not the first."""
    at = next((n for n, line in enumerate(lines) if n and line.lstrip().startswith("<?xml")), 0)
    if at and any(lines[:at]):
        moved = "\n".join([lines[at].lstrip(), *lines[:at], *lines[at + 1 :]])
        why, fix = "`<?xml … ?>` stands below another line", f"make line {at + 1} the first line of the file"
        yield LineSlip(why, at + 1, fix, moved)
    if re.search(r"xml|version|1\.0", lines[0]) and f"<{root}" not in lines[0]:
        whole = "\n".join([DECLARATION, *lines[1:]])
        yield LineSlip("the first line has a slip", 1, f"write `{DECLARATION}`", whole)


def _second_roots(lines: list[str], root: str) -> Iterator[LineSlip]:
    """Yield the lines with what two blocks hold in one, if that is not the same twice."""
    said = [(number, line.strip()) for number, line in enumerate(lines, 1) if line.strip()]
    ends = [
        i for i, (_, line) in enumerate(said[:-1]) if line == f"</{root}>" and said[i + 1][1] == f"<{root}>"
    ]
    if len(ends) == 1:
        at, (end, begin) = ends[0], (said[ends[0]][0], said[ends[0] + 1][0])
        blocks = [
            [line for _, line in part if not line.startswith("<?")]
            for part in (said[: at + 1], said[at + 1 :])
        ]
        left = "\n".join("" if number in {end, begin} else line for number, line in enumerate(lines, 1))
        if blocks[0] != blocks[1]:
            fix = f"delete lines {end} and {begin}, `</{root}>` and `<{root}>`"
            yield LineSlip(f"only one `<{root}>` is allowed, and another one begins here", begin, fix, left)


def _strange_things(root: etree._Element, name: str) -> int:
    """Return how many tags and attributes there are of which there are none in such a file, and how many pieces of text
    where none belongs, or that look like a tag."""
    strange = int(root.tag != name)
    inner = [e for e in root.iter(etree.Element) if name == "launch" or e in (root, *root)]
    for element in inner:
        tag = str(element.tag)
        known = ATTRIBUTES.get(name, {}).get(tag, ())
        strange += (tag not in TAGS[name] if name in TAGS else 0) or (tag == name and element is not root)
        for one, value in element.attrib.items() if known else ():
            strange += (one not in known) + bool(re.search(r"[\"'>]|<(?![\s=\d])", str(value)))
        holds_tags = element is root or (name == "launch" and tag not in _OF_TEXT)
        texts = [element.text or "", *(child.tail or "" for child in element)]
        # `>` or `-->` alone, where tags belong, is nothing to who reads the file.
        strange += sum(re.search(r"\w", one) is not None if holds_tags else ">" in one for one in texts)
    return strange
