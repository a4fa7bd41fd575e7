"""What the indentation of lines that do not parse says of their blocks: for `syntax.py`, and for the repairs.

Python 3.8, standard library only.
"""

import re
from itertools import takewhile

LEAVES = re.compile(r"\s*(return|break|continue|raise)\b")
GIVES = re.compile(r"\s*([\w.]+)\s*[-+*/]?=(?!=)(.*)")
BRANCHES = re.compile(r"\s*(elif|else)\b")
DEPTHS = (2, 3, 4, 8)
"""So much further in a block may begin."""
PAUSES = re.compile(r"\s*[\w.]+\.(sleep|spin)\(\s*[\w.]*\s*\)")


def is_code(text):
    return bool(text.strip()) and not text.lstrip().startswith("#")


def width_of(text):
    return len(text.expandtabs()) - len(text.expandtabs().lstrip())


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


def lacks_body(head, line):
    """Return whether the body of an `if` is missing where a line that belongs to the loop around it follows."""
    of_if = re.match(r"\s*(if|elif|else)\b", head)
    return bool(of_if and width_of(head) == width_of(line) and PAUSES.match(line))
