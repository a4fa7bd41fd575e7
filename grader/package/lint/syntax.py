"""Reads Python files without running them: `syntax.py ROOT FILE...`, or the files as a JSON array on stdin.

Prints one JSON object a file, as soon as it is known, so that a file which crashes the interpreter can be
told: `{"file": ..., "faults": [{"kind", "line", "column", "message", "text", "opened", "mixed", "tab_size", "odd"}],
"slips": [{"line", "kind", "message"}]}`. `text` is the faulty line, `opened` the line of a bracket that is never
closed, `mixed` whether the file indents with tabs and with spaces, `tab_size` the size at which its tabs fit those
spaces, `odd` the only line that is not indented as all others are. Runs under ROS's own Python (3.8 and later),
standard library only; nothing is imported from ROOT.
"""

import ast
import contextlib
import functools
import io
import json
import keyword
import os
import posixpath
import re
import sys
import tokenize
import warnings

# `-I` leaves this folder out, and a limited child does not begin in it.
sys.path.append(os.path.dirname(os.path.abspath(__file__)))
from script_blocks import MARKER, TEXT_BEHIND, first_version, is_code, lacks_body, lacks_def, lacks_head
from script_tree import (
    TEXT_LIMIT,
    slip,
)
from slips import slips

try:
    import resource
except ImportError:  # Windows, where students look at their files
    resource = None

SIZE_LIMIT_BYTES = 2000000
MODULE_LIMIT_BYTES, IMPORTS_LIMIT = 50_000, 10
"""Of a module that only gives numbers their names, and of how many of them a script has."""
MEMORY_LIMIT_BYTES = 1 << 30
CPU_LIMIT_S = 20
MESSAGE_LIMIT = 500
ALL_SLIPS_LIMIT = 1000
"""Of all files together."""
PAIRS = {")": "(", "]": "[", "}": "{"}
BRACE = re.compile(
    r"\s*(\}\s*)?(if|elif|else|while|for|def|class|try|except|finally|with)\b(.*[\w\])\"])?\s*\{\s*(#.*)?$"
)
"""A block that begins as in C++: what Python says of it is said of a line below."""
ODD_LINES_MAX = 3
WORDS = re.compile(r"\s*[^\W\d][\w'-]{0,40},?(\s+[\w'-]{1,40}[,.]?){2,30}\s*$")
OUTERMOST = re.compile(r"(import|from)\s|if\s+__name__\b")
COMMENTED = re.compile(r"\s*#[#\s]*((?:if|while|for|def|class|try|with)\b.*:)\s*$")
"""The first line of a block, commented out: Python speaks of the line below, which stands too far in."""
REFUSED_LIMIT = 20
FURTHER_LIMIT, FURTHER_BYTES = 12, 100_000
"""So many more errors are looked for, in a file of no more than that: each compiles all of it again."""
OF_NAMES = ("node-name", "publisher", "publisher-type", "subscriber", "subscriber-type", "rate-number")
DEPTHS_MAX = 4
CPP = re.compile(rb"^#include\s*[<\"].*?^(int|void)\s+\w+\s*\(", re.MULTILINE | re.DOTALL)
NO_SCRIPTS = (
    (re.compile(rb"\xff\xfe|\xfe\xff"), "the file is UTF-16"),
    (
        re.compile(rb"\s*<(?:!doctype\s+html|html|head|body)\b", re.IGNORECASE),
        "a web page in a file for Python",
    ),
    (re.compile(rb"\s*<(?:\?xml|launch|robot|package)\b"), "XML in a file for Python"),
    (re.compile(rb"\s*\{.{0,200}\"(?:cells|nbformat)\"\s*:", re.DOTALL), "a notebook in a file for Python"),
    (re.compile(rb"\{\\rtf|PK\x03\x04|\xd0\xcf\x11\xe0"), "a document in a file for Python"),
    (re.compile(rb"%PDF-"), "a PDF in a file for Python"),
    (re.compile(rb"version https://git-lfs"), "a pointer in a file for Python"),
)
"""How files begin that were saved under a script's name."""
NUMBERED_LINES = 5
HEAD_OF_BLOCK = re.compile(r"(?:def|class|if|elif|else|while|for|try|except|with)\b.*:\s*$")
ENCODINGS = (SyntaxError, LookupError, UnicodeDecodeError)


