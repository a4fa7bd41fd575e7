"""What students write in place of Python: habits of Python 2, C++, the shell and web pages, with the reason of each and
the line as it should be. Tables only: `python.py` applies them."""

from __future__ import annotations

import keyword
import re
from typing import NamedTuple

BLOCK = r"(?:if|elif|else|while|for|def|class|try|except|finally|with)\b"
MERGE_MARKER = re.compile(r"(<{7}|={7}|>{7}|\|{7})(\s|$)")
MERGED = "git's merge markers (`<<<<<<<`) are still in the file"
BRACE = rf"(?:\}}\s*)?{BLOCK}(?:.*[\w\])\"])?\s*\{{$"
_UNITS = r"[kM]?[hH][zZ]|msec|ms|secs?|seconds?|s|min|cm|mm|km|m|rad|deg|degrees"
_COMMANDS = "sudo|rosrun|roslaunch|rostopic|cd|chmod|source|python3?|catkin_make"
_SHELL = rf"\$|(?:{_COMMANDS})\s+[-+~./\w]+|catkin_make$"
_NUMBERS = r"int|float|double|long|short|char|bool|byte|unsigned|size_t"
_FOR = (
    r"^(\s*)for\s*\(\s*(?:\w+\s+)?(\w+)\s*=\s*(\w+)\s*;\s*\2\s*<\s*([\w.()]+)\s*;"
    r"\s*(?:\2\s*\+\+|\+\+\s*\2|\2\s*\+=\s*1)\s*\)\s*[:{;]?$"
)
_TYPES = rf"{_NUMBERS}|str|string|auto|var|let|const|static|final|(?:\w+(?:::|\.))*[A-Z]\w*|\w+(?:::\w+)+"
RESERVED = "|".join(keyword.kwlist[3:])  # but False, None and True, which are values

DELETE_LINE = "delete this line"


class Reason(NamedTuple):
    """What is wrong in a student's words, "" where the parser's own say enough, and what to do, "" where the change
    itself shows it or nothing is sure."""

    why: str = ""
    fix: str = ""

    @property
    def text(self) -> str:
        """Both in one sentence."""
        return f"{self.why}: {self.fix}" if self.fix else self.why


FROM_HTML = Reason("signs are written as in the source of a web page", "write the signs themselves")
LFS_BEGINS = "version https://git-lfs"
LFS_POINTER = Reason(
    "the file is only a pointer of Git LFS, and what it points to was not handed in",
    "`git lfs pull` fetches that: hand it in, or commit it without Git LFS",
)


class Habit(NamedTuple):
    """`pattern` is looked for in the line without its comment and its texts' contents; `{0}` in `why` and `fix` is its
    first group. `rewrites` are pairs for `re.sub`, one after the other."""

    pattern: str
    why: str
    fix: str = ""
    rewrites: tuple[tuple[str, str], ...] = ()


