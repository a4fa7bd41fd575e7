"""XML of unknown origin: lxml for structure and lines; no entities, no DTD, no network, no huge trees."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from difflib import get_close_matches
from itertools import islice

from lxml import etree

from grader.model.package import Fault
from grader.syntax_fixes import Reason

_TYPOGRAPHIC = re.compile("[\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u2033\u00ab\u00bb]")

_NO_END = r"Premature end of data in tag (\S+) line (\d+)"
_NO_QUOTE = (r"Unescaped '<' not allowed in attr", r"AttValue: ['\"] expected")
# libxml2's message and what it means ({0}, {1}: the pattern's groups, {root}: the root tag)
_CAUSES: tuple[tuple[str, ...], ...] = (
    (r"Document is empty", "the file is empty", "write `<{root}>` and `</{root}>` into it"),
    (r"Start tag expected", "there is something before the first tag", "the file must start with `<{root}>`"),
    (_NO_END, "`<{0}>` on line {1} is never closed", "add `</{0}>`"),
    (r"hyphen|must not contain '--'", "`--` is not allowed inside a comment `<!-- ... -->`", "delete it there"),
    (r"Comment not terminated", "a comment is opened by `<!--` and never closed", "write `-->` where it ends"),
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
    (r"character encoding|not proper UTF-8|Unsupported encoding|switch encoding",
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
_MESSAGE_CHARS_MAX = 300
_TAGS_MAX = 2_000
_OPENERS_A_TAG = 20
_MESSAGES = 50
_LAST_LINE = 65_535


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
    try:
        element = etree.fromstring(data, parser)
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
    message = re.sub(
        r", line \d+, column \d+$", "", said[:_MESSAGE_CHARS_MAX] + said[_MESSAGE_CHARS_MAX:][-40:]
    ).strip()
    # the error's own log holds what went wrong with other files before, too
    text = _line(data, line)
    known = 0 < column <= len(text) + 1
    log = [str(entry.message)[:_MESSAGE_CHARS_MAX] for entry in islice(parser.error_log, _MESSAGES)]
    reason, opened = _explain(message, log, text, root=root)
    if opened and opened != line:
        line, text = opened, _line(data, opened)
        column = text.find("<") + 1
        known = column > 0
    reason = _opened_again(message, data, text, root) or _never_opened(message, data, root) or reason
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


def _opened_again(message: str, data: bytes, text: str, root: str) -> Reason | None:
    """Return what is to be said where the root's tag stands a second time, in place of the one that closes it; None
    where it does not."""
    twice = "end of data" in message and text.strip() == f"<{root}>" and f"</{root}>".encode() not in data
    if not twice or len(re.findall(rf"<{re.escape(root)}[\s>]".encode(), data)) < 2:
        return None
    return Reason(
        f"`<{root}>` opens the file a second time here, where it should end", f"write `</{root}>` for it"
    )


def _never_opened(message: str, data: bytes, root: str) -> Reason | None:
    """Return what is to be said where other tags stand outside of the root's, which is never opened; None where it is,
    or where one tag holds all the others."""
    text = data.decode("utf-8", "replace")
    first = _first_tag(text, root)
    if "Extra content at the end" not in message or first is None:
        return None
    return Reason(f"`<{root}>` is missing", f"above line {first + 1}, write `{_opening(text, root)}`")


def _opening(text: str, root: str) -> str:
    """Return the root's tag; that of a manifest with the format that its other tags are of (REP 127, 140)."""
    is_later = root == "package" and re.search(r"<(exec_)?depend>", text)
    return f'<{root} format="2">' if is_later else f"<{root}>"


def _first_tag(text: str, root: str) -> int | None:
    """Return the line, from 0, of the first tag of a file that never opens its root's; None where it does."""
    plain = _COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text)
    lines = (n for n, line in enumerate(plain.split("\n")) if re.match(r"\s*<\w", line))
    return None if re.search(rf"<{re.escape(root)}[\s>/]", plain) else next(lines, None)


def _line(data: bytes, number: int) -> str:
    lines = data.split(b"\n")
    return (
        lines[number - 1][:_MESSAGE_CHARS_MAX].decode("utf-8", "replace") if 0 < number <= len(lines) else ""
    )