def main(argv):
    if resource is not None:
        set_limits()
    for report in check_all(argv[1], argv[2:] or json.load(sys.stdin)):
        print(json.dumps(report), flush=True)


def check_all(root, names):
    """Yield the report on each file."""
    warnings.simplefilter("ignore")
    left = ALL_SLIPS_LIMIT
    for name in names:
        report = check(root, name, names, with_slips=left > 0)
        report["slips"] = report["slips"][:left]
        left -= len(report["slips"])
        yield report


def set_limits():
    """macOS refuses to limit a process's memory."""
    refused = () if sys.platform == "linux" else (OSError, ValueError)
    for limit, value in (
        (resource.RLIMIT_AS, MEMORY_LIMIT_BYTES),
        (resource.RLIMIT_CPU, CPU_LIMIT_S),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(*refused):
            resource.setrlimit(limit, (value, value))


def check(root, name, names=(), with_slips=True):
    """Return the report on a file; `names` are all of the package's that may be read."""
    report = {"file": name, "faults": [], "slips": []}
    try:
        with open(os.path.join(root, name), "rb") as file:
            data = file.read(SIZE_LIMIT_BYTES + 1)
    except OSError as error:
        report["faults"].append(fault(type(error).__name__, None, None, str(error.strerror)))
        return report
    if len(data) > SIZE_LIMIT_BYTES:
        return report
    problem = undecodable(data)
    if problem:
        report["faults"].append(problem)
        return report
    data = data.replace(b"\r\n", b"\n")  # Python counts one more line at the end of such a file
    try:
        compile(data, os.path.basename(name), "exec", dont_inherit=True)
    except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError) as error:
        report["faults"].append(syntax_fault(error, data))
        lines = re.split("\r\n|\r|\n", data.decode("utf-8", "replace"))
        report["faults"] += [syntax_fault(one, data) for one in further_errors(lines, error)]
        report["slips"] = slips_of_the_rest(data.decode("utf-8", "replace")) if with_slips else []
        return report
    # what compiles can be nested too deep to be looked at
    with contextlib.suppress(RecursionError, MemoryError):
        tree = ast.parse(data)
        error = bare_except(tree, os.path.basename(name))
        if error is not None:
            report["faults"].append(syntax_fault(error, data))
            return report
        text = data.decode("utf-8", "replace")
        if with_slips:
            report["slips"] = [
                *with_comments(slips(tree, numbers_of_modules(root, name, names, tree)), text),
                *argument_texts(text),
                *commented_calls(text),
            ]
    return report


def numbers_of_modules(root, name, names, tree):
    """Return the numbers that a script has from the package's own modules beside it, as it reads them: `RATE`, or
    `settings.RATE`."""
    beside = {posixpath.basename(one)[: -len(".py")]: one for one in names if one.endswith(".py")}
    folder, found = posixpath.dirname(name), {}
    for node in [n for n in tree.body if isinstance(n, (ast.Import, ast.ImportFrom))][:IMPORTS_LIMIT]:
        for one in node.names:
            module = one.name if isinstance(node, ast.Import) else node.module or ""
            path = beside.get(module.rpartition(".")[2])
            if path is None or path == name or posixpath.dirname(path) != folder:
                continue
            for key, value in numbers_in(os.path.join(root, path)).items():
                if isinstance(node, ast.Import):
                    found["%s.%s" % (one.asname or module, key)] = value
                elif one.name in (key, "*"):
                    found[key if one.name == "*" else one.asname or key] = value
    return found