_NEWER = "is of a newer Python than the one of this ROS"
_SENTENCE = rf"(?!(?i:{RESERVED}|print)\b)[A-Z][a-z']*(?:,? [A-Za-z']+){{3,}}[.!:]?"
_NEXT_NAME = r"(?!(?:as|and|from|import)\b)(?=[A-Za-z_])"
HABITS = (
    Habit(MERGE_MARKER.pattern, MERGED, "keep one version"),
    Habit(rf"^\s*(?:{_SHELL})", "this is a command for the terminal, not Python", DELETE_LINE),
    Habit(rf"\)\s*(?:{_SHELL}).*$", "a command for the terminal comes after the code", "delete it",
           ((rf"\)\s*(?:{_SHELL}).*$", ")"),)),
    Habit(r"^\s*(using\s+namespace\b|#\s*include\b)", "this is C++, not Python", DELETE_LINE),
    Habit(r"(?<![\w.])(r[^\w\s]spy|ro[^\w\s]py|ros[^\w\s]y|rosp[^\w\s.])\.", "`rospy` is misspelt as `{0}`",
           "", ((r"(?<![\w.])(?:r[^\w\s]spy|ro[^\w\s]py|ros[^\w\s]y|rosp[^\w\s.])(?=\.)", "rospy"),)),
    Habit(r"(?<![\w.])rospy\s*[,;:]\s*[A-Za-z]\w*\s*[(:]", "a dot belongs behind `rospy`",
           "", ((r"(?<![\w.])rospy\s*[,;:]\s*(?=[A-Za-z]\w*\s*[(:])", "rospy."),)),
    Habit(r"^\s*from\s+\w+[,;:]\s*\w+\s+\w{5,7}\s", "a dot belongs between the parts of a module's name",
           "", ((r"^(\s*from\s+\w+)[,;:]\s*(?=\w+\s+\w{5,7}\s)", r"\1."),)),
    Habit(r"^\s*from\s+[\w.]+\s+(?!import\b)([A-Za-z]{5,7})\s+[\w*]", "Python writes `import`, not `{0}`",
           "", ((r"^(\s*from\s+[\w.]+\s+)[A-Za-z]{5,7}(?=\s+[\w*])", r"\1import"),)),
    Habit(rf"^\s*(?:from\s+[\w.]+\s+import\s+\(?\s*[A-Z]\w*(?:\s*,\s*[A-Z]\w*)*\s+(?=[A-Z])"
           rf"|import\s+[\w.]+(?:\s*,\s*[\w.]+)*\s+{_NEXT_NAME})",
           "a comma belongs between two names",
           "", ((rf"(?<!\bimport)(?<!\bas)(?<!\bfrom)(?<=\w)\s+{_NEXT_NAME}", ", "),)),
    Habit(r"^\s*(?!from\b)([A-Za-z]{3,5})\s+[\w.]+\s+import\s", "Python writes `from`, not `{0}`",
           "", ((r"^(\s*)[A-Za-z]{3,5}(?=\s+[\w.]+\s+import\s)", r"\1from"),)),
    Habit(r"^\s*(?:while|if|elif)\s+(?!not\b)([notNOT]{2,4}|[a-z]ot|n[a-z]t|no[a-z])\s+[\w(]",
           "Python writes `not`, not `{0}`",
           "", ((r"^(\s*(?:while|if|elif)\s+)(?:[notNOT]{2,4}|[a-z]ot|n[a-z]t|no[a-z])(?=\s+[\w(])", r"\1not"),)),
    Habit(r"^\s*(?!if\b)([a-zA-Z]{1,3})\s+__name__\s*==", "Python writes `if`, not `{0}`",
           "", ((r"^(\s*)[a-zA-Z]{1,3}(?=\s+__name__)", r"\1if"),)),
    Habit(r"^\s*if(?!\s+__name__\s*==)\s*_*name_*\s*==\s*(?:_*main_*|\"\")\s*:?$",
          "`__name__` has two `_` on each side", "",
          ((r"^(\s*)if.*$", r"\1if __name__ == '__main__':"),)),
    Habit(r"^\s*(?:(?:import|from)\s.*\w|\w+\s*=\s*[\w.]+)\s+(?:\"\")+$", "a comment begins with `#` in Python", "",
          ((r"\s+((?:\"\")+)$", r"  # \1"),)),
    Habit(r"^\s*(?!def\b)([defDEF]{2,4}|[a-z]ef|d[a-z]f|de[a-z])\s+\w+\s*\(.*\)\s*:$",
           "Python writes `def`, not `{0}`",
           "", ((r"^(\s*)(?:[defDEF]{2,4}|[a-z]ef|d[a-z]f|de[a-z])(?=\s+\w+\s*\()", r"\1def"),)),
    Habit(r"^\s*(?:if|elif|while)\b[^=(:]*=[:;]\s*\S", "two values are compared by `==`",
           "", ((r"=[:;](?=\s*\S)", "=="),)),
    Habit(r"[(,]\s*[a-z_]\w*\s*[:;]\s*[\w.\"]+\s*[,)]", "an argument of a call gets its value by `=`",
           "", ((r"([(,]\s*[a-z_]\w*)\s*[:;]\s*(?=[\w.\"]+\s*[,)])", r"\1="),)),
    Habit(r"[\w\")\]]\.\s+\w+\s*=(?!=).*\)", "a comma belongs between two arguments",
           "", ((r"(?<=[\w\")\]])\.\s+(?=\w+\s*=(?!=))", ", "),)),
    Habit(r"\w\s*=[^()]*\w,([A-Za-z]\w*)\s*\)$", "a dot belongs before `{0}`", "",
           ((r",([A-Za-z]\w*\s*\))$", r".\1"),)),
    Habit(r"\w\s*=\s*[\w.]+\s*,\s*[A-Za-z][\w.]*\s*\)", "a value without a name comes after one with a name", "",
           ((r"(\w+\s*=\s*[\w.]+)\s*,\s*([A-Za-z][\w.]*)\s*\)", r"\2, \1)"),)),
    Habit(rf"^\s*(?!(?:{RESERVED}|print|exec)\b)[a-z_]\w*\s+(?:rospy\.\w+\(|\"\")(?!.*=\s*=)",
           "`=` is missing between the name and its value", "",
           ((r"^(\s*[a-z_]\w*)\s+(?=rospy\.\w+\(|\"\")", r"\1 = "),)),
    Habit(r"^\s*self\.\w+\s+(?:[A-Za-z]\w*[.(]|\"\"|-?\d)(?!.*=\s*=)",
           "`=` is missing between the name and its value", "",
           ((r"^(\s*self\.\w+)\s+(?=[A-Za-z]\w*[.(]|\"\"|-?\d)", r"\1 = "),)),
    Habit(r"^\s*type\s+[A-Za-z_]\w*\s*=(?!=)", f"`type` before a name {_NEWER}", "",
           ((r"^(\s*)type\s+", r"\1"),)),
    Habit(r"^\s*except\s*\*\s*\w", f"`except*` {_NEWER}", "", ((r"except\s*\*\s*", "except "),)),
    Habit(r"^\s*(?:async\s+)?(?:def|class)\s+\w+\s*\[", f"a type in `[ ]` behind a name {_NEWER}",
           "leave the types out"),
    Habit(r"^\s*match\s+(?:[\w.]+(?:\([^()]*\)|\[[^][]*\])?|\([^()]*\)):$", f"`match` {_NEWER}",
           "write `if` and `elif` in place of `match` and `case`"),
    Habit(r"^\s*>>>", "`>>>` is printed by Python's prompt", "leave it out", ((r">>>\s?", ""),)),
    Habit(r"^\s*//", "a comment begins with `#` in Python", "", ((r"//+\s*", "# "),)),
    Habit(r"^\s*/\*", "a comment begins with `#` in Python",
           "", ((r"/\*+\s*", "# "), (r"\s*\*+/\s*$", ""))),
    Habit(r"\S\s*//\s*\w+\s+\w", "a comment begins with `#` in Python", "", ((r"\s*;*\s*//\s*", "  # "),)),
    Habit(r"^\s*(?:\}\s*)?for\s*\(.*;.*;.*\)", "Python's `for` takes its values from a range or a list",
           "", ((_FOR, r"\1for \2 in range(\3, \4):"),)),
    Habit(r"\b(else\s+if|elseif|elsif)\b", "Python writes `elif`, not `{0}`",
           "", ((r"^(\s*)\}\s*", r"\1"), (r"\b(?:else\s+if|elseif|elsif)\b", "elif"))),
    Habit(r"^\s*except\s+[\w.]+\s*,\s*\w+\s*:", "this is Python 2", "write `except Error as name:`",
           ((r"^(\s*except\s+[\w.]+)\s*,\s*(\w+\s*:)", r"\1 as \2"),)),
    Habit(r"^\s*raise\s+[\w.]+\s*,", "this is Python 2", 'write `raise Error("text")`',
           ((r"^(\s*raise\s+[\w.]+)\s*,\s*(.+)$", r"\1(\2)"),)),
    Habit(r"^\s*print\s+[^(=\s]", "`print` has no brackets, as in Python 2", "write `print(...)`",
           ((r"^(\s*)print\s+([^>(\s](?:.*[^,;\s])?)\s*;*$", r"\1print(\2)"),)),
    Habit(r"^\s*exec\s+[^(=\s]", "`exec` has no brackets, as in Python 2", "write `exec(...)`",
           ((r"^(\s*)exec\s+(.+)$", r"\1exec(\2)"),)),
    Habit(r"^\s*```", "this is Markdown, from a chat or a web page, not Python", DELETE_LINE),
    Habit(rf"^\s*(?:Toggle line numbers|Copy code|View raw|{_SENTENCE})$",
           "this is text, from a page or a chat, not Python", DELETE_LINE),
    Habit(r"`", "backticks are Python 2", "write `repr(x)` or `str(x)`", ((r"`([^`]+)`", r"repr(\1)"),)),
    Habit(r"<>", "`<>` is Python 2", "write `!=`", ((r"\s*<>\s*", " != "),)),
    Habit(r"\bur['\"]", '`ur"..."` is Python 2', 'write `r"..."`', ((r"\bur(?=['\"])", "r"),)),
    Habit(r"\b\d+[lL]\b", "a number that ends with `L` is Python 2", "leave the `L` out",
           ((r"\b(\d+)[lL]\b", r"\1"),)),
    Habit(r"\+\+|--\s*;*\s*$", "Python has no `++` and `--`", "write `x += 1` in a line of its own",
           ((r"^(\s*)([\w.]+)\s*([+-])\3\s*;*$", r"\1\2 \3= 1"), (r"^(\s*)([+-])\2\s*([\w.]+)\s*;*$", r"\1\3 \2= 1"))),
    Habit(r"&&|\|\||!(?!=)", "Python writes `and`, `or` and `not`",
           "", ((r"\s*&&\s*", " and "), (r"\s*\|\|\s*", " or "), (r"!(?!=)\s*", "not "))),
    Habit(r"([<>!=])\s+=(?!=)", "`{0}=` has no space in it", "", ((r"([<>!=])\s+=(?!=)", r"\1="),)),
    Habit(r'""\s+5\s*\(', "`%` belongs between a string and its values, not `5`", "", ((r'""\s+5\s*\(', '"" % ('),)),
    Habit(r"(===|!==|=<|=>|\bnot\s*=)", "Python compares with `==`, `!=`, `<=` and `>=`, not with `{0}`",
           "", ((r"===", "=="), (r"!==", "!="), (r"=<", "<="), (r"=>", ">="), (r"\s*\bnot\s*=+", " !="))),
    Habit(rf"^\s*{BRACE}", "Python has no `{` and `}` around a block", "end its first line with `:`",
           ((rf"^(\s*)(?:\}}\s*)?({BLOCK}.*?)\s*\{{$", r"\1\2:"),)),
    Habit(r"^\s*[{}]\s*;?$", "this bracket closes nothing", DELETE_LINE),
    Habit(r"^\s*(?:if|elif|while)\b.*\b(then|do)\s*:?$", "the line that begins a block ends with `:`, not with `{0}`",
           "", ((r"\s+(?:then|do)\s*:?$", ":"),)),
    Habit(r"^\s*(if|elif|while)\b[^=(:]*[^=!<>(:]=[^=]", "`=` gives a value to a name; to compare, write `==`",
           "", ((r"(?<![=!<>])=(?!=)", "=="),)),
    Habit(rf"^\s*{BLOCK}.*;$", "the line that begins a block ends with `:`, not with `;`",
           "", ((r"\s*:?(\s*;)+$", ":"),)),
    Habit(rf"^\s*{BLOCK}.*:\s*[^\s\w'\"()\[\]{{}}:]+$",
           "something comes after the `:` that ends the line", "delete it",
           ((r":[^:]*$", ":"),)),
    Habit(r"^\s*(?!lambda\b)(?:\w+(?:\.\w+)+\(.*|[\w.]+\s*=(?!=).*)[^:]:$",
           "only a line that begins a block ends with `:`", "leave it out", ((r"\s*:$", ""),)),
    Habit(r"(?<![\w.])0+[1-9]\d*(?![\w.])",
           "a number may not begin with 0", "leave it out, or write 0o for an octal one",
           ((r"(?<![\w.])0+(?=[1-9]\d*(?![\w.]))", ""),)),
    Habit(r";\s*;$", "a line of Python ends without `;`", "delete it", ((r"(\s*;)+$", ""),)),
    Habit(r"\basync\b(?!\s+(def|for|with)\b)", "`async` is a reserved word since Python 3.7", "use another name"),
    Habit(rf"^\s*(?:self\.)?({RESERVED})\s*=(?!=)",
           "`{0}` is a reserved word of Python", "use another name"),
    Habit(r"^\s*import\s+[\w, ]+\sfrom\s+[\w.]+\s*;*$", "the module comes first", "write `from module import name`",
           ((r"^(\s*)import\s+(.+?)\s+from\s+([\w.]+)\s*;*$", r"\1from \3 import \2"),)),
    Habit(r"^\s*(?:public\s+|private\s+|static\s+)*(void|function|func|fun|fn|sub|define|int|float|double|bool|string)"
           r"\s+\w+\s*\(.*\)", "a function begins with `def`, not with `{0}`",
           "", ((r"^(\s*)(?:public\s+|private\s+|static\s+)*\w+\s+(\w+\s*\(.*?\))\s*[:{]?$", r"\1def \2:"),)),
    Habit(r"^\s*def\s+\w+\s*:$", "the brackets `()` behind the name of the function are missing",
           "", ((r"(\w)\s*:$", r"\1():"),)),
    Habit(r"^\s*[\w.]+\.(set_param|publish|sleep)\(.*\)\s*=(?!=)", "`{0}` gets its values in its brackets, not by `=`",
           "", ((r"\(\s*\)\s*=\s*(.*)$", r"(\1)"), (r"\)\s*=(?!=)\s*(.*)$", r", \1)"))),
    Habit(r"\bnew\s+[A-Za-z_]", "Python has no `new`", "leave it out", ((r"\bnew\s+", ""),)),
    Habit(rf"^\s*(?!(?i:{RESERVED}|print)\b)({_TYPES})\s+[A-Za-z_]\w*\s*(;*$|=[^=])",
           "a name has no type in Python", "leave `{0}` out, and give it a value",
           ((rf"^(\s*)(?:(?:{_TYPES})\s+)+([A-Za-z_]\w*\s*=.*?)\s*;*$", r"\1\2"),
            (rf"^(\s*)(?:{_NUMBERS})\s+([A-Za-z_]\w*)\s*;*$", r"\1\2 = 0"),
            (r"^(\s*)(?:std_msgs::|std_msgs\.msg\.)?([A-Z]\w*)\s+([A-Za-z_]\w*)\s*;*$", r"\1\3 = \2()"))),
    Habit(r"[\w)](->|::)[A-Za-z_]", "Python writes a dot, `.`, where C++ has `{0}`",
           "", ((r"(?<=[\w)])(?:->|::)(?=[A-Za-z_])", "."),)),
    Habit(rf"^\s*(?!(?:{RESERVED}|print)\b)[a-z_]\w*\s+[a-z_]\w*\s*=(?!=)", "a name has no space in it",
           "", ((r"^(\s*)(\w+)\s+(\w+)(\s*=)", r"\1\2_\3\4"),)),
    Habit(r"^\s*[A-Za-z_]\w*(?:-\w+)+\s*=(?!=)", "a name has no `-` in it",
           "", tuple([(r"^(\s*\w+)-(\w+)", r"\1_\2")] * 3)),
    Habit(rf"(?<![\w.])\d+(?:\.\d+)?\s?({_UNITS})\b", "a number has no unit in Python", "leave `{0}` out",
           ((rf"(?<![\w.])(\d+(?:\.\d+)?)\s?(?:{_UNITS})\b", r"\1"),)),
    Habit(r"^\s*\d+[A-Za-z_]\w*\s*=(?!=)", "a name begins with a letter, not with a digit", "use another name"),
    Habit(r"[(,=]\s*/\w[\w/]*\s*[,)]", "a topic's name is a string", "write it in quotes",
           ((r"([(,=]\s*)(/\w[\w/]*)(?=\s*[,)])", r"\1'\2'"),)),
    Habit(r"(?<![\"')\]])(?<![\"')\]]\s)%[sdf]\b(?!\s*[.(\[])",
           "the string has no quotes around it", 'write `"` before and after it'),
    Habit(r"^\s*[\w.]+\s*:=", "a line gives a name its value by `=`", "", ((r":=", "="),)),
)  # fmt: skip
LAST_HABITS = (
    Habit(r"^\s*def\s.*\(\s*(?:\w+\s*,\s*)*\(\s*(\w+(?:\s*,\s*\w+)+)\s*\)",
           "parameters in brackets of their own are Python 2",
           "write one name in its place, `pair`, and `{0} = pair` as the function's first line"),
    Habit(r"\blambda\s*\(", "brackets around what a `lambda` takes are Python 2",
           "write one name, `p`, and `p[0]` and `p[1]` behind the colon"),
    Habit(rf"^\s*def\s+\w+\s*\((?:[^()]*,)?\s*({RESERVED})\s*[,)=]", "`{0}` is a reserved word of Python",
           "use another name"),
    Habit(r"^\s*(?:from|import)\s+[\w.]*\w-\w", "the name of a module has no `-` in it",
           "a package that others import needs a name with `_` in its place"),
    Habit(r"^\s*from\s+[\w.]+\s+import\s+(?:\w+\s*,\s*)*\w+\s+(?!as\b)\w", "a name has no space in it",
           "write `,` between two names"),
    Habit(r"\blambda\b[^:]*$", "a colon `:` is missing behind what the `lambda` takes"),
    Habit(r"^\s*(global|nonlocal)\s+(?:\w+\s*,\s*)*\w+\s*=", "`{0}` gives a name no value",
           "write the name alone, and give it its value on the next line"),
    Habit(r"(->|\*\*|//|[-+*/%=!<>]=|[-+*/%=<>]|\b(?:and|or|not|in))\s*(?:[)\]}:].*)?$",
           "a value is missing behind `{0}`"),
)  # fmt: skip
"""What a line may have where nothing else is wrong with it."""
HEADLESS = (
    Habit(r"^\s*elif\b", "there is no `if` that this `elif` belongs to",
           "begin it below the `i` of its `if`, right behind that block and above any `else:`"),
    Habit(r"^\s*else\b", "there is no `if` that this `else` belongs to",
           "begin it below the `i` of its `if`, right behind that block"),
    Habit(r"^\s*(except|finally)\b", "there is no `try:` for this `{0}`",
           "write `try:` above the lines that it is for"),
)  # fmt: skip
"""What a line lacks above it that is good Python by itself."""