def _explain(message: str, log: list[str], line: str, *, root: str) -> tuple[Reason, int | None]:
    """Return libxml2's message in plain words, with the line of the tag that is not ended where it is that: libxml2
    says where it noticed. `log` holds all its messages, `line` the text of the faulty line."""
    if line.startswith(("<<<<<<<", "=======", ">>>>>>>")):
        why = "git's merge markers (`<<<<<<<`) are still in the file"
        return Reason(why, "keep one version and delete the markers"), None
    if "AttValue" in message and (quote := _TYPOGRAPHIC.search(line)):
        why = f"a typographic quote {quote[0]} was copied from a PDF or a web page"
        return Reason(why, 'type plain quotes (")'), None
    if mismatch := re.search(r"tag mismatch: (\S+) line (\d+) and (\S+)", message):
        return _mismatch(mismatch[1], int(mismatch[2]), mismatch[3], root)
    begun = next(filter(None, (re.search(r"end of Start Tag (\S+) line (\d+)", m) for m in log)), None)
    at = int(begun[2]) if begun else None
    if begun and re.search("attribute name|attributes construct", message):
        fix = "it needs a space before each attribute, quotes round each value, and `>` or `/>` at its end"
        return Reason(f"the tag `<{begun[1]}` is not finished properly", fix), at
    for pattern, *words in _CAUSES:
        if found := re.search(pattern, message):
            reason = Reason(*(text.format(*found.groups(), root=root) for text in words))
            return reason, int(found[2]) if pattern == _NO_END else at if pattern in _NO_QUOTE else None
    return Reason(), None


def _mismatch(opened: str, line: int, closed: str, root: str) -> tuple[Reason, int | None]:
    tag = f"`<{opened}>` on line {line}"
    if opened.lower() == closed.lower():
        return Reason(
            f"{tag} is closed by `</{closed}>`, with other capital letters", f"write `</{opened}>`"
        ), None
    if get_close_matches(closed, [opened], cutoff=0.7):
        return Reason(f"{tag} is closed by `</{closed}>`", f"write `</{opened}>`"), None
    if opened == root:
        why = f"`</{closed}>` closes nothing, since only {tag} is open here"
        return Reason(why, f"delete `</{closed}>`"), None
    fix = f"end it with `/>` or with `</{opened}>`"
    return Reason(f"{tag} is still open where `</{closed}>` comes", fix), line


# ---- one edit that makes a file well-formed

EDITS_MAX = 4
"""The same slip is often in several tags, since one is copied from the other."""
_ATTRIBUTE = re.compile(r"(?<=\s)([\w:-]+)(\s*=\s*)(\"[^\"]*\"|'[^']*'|[^\s\"'<>/]+)")
_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def well_formed(text: str, file: str, *, root: str) -> list[str]:
    """Return the texts that lead to a well-formed file, an edit each, the last of them well-formed; nothing where it is
    so already, or no plain edits make it so."""
    steps: list[str] = []
    for _ in range(EDITS_MAX):
        _, fault = parse_xml((steps[-1] if steps else text).encode(), file, root=root)
        if fault is None:
            return steps
        at = _reached(fault)
        each = dict.fromkeys(_edits(steps[-1] if steps else text, fault, root))
        found = [(parse_xml(one.encode(), file, root=root)[1], one) for one in each]
        whole = next((one for later, one in found if later is None), None)
        further = next((one for later, one in found if later is not None and _reached(later) > at), None)
        if (best := whole or further) is None:
            return []
        steps.append(best)
    return steps if parse_xml(steps[-1].encode(), file, root=root)[1] is None else []


def _reached(fault: Fault) -> float:
    """Return how far the parser came: a tag that is never closed is noticed at the end."""
    return math.inf if "end of data" in fault.message else fault.line or 0


def _edits(text: str, fault: Fault, root: str) -> Iterator[str]:
    """Yield texts with one edit by what the parser said, the likeliest first."""
    message, lines = fault.message, text.split("\n")
    at = min(max((fault.line or 1) - 1, 0), len(lines) - 1)
    if fault.kind != "XMLSyntaxError" or lines[at].startswith(("<<<<<<<", "=======", ">>>>>>>")):
        return
    if mismatch := re.search(r"tag mismatch: (\S+) line (\d+) and (\S+)", message):
        yield from _matching(lines, mismatch[1], int(mismatch[2]) - 1, mismatch[3], root)
    elif unclosed := re.search(_NO_END, message):
        yield from _closed(lines, unclosed[1], int(unclosed[2]) - 1, root)
    elif re.search(r"hyphen|must not contain '--'", message):
        yield _COMMENT.sub(lambda found: f"<!--{re.sub(r'-(?=-)|-$', '- ', found[1])}-->", text)
    elif "EntityRef" in message:
        yield re.sub(r"&(?!#?\w+;)", "&amp;", text)
    elif "Extra content at the end" in message and (first := _first_tag(text, root)) is not None:
        end = [] if f"</{root}>" in text else [f"</{root}>", ""]
        yield "\n".join([*lines[:first], _opening(text, root), *lines[first:], *end])
    elif "XML declaration allowed only" in message:
        yield text.lstrip()
    last = at + 1 == len(lines) or lines[at + 1].lstrip().startswith("<")
    for line in (_quoted(lines[at]), *_ended(lines[at], last=last)):
        yield "\n".join([*lines[:at], line, *lines[at + 1 :]])