@functools.lru_cache(maxsize=None)
def numbers_in(path):
    """Return the numbers that a module gives its names, each once."""
    with contextlib.suppress(OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        with open(path, "rb") as file:
            tree = ast.parse(file.read(MODULE_LIMIT_BYTES))
        given = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        given = [n.id for n in given]
        made = [n for n in tree.body if isinstance(n, (ast.Assign, ast.AnnAssign))]
        named = [(getattr(n, "target", None) or n.targets[0], n.value) for n in made]
        values = {t.id: getattr(v, "value", None) for t, v in named if isinstance(t, ast.Name)}
        return {k: v for k, v in values.items() if type(v) in (int, float) and given.count(k) == 1}
    return {}


def further_errors(lines, error):
    """Yield what Python says of the lines below the first one that it refuses, each time with another line in place of
    those that it refused before. What spreads over several lines is told by its first one alone."""
    for _ in range(FURTHER_LIMIT if sum(map(len, lines)) < FURTHER_BYTES else 0):
        line = getattr(error, "lineno", None)
        if line is None or not 0 < line <= len(lines):
            return
        if isinstance(error, TabError):
            lines[:] = [one.expandtabs(tab_size(lines) or 8) for one in lines]
        else:
            lines[line - 1] = in_its_place(lines, line - 1)
        try:
            compile("\n".join(lines), "script", "exec", dont_inherit=True)
        except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError) as next_one:
            error = next_one
        else:
            return
        if (getattr(error, "lineno", None) or 0) <= line:
            return
        yield error


HEADS = {
    "def": "def _():", "class": "class _:", "if": "if _:", "elif": "elif _:", "else": "else:", "while": "while _:",
    "for": "for _ in _:", "with": "with _:", "try": "try:", "except": "except _:", "finally": "finally:",
}  # fmt: skip


def in_its_place(lines, at):
    """Return a line that does nothing and that the lines around this one fit to."""
    blanks = blanks_of(lines[at])
    word = re.match(r"\w*", lines[at].lstrip()).group()
    below = next((line for line in lines[at + 1 :] if line.strip()), "")
    head = HEADS.get(word, "")
    return blanks + (head if head and len(blanks_of(below)) > len(blanks) else "%s pass" % head).strip()


def slips_of_the_rest(text):
    """Return which names a file that does not parse gives to its node and topics, as far as the rest of it says."""
    lines = first_version("\n".join(text.splitlines())).split("\n")
    for _ in range(REFUSED_LIMIT):
        try:
            tree = ast.parse("\n".join(lines))
        except SyntaxError as error:
            at = (error.lineno or 0) - 1
        except (ValueError, RecursionError, MemoryError):
            break
        else:
            return [one for one in slips(tree) if one["kind"] in OF_NAMES]
        if not 0 <= at < len(lines) or not lines[at].strip():
            break
        indentation = re.match(r"\s*", lines[at]).group()
        lines[at] = "" if lines[at].lstrip() == "pass" else indentation + "pass"
    return []


ARGUMENT = re.compile(
    r"\s*([\w., ]{1,99}?) *= *((?:sys\.argv|argv|rospy\.myargv\([\w.=]*\))\[[\w: -]{1,20}\])\s*(?:#.*)?"
)


def argument_texts(text):
    """Yield where a script keeps arguments of its command line as they come, as texts; with numbers in their place."""
    for number, line in enumerate(text.splitlines(), 1):
        found = ARGUMENT.fullmatch(line[:TEXT_LIMIT])
        if found:
            several = ":" in found.group(2).rpartition("[")[2]
            fix = ("%s = map(int, %s)" if several else "%s = int(%s)") % found.groups()
            yield slip(number, "argument-text", "an argument is a text", fix=fix, name=found.group(1))


COMMENTED_CALL = re.compile(
    r"\s*(?:#[#\s]*|(?P<quotes>\'{3}|\"{3}|[\'\"]))"
    r"(?P<code>(?:(?P<target>[\w.]+) *= *)?[\w.]*\b"
    r"(?P<call>Publisher|Subscriber|Service|init_node|publish|sleep|spin|"
    r"log\w+(?=\(.*\w\.data\b)|print(?=\(.*\w\.data\b))\(.*\))"
    r"(?(quotes)(?P=quotes))\s*(?:#.*)?"
)


