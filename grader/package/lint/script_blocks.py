"""What lines that do not parse say: indentation of blocks, git's markers. For `syntax.py`, and repairs.

Python 3.8, standard library only.
"""

import io
import re
import tokenize
from itertools import takewhile

LEAVES = re.compile(r"\s*(return|break|continue|raise)\b")
GIVES = re.compile(r"\s*([\w.]+)\s*[-+*/]?=(?!=)(.*)")
HEAD = re.compile(r"\s*(def|class)\b|\s*@")
BRANCHES = re.compile(r"\s*(elif|else)\b")
DEPTHS = (2, 3, 4, 8)
"""So much further in a block may begin."""
PAUSES = re.compile(r"\s*[\w.]+\.(sleep|spin)\(\s*[\w.]*\s*\)")


TEXT_BEHIND = re.compile(
    r"""^(\s*(?:def|class|if|elif|else|while|for|try|except|finally|with)\b.*:)\s+(""\"[^"]*""\"|'''[^']*''')\s*$"""
)
"""The first line of a block, with a text of three quotes behind its `:`."""
MARKER = re.compile(r"(<{7}|={7}|>{7}|\|{7})(\s|$)")
"""Of git's, where two versions of a file were not merged."""


def is_code(text):
    return bool(text.strip()) and not text.lstrip().startswith("#")


def width_of(text):
    return len(text.expandtabs()) - len(text.expandtabs().lstrip())


def blocks_of(text):
    """Return of which kinds the words of a script are, with where its blocks begin and end; the text itself where its
    lines fit into no blocks."""
    try:
        return [token.type for token in tokenize.generate_tokens(io.StringIO(text).readline)]
    except (tokenize.TokenError, SyntaxError):
        return text


def lacks_head(lines, at):
    """Return whether the line that begins the block is missing above the line at index `at`, which is further in than
    the code above it: an `else` follows the block, or code that would never be reached without it (`return`), or the
    block gives another value to what has just got one. Any other line may as well be indented too far."""
    code = [n for n, line in enumerate(lines) if is_code(line)]
    if at not in code[1:]:
        return False
    first = code.index(at)
    above, own = lines[code[first - 1]], width_of(lines[at])
    body = list(takewhile(lambda n: width_of(lines[n]) >= own, code[first:]))
    after = lines[code[first + len(body)]] if len(code) > first + len(body) else ""
    if own - width_of(above) not in DEPTHS or width_of(after) != width_of(above) or not after:
        return False
    leaves = width_of(lines[body[-1]]) == own and LEAVES.match(lines[body[-1]])
    before, then = GIVES.match(above), GIVES.match(lines[at])
    resets = before and then and before.group(1) == then.group(1) and before.group(1) not in then.group(2)
    return bool(BRANCHES.match(after) or (leaves and not LEAVES.match(above)) or resets)


def lacks_def(lines, at):
    """Return whether the first line of a function is missing above the line at index `at`, which is further in than the
    code above it: it stands apart from that by two blank lines, or by one and is about `self`."""
    code = [n for n, line in enumerate(lines) if is_code(line)]
    if at not in code[1:] or HEAD.match(lines[at]):
        return False
    first = code.index(at)
    above, own = code[first - 1], width_of(lines[at])
    body = list(takewhile(lambda n: width_of(lines[n]) >= own, code[first:]))
    blank = sum(not line.strip() for line in lines[above + 1 : at])
    is_method = any(re.search(r"\bself\.", lines[n]) for n in body) and width_of(lines[above]) > 0
    apart = 1 if is_method else 2
    return own - width_of(lines[above]) in DEPTHS and len(body) > 1 and blank >= apart


def with_head(lines, at):
    """Yield the causes and the texts without what keeps Python from the line at index `at`: a text behind the `:` of
    the line above, where a comment is meant, or the spaces before a script's first code, an import. As many are
    left out of every line, or else of those that begin with just as many."""
    above = next((n for n in range(at - 1, -1, -1) if lines[n].strip()), 0)
    commented = TEXT_BEHIND.sub(r"\1  # \2", lines[above])
    if commented != lines[above] and width_of(lines[at]) > width_of(lines[above]):
        yield "token", "\n".join([*lines[:above], commented, *lines[above + 1 :]])
    own = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
    if not own or not re.match(r"(import|from)\s", lines[at].strip()) or any(map(is_code, lines[:at])):
        return
    whole = all(line.startswith(own) for line in lines if is_code(line))
    spared = [line.startswith(own) if whole else re.match(r"\s*", line).group() == own for line in lines]
    yield "level", "\n".join(line[len(own) :] if spared[n] else line for n, line in enumerate(lines))


def lacks_body(head, line):
    """Return whether the body of an `if` is missing where a line that belongs to the loop around it follows, or that of
    a function where the next one does."""
    of_if = re.match(r"\s*(if|elif|else)\b", head)
    of_function = re.match(r"\s*(async\s+)?def\b", head) and re.match(
        r"\s*(@|def\b|class\b|if __name__)", line
    )
    return width_of(head) == width_of(line) and bool((of_if and PAUSES.match(line)) or of_function)


def first_version(text, left_out="|="):
    """Return the text with empty lines in place of git's merge markers and of all versions but the first. The others
    stand behind `=======` and, for the one that both come from, behind `|||||||`."""
    kept, part = [], ""
    for line in text.split("\n"):
        marker = MARKER.match(line)
        # A line of `=======` alone is no marker: only `<<<<<<<` begins one of git's conflicts.
        part = line[0] if marker and (part or line[0] == "<") else part
        # Each line stays, be it empty, so that those below it keep their numbers.
        kept.append("" if part and (marker or part in left_out) else line)
        part = "" if part == ">" else part
    return "\n".join(kept)


def last_version(text):
    """Return the text with empty lines in place of git's merge markers and of all versions but the last."""
    return first_version(text, "<|")
