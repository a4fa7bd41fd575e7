"""What every page shares: templates in which no one's text becomes markup, the look, and what a page may load."""

from __future__ import annotations

import base64
import hashlib
import re
import sys
from contextlib import suppress
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import DictLoader, Environment, FileSystemBytecodeCache, StrictUndefined, pass_context
from jinja2.bccache import Bucket
from jinja2.runtime import Context
from markupsafe import Markup, escape

from grader.report.text import code_parts, line
from grader.report.view import of_points, sentence
from grader.wording import number

LIMIT = 1000
SUFFIX = ".html"


class Bytecode(FileSystemBytecodeCache):
    """Compiled templates, beside the compiled modules and by the same rules: to compile the report's takes a sixth of a
    second. What changes a template, or Python's version, makes it compiled again."""

    def load_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):  # an installation that only others may read
            super().load_bytecode(bucket)

    def dump_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):
            if not sys.dont_write_bytecode:
                super().dump_bytecode(bucket)


@cache
def environment() -> Environment:
    """Return the templates. A text that one puts out is one visible line of at most `limit` characters, escaped."""
    made = Environment(
        autoescape=True,
        bytecode_cache=Bytecode(str(Path(__file__).with_name("__pycache__"))),
        finalize=_make_visible,
        loader=DictLoader(_templates()),
        lstrip_blocks=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    ours = {"code": _code, "joined": _join_signs, "to_write": _to_write}
    made.filters.update(number=number, of_points=of_points, sentence=sentence, **ours)
    return made


@cache
def own_file(name: str, package: str = __package__) -> str:
    """Return the text of a file beside this one, or of another package."""
    return files(package).joinpath(name).read_text(encoding="utf-8")


@cache
def style() -> Markup:
    """Return the look of all pages, for a `<style>`."""
    return Markup(_unindent(own_file("style.css")))  # noqa: S704 - ours


@cache
def script(name: str) -> Markup:
    """Return a script of ours, for a `<script>`; `policy` has to name it."""
    return Markup(own_file(name))  # noqa: S704 - ours


def policy(*scripts: str) -> str:
    """Return the Content-Security-Policy of a page that loads nothing and runs these scripts alone."""
    # by their digests: no other script runs, whatever gets into the page
    digests = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    return (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src {allowed}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def _templates() -> dict[str, str]:
    folder = files(__package__).joinpath("templates")
    return {
        file.name: _unindent(file.read_text(encoding="utf-8"))
        for file in folder.iterdir()
        if file.name.endswith(SUFFIX)
    }


def _unindent(text: str) -> str:
    """Return a text without the blanks that lines begin with: no page of ours needs them."""
    return "\n".join(row.strip() for row in text.splitlines())


@lru_cache(maxsize=2048)
def prose(text: str) -> Markup:
    """Return a text in which what is code is marked as such; the reports of a class say much the same."""
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if is_code else escape(part)
        for part, is_code in code_parts(text)
    )


TO_WRITE = re.compile(
    r"(?:on line \d+, |in place of lines? [\d to]+ )?(?:write|add|publish|use) <code>(.*?)</code>",
    re.IGNORECASE,
)
IS_CODE = re.compile(r"[(<=\"']")


def _to_write(step: Markup) -> str:
    """Return the code that a step of a hint says to write, for copying; empty where it says none."""
    found = TO_WRITE.match(step)
    code = Markup(found[1]).unescape() if found else ""  # noqa: S704 - read, not shown
    return code if IS_CODE.search(code) else ""


@pass_context
def _join_signs(context: Context, text: str) -> Markup:
    """Return a line of code in which no arrow and no end of a comment is broken where the line is."""
    parts = re.split("(<!--|-+>)", line(text, context.get("limit", LIMIT)))
    return Markup("").join(
        # every second part is one that the pattern has found
        Markup('<span class="join">{}</span>').format(part) if i % 2 else escape(part)
        for i, part in enumerate(parts)
    )


@pass_context
def _code(context: Context, text: str) -> Markup:
    return prose(line(text, context.get("limit", LIMIT)))


@pass_context
def _make_visible(context: Context, value: Any) -> Any:  # noqa: ANN401 - whatever a template puts out
    """Return foreign text made visible. Markup that was drawn here and what is not text stay as they are."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return line(value, context.get("limit", LIMIT))
    return value