COMMENTED_NAME = re.compile(r"\s*#[#\s]*(?:\w+\s*=\s*)?(\w+)\(.*\)\s*")


def with_comments(found, text):
    """Return the slips; what nothing calls is said to be called in a comment, where there is one such call."""
    lines = enumerate(text.splitlines(), 1)
    called = [
        (m[1], n) for n, m in ((n, COMMENTED_NAME.fullmatch(line[:TEXT_LIMIT])) for n, line in lines) if m
    ]
    names, where = [name for name, _ in called], dict(called)
    for one in found:
        name = one.get("name", "")
        again = one["kind"] == "never-called" and names.count(name) == 1
        yield {**one, "fix": "remove the `#` from line %d" % where[name]} if again else one


def commented_calls(text):
    """Yield calls of ROS that are commented out, or put in quotes; `name` is the call, behind what it is given to:
    `pub = Publisher`."""
    for number, line in enumerate(text.splitlines(), 1):
        found = COMMENTED_CALL.fullmatch(line[:TEXT_LIMIT])
        quotes, code, target, call = found.group("quotes", "code", "target", "call") if found else [""] * 4
        with contextlib.suppress(SyntaxError, ValueError, RecursionError, MemoryError):
            if code and ast.parse(code):
                name = "%s = %s" % (target, call) if target else call
                message, fix = "`%s(…)` is commented out", "remove the `#` from line %d"
                if quotes:
                    message = "`%s(…)` is in quotes, so it never runs"
                    fix = "remove the quotes around the call on line %d"
                yield slip(number, "commented-out", message % call, fix % number, name)


def bare_except(tree, name):
    """Return as a fault the first `except Error, name:`, which Python 3.14 reads as two kinds of errors.

    All others refuse it, as they did since Python 3.0.
    """
    for node in ast.walk(tree):
        kinds = node.type if isinstance(node, ast.ExceptHandler) else None
        if isinstance(kinds, ast.Tuple) and kinds.elts:
            first = kinds.elts[0]
            if (kinds.lineno, kinds.col_offset) == (first.lineno, first.col_offset):  # no bracket before it
                place = (name, kinds.lineno, kinds.col_offset + 1, None)
                return SyntaxError("multiple exception types must be parenthesized", place)
    return None


def fault(kind, line, column, message, *, text="", opened=None, mixed=False, tab_size=None, odd=None):
    texts = {"message": message[:MESSAGE_LIMIT], "text": text[:TEXT_LIMIT]}
    place = {"line": line, "column": column, "opened": opened}
    return {"kind": kind, **place, "mixed": mixed, "tab_size": tab_size, "odd": odd, **texts}


def undecodable(data):
    """Return the fault of a file that is something else as a whole, or whose bytes are not text. `compile` forgives
    them in comments, running does not."""
    for begins, message in NO_SCRIPTS:
        if begins.match(data):
            return fault("SyntaxError", None, None, message)
    if b"\0" in data:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        return fault("ValueError", line, None, "source code cannot contain null bytes")
    try:
        encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    except ENCODINGS as error:
        if "unknown encoding" in str(error):
            return fault("SyntaxError", 1, None, str(error))
        encoding = "utf-8"
    try:
        data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = "Non-UTF-8 code starting with '\\x%02x', but no encoding declared" % data[error.start]
        return fault("SyntaxError", line, None, message)
    except (LookupError, ValueError) as error:
        return fault("SyntaxError", 1, None, str(error))
    return None


def has_numbers(data):
    """Return whether the first lines begin with their numbers, as a page or an editor shows them."""
    lines = data.split(b"\n", NUMBERED_LINES)[:NUMBERED_LINES]
    numbers = [re.match(rb"\s*(\d+)\b", line) for line in lines]
    return [int(number[1][:9]) for number in numbers if number] == list(range(1, NUMBERED_LINES + 1))


