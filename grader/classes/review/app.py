"""The pages of a review and what their forms do. Begin reading at `create_app`."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from importlib.resources import files
from typing import BinaryIO

from flask import (
    Flask,
    Response,
    get_template_attribute,
    jsonify,
    redirect,
    render_template,
    request,
    send_file,
    session,
    url_for,
)
from jinja2 import StrictUndefined
from markupsafe import Markup, escape
from werkzeug.exceptions import Forbidden, HTTPException, NotFound
from werkzeug.wrappers import Response as AnyResponse

from grader.classes.gradebook import Row
from grader.classes.review.cards import MANUAL, Cards, Draft, Wrong, author_of, card, cards, override_of
from grader.classes.review.guard import (
    FRAMED,
    REPORTS,
    evidence_of,
    guard,
    open_evidence,
    open_report,
    reports_of,
)
from grader.classes.review.session import Conflict, ReviewSession, plain
from grader.classes.review.submissions import FILTERS, Item, place_of
from grader.errors import GraderError, RubricError
from grader.model.result import Override
from grader.report.html.shell import environment, style
from grader.report.sentences import SIGNS
from grader.report.view import of_points
from grader.rubric.model import Criterion
from grader.wording import number


class _Pages(Flask):
    """Flask with our templates' rules: no one's text becomes markup, and what hides or steers is written out."""

    jinja_options = {  # noqa: RUF012 - as Flask has it
        "finalize": environment().finalize,
        "lstrip_blocks": True,
        "trim_blocks": True,
        "undefined": StrictUndefined,
    }


def create_app(review: ReviewSession, *, port: int, token: str, author: str) -> Flask:
    """Return the application for `review`, to be reached at 127.0.0.1 and that port by those who know the token.

    `author` stands beside decisions until someone says another name in the page.
    """
    app = _Pages(__name__, static_folder=None)
    app.extensions["review"] = review
    guard(app, port=port, token=token)
    app.jinja_env.filters.update(number=number, of_points=of_points, verbatim=escape)
    app.jinja_env.globals.update(SIGNS=SIGNS, FILTERS=FILTERS)
    app.context_processor(lambda: {"csrf": session.get("csrf", ""), "author": _author(author)})
    view = _Views(review, author)
    app.add_url_rule("/", view_func=view.listing)
    app.add_url_rule("/author", view_func=view.name, methods=["POST"])
    app.add_url_rule("/look.css", view_func=view.look)
    app.add_url_rule("/review.js", view_func=view.script)
    app.add_url_rule("/s/<key>/", view_func=view.submission)
    app.add_url_rule("/s/<key>/c/<criterion>", view_func=view.decide, methods=["POST"])
    app.add_url_rule("/s/<key>/report/<name>", view_func=view.report)
    app.add_url_rule("/s/<key>/evidence/<name>", view_func=view.evidence)
    app.register_error_handler(HTTPException, failed)
    app.register_error_handler(GraderError, graders)
    return app


class _Views:
    """One function an address."""

    def __init__(self, review: ReviewSession, author: str) -> None:
        self._session, self._default_author = review, author

    def listing(self) -> str:
        """All submissions, or those that a filter shows."""
        items = self._session.submissions.items()
        place = place_of(items, request.args)
        return render_template(
            "list.html",
            run=self._session.submissions.batch().run,
            place=place,
            items=place.shown,
            troubles=self._troubles(),
        )

    def submission(self, key: str) -> str:
        """One submission with its report and its forms."""
        item = self._item(key)
        drafts = {}
        if request.args.get("saved"):
            drafts[request.args["saved"]] = Draft(saved=f"saved {request.args.get('at', '')}", typed=False)
        return self._page(item, drafts)

    def decide(self, key: str, criterion: str) -> AnyResponse:
        """Put a decision into `overrides.yaml`, change it, or take it out."""
        item = self._item(key)
        asked = next((c for c in self._session.rubric.rubric.criteria if c.id == criterion), None)
        if asked is None:
            raise NotFound("The rubric has no such criterion.")
        form = request.form
        typed = Draft(points=form.get("points", ""), comment=form.get("comment", ""))
        try:
            override = self._wanted(asked)
            waits = self._session.save(item, criterion, override, form.get("seen", ""))
        except Conflict:
            return self._not_saved(item, criterion, _draft(typed, conflict=True), 409)
        except Wrong as wrong:
            return self._not_saved(item, criterion, _draft(typed, error=str(wrong)), 400)
        except GraderError as error:
            hint = f" Hint: {error.hint}." if error.hint else ""
            return self._not_saved(
                item, criterion, _draft(typed, error=f"Not saved: {error.message}.{hint}"), 422
            )
        return self._saved(item, criterion, waits)

    def name(self) -> AnyResponse:
        """Remember who decides."""
        try:
            session["author"] = author_of(request.form.get("author", ""))
        except Wrong as wrong:
            raise Forbidden(str(wrong)) from wrong
        if SCRIPT in request.headers:
            return jsonify(author=session["author"], said=f"saved {_now()}")
        item = self._session.submissions.item(request.form.get("key", ""))
        keep = place_of((), request.form).kept
        return redirect(
            url_for("submission", key=item.key, **keep) if item else url_for("listing", **keep), 303
        )

    def report(self, key: str, name: str) -> Response:
        """One of the reports, for the frame in the page."""
        item = self._item(key)
        response = sent(open_report(self._session.path / item.key, name), REPORTS.get(name, ""))
        response.headers["Content-Security-Policy"] = FRAMED
        return response

    def evidence(self, key: str, name: str) -> Response:
        """A recording, to be kept."""
        item = self._item(key)
        file = open_evidence(self._session.path / item.key, name)
        return sent(file, "application/octet-stream", download=f"{item.key}-{name}")

    def look(self) -> Response:
        """Return the style of all pages."""
        return Response(style() + _own("review.css"), mimetype="text/css")

    def script(self) -> Response:
        """Saves without a reload, and keys."""
        return Response(_own("review.js"), mimetype="text/javascript")

    def _item(self, key: str) -> Item:
        item = self._session.submissions.item(key)
        if item is None:
            raise NotFound("The class has no such submission.")
        return item

    def _wanted(self, asked: Criterion) -> Override | None:
        form = request.form
        if form.get("do") == "remove":
            return None
        return override_of(
            form.get("points", ""),
            form.get("comment", ""),
            _author(self._default_author),
            least=min(0.0, asked.extra),
            most=asked.points + max(0.0, asked.extra),
            reason=asked.check != MANUAL,
        )

    def _page(self, item: Item, drafts: Mapping[str, Draft]) -> str:
        row, found, troubles = self._row(item, drafts)
        folder = self._session.path / item.key
        there = reports_of(folder)
        return render_template(
            "submission.html",
            run=self._session.submissions.batch().run,
            item=item,
            row=row,
            cards=found,
            place=place_of(self._session.submissions.items(), request.values, at=item.key),
            waits=self._session.waits(item),
            troubles=troubles,
            report=next((name for name in ("report.html", "report.md") if name in there), ""),
            files=[name for name in there if name not in {"report.html", "result.json"}],
            evidence=evidence_of(folder),
        )

    def _row(self, item: Item, drafts: Mapping[str, Draft]) -> tuple[Row, Cards, list[str]]:
        """The submission as it counts now, its cards, and what is in the way of saving."""
        row = self._session.submissions.row(item.key) or Row(entry=item.entry, result=None)
        rubric = self._session.rubric.rubric
        try:
            overrides = self._session.overrides()
            result = self._session.result(item, overrides)
            row = row.model_copy(update={"result": result}) if result else row
            decided, troubles = overrides.get(item.entry.id, {}), self._troubles()
        except RubricError as error:
            decided = {o.criterion: plain(o) for o in row.result.overrides}
            troubles = ["Nothing can be saved until overrides.yaml is fixed:", *error.faults]
        return row, cards(row, rubric, decided, drafts), troubles

    def _troubles(self) -> list[str]:
        found = []
        if self._session.batch_runs():
            found.append(
                "A batch is running in this folder. What you decide is kept; reports and gradebook follow "
                "when it has ended."
            )
        if self._session.background.trouble and not found:
            found.append(
                f"The gradebook is not written yet; it will be tried again: {self._session.background.trouble}"
            )
        return found

    def _not_saved(self, item: Item, criterion: str, draft: Draft, code: int) -> AnyResponse:
        if SCRIPT not in request.headers:
            return Response(self._page(item, {criterion: draft}), code)
        data = {"error": draft.error} | (self._parts(item, criterion, draft) if draft.conflict else {})
        return with_code(jsonify(data), code)

    def _saved(self, item: Item, criterion: str, waits: str) -> AnyResponse:
        at = _now()
        go_on = request.form.get("do") == "next"
        place = place_of(self._session.submissions.items(), request.form, at=item.key)
        if SCRIPT in request.headers:
            to = url_for("submission", key=place.after, **place.kept) if go_on and place.after else ""
            said = f"saved {at}" + (f"; {waits}" if waits else "")
            return jsonify(self._parts(item, criterion, None) | {"said": said, "go": to})
        if go_on and place.after:
            return redirect(url_for("submission", key=place.after, **place.kept), 303)
        back = url_for("submission", key=item.key, saved=criterion, at=at, **place.kept)
        return redirect(f"{back}#c-{criterion}", 303)

    def _parts(self, item: Item, criterion: str, draft: Draft | None) -> dict[str, object]:
        """What of a card changes, as a script puts it in place."""
        row, _, _ = self._row(item, {})
        decided = self._session.overrides().get(item.entry.id, {})
        one = card(row, self._session.rubric.rubric, criterion, decided, {criterion: draft} if draft else {})
        return {
            "head": str(get_template_attribute("parts.html", "head")(one)),
            "notes": str(get_template_attribute("parts.html", "notes")(one)),
            "seen": one.seen,
            "decided": one.override is not None,
            "total": f"{number(row.result.points)} of {number(row.result.max_points)}",
            "status": one.criterion.status.value,
        }


def _author(default: str) -> str:
    return str(session.get("author", default))


def _draft(typed: Draft, *, error: str = "", conflict: bool = False) -> Draft:
    return Draft(points=typed.points, comment=typed.comment, error=error, conflict=conflict)


def _now() -> str:
    return f"{datetime.now():%H:%M:%S}"  # noqa: DTZ005 - the time on the wall


def _own(name: str) -> Markup:
    return Markup(files(__package__).joinpath("look", name).read_text(encoding="utf-8"))  # noqa: S704 - ours


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
    """Return the same answer with another code."""
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
