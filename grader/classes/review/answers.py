"""Answers that are no page of the class: files, and what went wrong."""

from __future__ import annotations

from typing import BinaryIO

from flask import Response, jsonify, render_template, request, send_file
from werkzeug.exceptions import HTTPException, NotFound
from werkzeug.wrappers import Response as AnyResponse

from grader.errors import GraderError

SCRIPT = "X-Asked-By"
"""The header with which our script asks: it is answered with what changed, as JSON."""


def sent(file: BinaryIO | None, mimetype: str, *, download: str = "") -> Response:
    """A file that is open; under the name `download` it is kept and not shown. Raises NotFound where there is none."""
    if file is None:
        raise NotFound("There is no such file.")
    return send_file(
        file, mimetype=mimetype, as_attachment=bool(download), download_name=download or None, max_age=0
    )


def with_code(response: Response, code: int) -> Response:
    """The same answer with another code."""
    response.status_code = code
    return response


def graders(error: GraderError) -> AnyResponse:
    """What the grader says is wrong."""
    return _told(500, "This did not work", f"{error.message}. {error.hint}".strip(), again=False)


def failed(error: HTTPException) -> AnyResponse:
    """Any other answer than a page. After a link of another site, browsers hold back the cookie that they have just
    been given; the page itself asks once more, and that is no other site's request."""
    code = error.code or 500
    title = {403: "Not allowed", 404: "Not found", 413: "Too much text"}.get(code, "This did not work")
    cross = request.headers.get("Sec-Fetch-Site") == "cross-site"
    return _told(code, title, error.description or "", again=code == 403 and request.path == "/" and cross)


def _told(code: int, title: str, text: str, *, again: bool) -> AnyResponse:
    if SCRIPT in request.headers:
        return with_code(jsonify(error=text), code)
    return Response(render_template("told.html", title=title, text=text, again=again), code)