def syntax_fault(error, data):
    cpp = CPP.search(data)
    if cpp is not None:
        return fault("SyntaxError", data.count(b"\n", 0, cpp.start()) + 1, None, "C++ in a file for Python")
    if has_numbers(data):
        return fault("SyntaxError", None, None, "line numbers in the text")
    encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    lines = io.StringIO(data.decode(encoding), newline=None).read().split("\n")
    line = getattr(error, "lineno", None)
    known = line is not None and 0 < line <= len(lines)
    # within brackets, Python trips over a line below git's marker
    above = enumerate(lines[:line] if known else ())
    first = next((n for n, text in above if MARKER.match(text) or BRACE.match(text[: TEXT_LIMIT + 1])), None)
    if first is not None and lines[first][:1] not in "=>|":
        at = lines[first].find("{") + 1 or 1
        return fault("SyntaxError", first + 1, at, "invalid syntax", text=lines[first])
    if known and "invalid syntax" in str(error) and is_comment_below(lines, line):
        return fault("SyntaxError", line, 1, "comment goes on", text=lines[line - 1])
    told = (lines, line, str(error))
    of_block = empty_at_end(*told) or block_fault(*told) if known else None
    if of_block is not None:
        return of_block
    begins = {text[0] for text in lines if text[:1] in ("\t", " ") and text.strip()}
    return fault(
        type(error).__name__,
        line if known else None,
        getattr(error, "offset", None),
        str(getattr(error, "msg", None) or error),
        text=lines[line - 1] if known else "",
        opened=never_closed(data, line) if known else None,
        mixed=len(begins) > 1,
        tab_size=tab_size(lines) if len(begins) > 1 or isinstance(error, TabError) else None,
        odd=odd_line(lines) if len(begins) > 1 else None,
    )


def is_comment_below(lines, line):
    """Return whether a line is the end of the comment above it, which a PDF or an editor has broken into two: at least
    three words, the first of which is no name of the script."""
    above, words = (lines[line - 2].strip() if line > 1 else ""), lines[line - 1].split()
    is_comment = above.startswith("#") and WORDS.match(lines[line - 1]) is not None
    if not is_comment or keyword.iskeyword(words[0]) or words[0] in ("print", "exec"):
        return False
    used = re.compile(r"\b%s\s*[.(=\[]|import.*\b%s\b" % (re.escape(words[0]), re.escape(words[0])))
    return not any(used.search(text) for text in lines)


def empty_at_end(lines, line, message):
    """Return the fault of a block that the line begins, and that no code comes after; None else."""
    is_head = is_code(lines[line - 1]) and lines[line - 1].rstrip().endswith(":")
    if "expected an indented" in message and is_head and not any(map(is_code, lines[line:])):
        own = len(blanks_of(lines[line - 1]))
        inside = [text for text in lines[line:] if text.strip() and len(blanks_of(text)) > own]
        told = "only comments" if inside else "nothing"
        return fault(
            "IndentationError", line, 1, "%s in the block on line %d" % (told, line), text=lines[line - 1]
        )
    return None


def has_no_indentation(lines):
    """Return whether a file with three blocks or more begins each line at the margin."""
    return sum(map(bool, map(HEAD_OF_BLOCK.match, lines))) > 2 and not any(
        text[:1].isspace() and text.strip() for text in lines
    )