def _matching(lines: list[str], opened: str, line: int, closed: str, root: str) -> Iterator[str]:
    """Yield the lines with the right closing tag, or with the tag closed that is open."""
    closing = next((i for i in range(line, len(lines)) if f"</{closed}" in lines[i]), None)
    alike = opened.lower() == closed.lower() or bool(get_close_matches(closed, [opened], cutoff=0.7))
    if closing is not None and alike:
        right = lines[closing].replace(f"</{closed}", f"</{opened}", 1)
        yield "\n".join([*lines[:closing], right, *lines[closing + 1 :]])
    if closing is not None and opened == root:
        left = re.sub(rf"</{re.escape(closed)}\s*>", "", lines[closing], count=1)
        yield "\n".join([*lines[:closing], left, *lines[closing + 1 :]])
    yield from _closed(lines, opened, line, root)


def _closed(lines: list[str], tag: str, line: int, root: str) -> Iterator[str]:
    """Yield the lines with an open tag closed: by `/` before its `>`, all that are left open so, or behind its text."""
    text = "\n".join(lines)
    if tag == root:
        above, _, below = text.rpartition(f"<{root}>")
        if f"<{root}" in above and not below.strip():
            yield f"{above}</{root}>{below}"
        yield f"{text.rstrip()}\n</{root}>\n"
    elif tag == "group" and (end := text.rfind(f"</{root}>")) >= 0:
        yield f"{text[:end]}</{tag}>\n{text[end:]}"
    if tag in {root, "group"}:
        return
    begun = re.compile(rf"<{re.escape(tag)}\b[^<>]*(?<!/)>(?=\s*(?:<|\Z))")
    for found in begun.finditer(text):
        first, last = (text.count("\n", 0, place) for place in found.span())
        if first <= line <= last:
            yield f"{text[: found.end() - 1].rstrip()}/>{text[found.end() :]}"
    if f"</{tag}" not in text:
        yield begun.sub(lambda found: f"{found[0][:-1].rstrip()}/>", text)
    if 0 <= line < len(lines):
        yield "\n".join([*lines[:line], f"{lines[line].rstrip()}</{tag}>", *lines[line + 1 :]])


def _quoted(line: str) -> str:
    """Return the line with plain quotes around each value, and a space before each attribute."""
    plain = re.sub(
        r"<\s+(?=[\w/])|<<(?=\w)", lambda found: "</" if "/" in found[0] else "<", _TYPOGRAPHIC.sub('"', line)
    )
    apart = re.sub(r"(=\s*(?:\"[^\"]*\"|'[^']*'))(?=[\w-]+\s*=)", r"\1 ", plain)
    with_sign = re.sub(r"(?<=\s)([\w-]+)(?=\"[^\"]*\"(?:\s|/|>))", r"\1=", apart)
    return _ATTRIBUTE.sub(lambda m: m[0] if m[3][0] in "\"'" else f'{m[1]}{m[2]}"{m[3]}"', with_sign)


def _ended(line: str, *, last: bool) -> Iterator[str]:
    """Yield the line with a quote where a value can begin or end, and, if it is the tag's last, with the tag's end."""
    if line.count('"') % 2:
        places = [*re.finditer(r"\s+[\w-]+\s*=|\s*/?>|\s*$", line), *re.finditer(r"(?<==)(?=[^\s\"'])", line)]
        yield from (f'{line[: place.start()]}"{line[place.start() :]}' for place in places)
    bare = line.rstrip()
    yield re.sub(r"/\s+>$", "/>", bare)
    if not bare.endswith(">") and last:
        yield from (f"{bare.rstrip('/')}/>", f"{bare}>")