def block_fault(lines, line, message):
    """Return the fault of a block whose first line or whole body is a comment, or which some of its lines are out of;
    None else."""
    indented = "unexpected indent" in message
    last = (
        line if lines[line - 1 :] and not is_code(lines[line - 1]) else line - 1
    )  # at the file's end, a comment
    above = [n for n in range(last) if lines[n].strip()]
    head = next((n for n in reversed(above) if is_code(lines[n])), None)
    comments = (
        [n for n in above if head is not None and n > head] if "expected an indented" in message else []
    )
    # `#    x = 1`, too: an editor writes the sign before the line's own blanks
    inside = [re.sub(r"^(?:#(?=    ))?(\s*).*", r"\1", lines[n]) for n in comments]
    if any(len(blanks) > len(blanks_of(lines[head])) for blanks in inside):
        told = "only comments in the block on line %d" % (head + 1)
        return fault("IndentationError", line, 1, told, text=lines[line - 1])
    if head is not None and "expected an indented" in message:
        is_out = len(blanks_of(lines[line - 1])) < len(blanks_of(lines[head]))
        is_out = is_out and lines[line - 1].partition("#")[0].strip() != "pass"  # it can only be the body
        told = "the same line twice" if lines[line - 1].strip() == lines[head].strip() else ""
        told = "no indentation in the text" if has_no_indentation(lines) else told
        at_end = not any(map(is_code, lines[line - 1 :]))
        if not told and (is_out or at_end or lacks_body(lines[head], lines[line - 1])):
            told = "nothing in the block on line %d" % (head + 1)
        if told:
            return fault("IndentationError", line, 1, told, text=lines[line - 1])
    gone = commented_head(lines, line) if indented else None
    if gone is not None:
        at, text = lines[gone].index("#") + 1, lines[gone]
        return fault("IndentationError", gone + 1, at, "block commented out" + moved(lines, gone), text=text)
    odd = out_of_block(lines, line) if indented else None
    told = too_far_in(lines, line, alone=head is None) if indented and odd is None else ""
    if told:
        return fault("IndentationError", line, 1, told, text=lines[line - 1])
    inner = blanks_of(lines[line - 1]) if odd is not None else block_cut(lines, line)
    if inner is None:
        return None
    at = line - 1 if odd is None else odd
    message = "ends its block too early: " + begin_with(inner)
    return fault("IndentationError", at + 1, 1, message, text=lines[at])


def too_far_in(lines, line, *, alone):
    """Return what is missing above a line that is further in than it may be, `alone` where no code is above it."""
    if alone:
        return "indented at the top of the file: " + outdented(lines, line)
    above = next((n for n in range(line - 2, -1, -1) if lines[n].strip()), 0)
    if TEXT_BEHIND.match(lines[above]):
        return "text behind the colon of line %d" % (above + 1)
    if lacks_head(lines, line - 1):
        return "block without its first line"
    return "function without its first line" if lacks_def(lines, line - 1) else ""


def tab_size(lines):
    """Return the size of a tab at which the lines fit into blocks, as in the editor that they were written in; None
    where no usual size does."""
    for size in (8, 4):
        if fits("\n".join(blanks_of(line).expandtabs(size) + line.lstrip() for line in lines)):
            return size
    return None


def fits(text):
    """Return whether the lines of a text fit into blocks."""
    try:
        compile(text, "script", "exec", dont_inherit=True)
    except IndentationError:
        return False
    except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError):
        pass
    return True


def odd_line(lines):
    """Return the only line that is indented with tabs where all others are with spaces, or the other way round; None
    where there are more, or none of the others' indentations is right for it."""
    kinds = {}
    for number, line in enumerate(lines):
        if line.strip() and blanks_of(line):
            kinds.setdefault("".join(sorted(set(blanks_of(line)))), []).append(number)
    rare, usual = sorted(kinds, key=lambda kind: len(kinds[kind])) if len(kinds) == 2 else ("", "")
    if usual not in ("\t", " ") or len(kinds[rare]) != 1 or len(kinds[usual]) == 1:
        return None
    (at,) = kinds[rare]
    others = {blanks_of(line) for number, line in enumerate(lines) if number != at and line.strip()} - {""}
    for blanks in sorted(others, key=len)[:DEPTHS_MAX]:
        fitted = [*lines[:at], blanks + lines[at].lstrip(), *lines[at + 1 :]]
        if fits("\n".join(fitted)):
            return {"line": at + 1, "wants": "tabs" if usual == "\t" else "spaces"}
    return None


def commented_head(lines, line):
    """Return the index of the comment above that line which is the first line of a block; None where none is."""
    for number in range(line - 2, -1, -1):
        text = lines[number][:TEXT_LIMIT]
        found = COMMENTED.match(text)
        if found:
            with contextlib.suppress(SyntaxError, ValueError, RecursionError, MemoryError):
                end = "\nfinally: pass" if found.group(1).startswith("try") else ""
                ast.parse(found.group(1) + " pass" + end)
                return number
        if is_code(text):
            return None
    return None


def moved(lines, head):
    """Return with what the line has to begin, as the code above does; "" where it begins so."""
    blanks = blanks_of(next(filter(is_code, reversed(lines[:head])), ""))
    return "" if blanks == blanks_of(lines[head]) else ": " + begin_with(blanks)


def begin_with(blanks):
    return "begin it with %s" % (counted(blanks) or "no spaces")


def counted(blanks):
    """Return how many tabs and spaces these are, in words."""
    counts = [(blanks.count("\t"), "tab"), (blanks.count(" "), "space")]
    return " and ".join("%d %s%s" % (count, kind, "s" * (count > 1)) for count, kind in counts if count)


def outdented(lines, line):
    """Return what to delete in front of that line, which is the first one with code, and of those below it that are as
    far in."""
    blanks, last = blanks_of(lines[line - 1]), line
    for number, text in enumerate(lines[line:], line + 1):
        if is_code(text) and not text.startswith(blanks):
            break
        last = number if text.startswith(blanks) and text.strip() else last
    where = "this line" if last == line else "each line from %d to %d" % (line, last)
    return "delete the %s that %s begins with" % (re.sub("^1 (?!.* and )", "", counted(blanks)), where)


def blanks_of(text):
    return text[: len(text) - len(text.lstrip())]


def out_of_block(lines, line):
    """Return the index of the first of at most three lines right above that line which are further out than it, though
    it goes on with the block above them; None where there are none."""
    code = [n for n in range(line - 2, -1, -1) if is_code(lines[n])]
    own, *widths = [len(blanks_of(lines[n]).expandtabs()) for n in [line - 1, *code]]
    odd = next((i for i, width in enumerate(widths) if width >= own), 0)
    before = next((width for width in widths[odd:] if width <= own), None)
    fits = 0 < odd <= ODD_LINES_MAX and before == own
    return code[odd - 1] if fits and not any(OUTERMOST.match(lines[n]) for n in code[:odd]) else None


def block_cut(lines, line):
    """Return with what the lines of a `try:` begin, where that line is as far out as the `try:` and as the `except`
    below it; None else."""
    own = blanks_of(lines[line - 1])
    above = [n for n in range(line - 1) if is_code(lines[n])]
    tried = next((n for n in reversed(above) if blanks_of(lines[n]) == own), None)
    below = [lines[n] for n in range(line, len(lines)) if is_code(lines[n])][:ODD_LINES_MAX]
    ends = any(re.match(re.escape(own) + r"(except|finally)\b", text) for text in below)
    if tried is None or not ends or not re.match(r"try\s*:", lines[tried].lstrip()) or tried == above[-1]:
        return None
    return blanks_of(lines[above[above.index(tried) + 1]])


def never_closed(data, line):
    """Return the line of the outermost bracket that is opened up to `line` and not closed by the end of the file."""
    stack = []
    try:
        for token in tokenize.tokenize(io.BytesIO(data).readline):
            if token.type == tokenize.OP and token.string in "([{":
                stack.append((token.string, token.start[0]))
            elif token.type == tokenize.OP and stack and stack[-1][0] == PAIRS.get(token.string):
                stack.pop()
    except (tokenize.TokenError, SyntaxError):  # the end of the file, or where the tokens end
        pass
    return stack[0][1] if stack and stack[0][1] <= line else None


if __name__ == "__main__":
    main(sys.argv)
