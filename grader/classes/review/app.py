"""The pages of a review and what their forms do. Begin reading at `create_app`; the pages are Jinja templates in
`templates/`."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from importlib.resources import files
from typing import BinaryIO

from flask import (
    Flask,
    Response,
    current_app,
    get_template_attribute,
    jsonify,
    make_response,
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

from grader.classes.batch.renew_results import figures_in
from grader.classes.gradebook import GradebookRow
from grader.classes.overrides import bounds
from grader.classes.review.cards import (
    MANUAL,
    Cards,
    CodeFile,
    Decided,
    Draft,
    Known,
    Wrong,
    author_of,
    bank_comment_of,
    card,
    cards,
    code_of,
    comment_name,
    override_of,
    points_words,
)
from grader.classes.review.guard import (
    FRAMED,
    REPORTS,
    evidence_of,
    guard,
    open_evidence,
    open_report,
    reports_of,
)
from grader.classes.review.session import Conflict, ReviewSession, override_as_written
from grader.classes.review.submissions import ListedSubmission, across, alike, place_of
from grader.errors import GraderError, RubricError
from grader.model.result import AppliedOverride, WrittenOverride
from grader.report.html.page import render_html
from grader.report.html.shell import environment, style
from grader.report.sentences import SIGNS, STATES
from grader.report.view import of_points
from grader.results import RESULT
from grader.rubric.model import Criterion
from grader.wording import number, plural


class _Pages(Flask):
    """Flask with our templates' rules: no one's text becomes markup, what hides or steers is written out, and they are
    compiled once."""

    jinja_options = {  # noqa: RUF012 - as Flask has it
        "bytecode_cache": environment().bytecode_cache,
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
    app.jinja_env.globals.update(SIGNS=SIGNS, STATES=STATES, points_words=points_words)
    version = secrets.token_hex(8)  # of this review: what browsers keep is asked for by no other address
    app.context_processor(
        lambda: {"csrf": session.get("csrf", ""), "author": _author(author), "version": version}
    )
    view = _Views(review, author)
    app.add_url_rule("/", view_func=view.listing)
    app.add_url_rule("/criteria", view_func=view.criteria)
    app.add_url_rule("/comments", view_func=view.comments)
    app.add_url_rule("/comments/<criterion>", view_func=view.comment, methods=["POST"])
    app.add_url_rule("/author", view_func=view.name, methods=["POST"])
    app.add_url_rule("/look.css", view_func=view.look)
    app.add_url_rule("/review.js", view_func=view.script)
    app.add_url_rule("/s/<key>/", view_func=view.submission)
    app.add_url_rule("/s/<key>/c/<criterion>", view_func=view.decide, methods=["POST"])
    app.add_url_rule("/s/<key>/report/<name>", view_func=view.report)
    app.add_url_rule("/s/<key>/evidence/<name>", view_func=view.evidence)
    app.register_error_handler(HTTPException, show_http_error)
    app.register_error_handler(GraderError, show_grader_error)
    return app


class _Views:
    """One function an address."""

    def __init__(self, review: ReviewSession, author: str) -> None:
        self._session, self._default_author = review, author

    def listing(self) -> str:
        """Return the page of all submissions, or of those that a filter shows."""
        items = self._session.items()
        place = place_of(items, request.args)
        return render_template(
            "list.html",
            said=self._masked_text,
            titles={c.id: c.title for c in self._session.rubric.rubric.criteria},
            run=self._session.submissions.batch().run,
            place=place,
            items=place.rows,
            troubles=self._troubles(),
        )

    def criteria(self) -> str:
        """Return the page of the criteria, each with how many submissions wait for a decision on it."""
        items = self._session.items()
        named = [(c.id, c.title) for c in self._session.rubric.rubric.criteria]
        return render_template(
            "criteria.html",
            run=self._session.submissions.batch().run,
            place=place_of((), {}),
            found=across(items, named),
            progress=self._session.progress().most_common(),
            troubles=self._troubles(),
        )

    def submission(self, key: str) -> str:
        """Return the page of one submission with its report and its forms."""
        item = self._item(key)
        drafts = {}
        if request.args.get("saved"):
            drafts[request.args["saved"]] = Draft(saved=f"saved {request.args.get('at', '')}", typed=False)
        return self._page(item, drafts)

    def decide(self, key: str, criterion: str) -> AnyResponse:
        """Put a decision into `overrides.yaml`, change it, or take it out."""
        item = self._item(key)
        asked = self._criterion(criterion)
        form = request.form
        chosen = form.getlist("bank")
        typed = Draft(points=form.get("points", ""), comment=form.get("comment", ""), comments=chosen)
        typed = replace(typed, answer=form.get("answer", ""))
        try:
            override = self._override_from_form(item, asked)
            waits = self._saved_as(item, criterion, override)
        except Conflict:
            return self._not_saved(item, criterion, replace(typed, conflict=True), 409)
        except Wrong as wrong:
            return self._not_saved(item, criterion, replace(typed, error=str(wrong)), 400)
        except GraderError as error:
            hint = f" Hint: {error.hint}." if error.hint else ""
            return self._not_saved(
                item, criterion, replace(typed, error=f"Not saved: {error.message}.{hint}"), 422
            )
        return self._saved_response(item, criterion, waits)

    def _saved_as(self, item: ListedSubmission, criterion: str, wanted: WrittenOverride | None) -> str:
        """Save the decision for one, or for all that are alike; return what is to be said of that."""
        do, session = request.form.get("do"), self._session
        if do == "undo" and (one := session.decisions().written.get(item.entry.id, {}).get(criterion)):
            return f"{plural(session.undo_together(criterion, one.together), 'submission')} taken back"
        seen = request.form.get("seen", "")
        if do == "alike" and wanted is not None:
            return plural(session.save_together(item, criterion, wanted, seen), "submission")
        return session.save(item, criterion, wanted, seen, soon=do != "next")

    def comments(self) -> str:
        """Return the page of the bank's comments, each with a form, and one for a new one."""
        return self._bank_page(request.args.get("c", ""), "")

    def comment(self, criterion: str) -> AnyResponse:
        """Change a comment for all that have it, or add one."""
        asked = self._criterion(criterion)
        form, (least, most) = request.form, bounds(asked)
        known = self._session.decisions().bank.get(criterion, {})
        if form.get("id") and form["id"] not in known:
            raise NotFound("There is no such comment any more.")
        try:
            wanted = bank_comment_of(form.get("text", ""), form.get("points", ""), least=least, most=most)
            name = form.get("id", "") or comment_name(wanted.text, known)
            many = self._session.save_comment(criterion, name, wanted)
        except Wrong as wrong:
            return Response(self._bank_page(criterion, str(wrong)), 400)
        return Response(self._bank_page(criterion, f"saved {_now()}: {plural(many, 'submission')} with it"))

    def _bank_page(self, criterion: str, told: str) -> str:
        return render_template(
            "comments.html",
            run=self._session.submissions.batch().run,
            place=place_of((), {}),
            criteria=[c for c in self._session.rubric.rubric.criteria if c.id == criterion or not criterion],
            bank=self._session.decisions().bank,
            told=told,
        )

    def name(self) -> AnyResponse:
        """Remember who decides."""
        try:
            session["author"] = author_of(request.form.get("author", ""))
        except Wrong as wrong:
            raise Forbidden(str(wrong)) from wrong
        if SCRIPT in request.headers:
            return jsonify(author=session["author"], said=f"saved {_now()}")
        item = self._session.item(request.form.get("key", ""))
        keep = place_of((), request.form).kept
        return redirect(
            url_for("submission", key=item.address, **keep) if item else url_for("listing", **keep), 303
        )

    def report(self, key: str, name: str) -> Response:
        """Return one of the reports, for the frame in the page."""
        item = self._item(key)
        if item.alias:
            return self._report_without_names(item, name)
        response = send_opened(open_report(self._session.path / item.key, name), REPORTS.get(name, ""))
        response.headers["Content-Security-Policy"] = FRAMED
        return response

    def evidence(self, key: str, name: str) -> Response:
        """Return a recording, to be kept."""
        item = self._item(key)
        # a recording names the repository, and its files may name the student
        if item.alias:
            raise NotFound(HIDDEN)
        file = open_evidence(self._session.path / item.key, name)
        return send_opened(file, "application/octet-stream", download=f"{item.key}-{name}")

    def _report_without_names(self, item: ListedSubmission, name: str) -> Response:
        row, _, _ = self._row(item, {})
        if name != "report.html" or row.result.error is not None:
            raise NotFound(HIDDEN)
        rubric, mask = self._session.rubric, self._session.mask(item, self._commit(item))
        figures = figures_in(self._session.path / item.key, row.result, rubric.rubric)
        shown = mask.record(figures) if mask and figures else None
        page = render_html(row.result, rubric.rubric, shown, docs=rubric.docs)
        return Response(page, mimetype="text/html", headers={"Content-Security-Policy": FRAMED})

    def _commit(self, item: ListedSubmission) -> str | None:
        row = self._session.submissions.row(item.key)
        return row.result.submission.commit if row else None

    def _masked_text(self, item: ListedSubmission, text: str) -> str:
        mask = self._session.mask(item, None)
        return mask.text(text) if mask else text

    def look(self) -> Response:
        """Return the style of all pages."""
        return _cacheable(style() + _own("review.css"), "text/css")

    def script(self) -> Response:
        """Return the script, which saves without a reload and knows keys."""
        return _cacheable(_own("review.js"), "text/javascript")

    def _item(self, key: str) -> ListedSubmission:
        item = self._session.item(key)
        if item is None:
            raise NotFound(NO_SUBMISSION)
        return item

    def _criterion(self, name: str) -> Criterion:
        for criterion in self._session.rubric.rubric.criteria:
            if criterion.id == name:
                return criterion
        raise NotFound("The rubric has no such criterion.")

    def _override_from_form(self, item: ListedSubmission, asked: Criterion) -> WrittenOverride | None:
        form, (least, most) = request.form, bounds(asked)
        if form.get("do") in {"remove", "undo"}:
            return None
        known = self._session.decisions().bank.get(asked.id, {})
        comments = [name for name in dict.fromkeys(form.getlist("bank")) if name in known]
        wanted = override_of(
            form.get("points", ""),
            form.get("comment", ""),
            _author(self._default_author),
            least=least,
            most=most,
            reason=asked.check != MANUAL,
            answer=form.get("answer", ""),
            comments=comments,
            pointed=any((known[name].points, known[name].change) != (None, None) for name in comments),
        )
        answered = self._session.answered(item, asked.id, wanted.answer) if form.get("do") != "alike" else ()
        return wanted.model_copy(update={"answered": answered})

    def _page(self, item: ListedSubmission, drafts: Mapping[str, Draft]) -> str:
        row, found, troubles = self._row(item, drafts)
        folder = self._session.path / item.key
        there = reports_of(folder)
        items = self._session.items()
        place = place_of(items, request.values, at=item.key)
        ids = [criterion.id for criterion in row.result.criteria]
        shown = [place.criterion] if place.criterion in ids else ids
        return render_template(
            "submission.html",
            run=self._session.submissions.batch().run,
            item=item,
            row=row,
            cards=found.only(place.criterion) if place.criterion in ids else found,
            place=place,
            alike={name: len(alike(items, name, item)) for name in shown},
            code=self._code(item, place.criterion) if place.criterion in ids else (),
            anchor=f"#criterion-{ids.index(place.criterion) + 1}" if place.criterion in ids else "",
            waits=self._session.waits(item),
            troubles=troubles,
            report=next((name for name in ("report.html", "report.md") if name in there), ""),
            files=[name for name in there if name not in {"report.html", RESULT} and not item.alias],
            evidence=evidence_of(folder) if not item.alias else [],
        )

    def _code(self, item: ListedSubmission, criterion: str) -> list[CodeFile]:
        row = self._session.submissions.row(item.key)
        result = next((c for c in row.result.criteria if c.id == criterion), None) if row else None
        if result is None:
            return []
        mask = self._session.mask(item, self._commit(item))
        hide = mask.text if mask else str
        return code_of(
            self._session.path / item.key, self._criterion(criterion), result, self._session.starter, hide
        )

    def _row(
        self, item: ListedSubmission, drafts: Mapping[str, Draft]
    ) -> tuple[GradebookRow, Cards, list[str]]:
        """Return the submission as it counts now, its cards, and what is in the way of saving."""
        row = self._session.submissions.row(item.key)
        if row is None:  # a batch has taken it out of the class since `item` was read
            raise NotFound(NO_SUBMISSION)
        rubric = self._session.rubric.rubric
        try:
            found = self._session.decisions()
            result = self._session.result(item, found.come_to)
            row = row.model_copy(update={"result": result}) if result else row
            known, troubles = self._known_of(item), self._troubles()
        except RubricError as error:
            known = Known(decided={o.criterion: as_written(o) for o in row.result.overrides}, bank={})
            troubles = ["Nothing can be saved until overrides.yaml is fixed:", *error.faults]
            # the faults name submissions
            troubles = troubles[:1] if self._session.blind else troubles
        mask = self._session.mask(item, row.result.submission.commit)
        if mask:
            without = mask.result(row.result, item.title)
            if without is None:
                raise NotFound(HIDDEN)
            row = row.model_copy(update={"result": without})
        return row, cards(row, rubric, known, drafts), troubles

    def _known_of(self, item: ListedSubmission) -> Known:
        found, name = self._session.decisions(), item.entry.id
        come_to, written = found.come_to.get(name, {}), found.written.get(name, {})
        decided = {of: Decided(written=written[of], override=come_to[of]) for of in written}
        asked = self._session.requests().found.get(name, {})
        if mask := self._session.mask(item, None):
            asked = {
                of: tuple(replace(one, text=mask.text(one.text), source="") for one in ones)
                for of, ones in asked.items()
            }
        return Known(decided=decided, bank=found.bank, requests=asked)

    def _troubles(self) -> list[str]:
        faults = self._session.requests().faults
        # their places name the students who asked
        found = [f"{len(faults)} requests are left out"] if faults and self._session.blind else [*faults[:10]]
        if self._session.batch_runs():
            found.append(
                "A batch is running in this folder. What you decide is kept; reports and gradebook follow "
                "when it has ended."
            )
        if self._session.background.trouble and not self._session.batch_runs():
            found.append(
                "The gradebook is not written yet; it will be tried again"
                + ("" if self._session.blind else f": {self._session.background.trouble}")
            )
        return found

    def _not_saved(self, item: ListedSubmission, criterion: str, draft: Draft, code: int) -> AnyResponse:
        if SCRIPT not in request.headers:
            return Response(self._page(item, {criterion: draft}), code)
        data = {"error": draft.error} | (self._parts(item, criterion, draft) if draft.conflict else {})
        return make_response(jsonify(data), code)

    def _saved_response(self, item: ListedSubmission, criterion: str, waits: str) -> AnyResponse:
        at = _now()
        go_on = request.form.get("do") == "next"
        place = place_of(self._session.items(), request.form, at=item.key)
        to = url_for("submission", key=place.after, **place.kept) if go_on and place.after else ""
        if go_on and place.criterion and not to:
            to = url_for("criteria")
        if SCRIPT in request.headers:
            said = f"saved {at}" + (f"; {waits}" if waits else "")
            return jsonify(self._parts(item, criterion, None) | {"said": said, "go": to})
        if to:
            # 303: the browser asks for a page again, so that to reload it does not save once more
            return redirect(to, 303)
        back = url_for("submission", key=item.address, saved=criterion, at=at, **place.kept)
        return redirect(f"{back}#c-{criterion}", 303)

    def _parts(self, item: ListedSubmission, criterion: str, draft: Draft | None) -> dict[str, object]:
        """Return what of a card changes, as a script puts it in place."""
        row, _, _ = self._row(item, {})
        drafts = {criterion: draft} if draft else {}
        one = card(row, self._session.rubric.rubric, criterion, self._known_of(item), drafts)
        return {
            "head": str(get_template_attribute("parts.html", "head")(one)),
            "notes": str(get_template_attribute("parts.html", "notes")(one)),
            "seen": one.seen,
            "decided": one.override is not None,
            "together": bool(one.together),
            "total": f"{number(row.result.points)} of {number(row.result.max_points)}",
            "status": one.criterion.status.value,
        }


def as_written(applied: AppliedOverride) -> Decided:
    """Return a decision of a result, where the file itself cannot be read."""
    written = WrittenOverride(
        points=applied.points, comment=applied.comment, author=applied.author, date=applied.date
    )
    return Decided(written=written, override=override_as_written(applied))


def _author(default: str) -> str:
    return str(session.get("author", default))


def _now() -> str:
    return f"{datetime.now():%H:%M:%S}"  # noqa: DTZ005 - the time on the wall


def _cacheable(text: str, mimetype: str) -> Response:
    """Return what does not change while a review runs: browsers need not ask again on each page."""
    return Response(text, mimetype=mimetype, headers={"Cache-Control": "private, max-age=86400, immutable"})


def _own(name: str) -> Markup:
    return Markup(files(__package__).joinpath("static", name).read_text(encoding="utf-8"))  # noqa: S704 - ours


HIDDEN = "It is not shown while names are hidden."
NO_SUBMISSION = "The class has no such submission."
SCRIPT = "X-Asked-By"
"""The header with which our script asks: it is answered with what changed, as JSON."""


def send_opened(file: BinaryIO | None, mimetype: str, *, download: str = "") -> Response:
    """Return a file that is open; one with a `download` name is kept and not shown. Raises NotFound for None."""
    if file is None:
        raise NotFound("There is no such file.")
    return send_file(
        file, mimetype=mimetype, as_attachment=bool(download), download_name=download or None, max_age=0
    )


def show_grader_error(error: GraderError) -> AnyResponse:
    """Return the answer that says what the grader says is wrong."""
    blind = current_app.extensions["review"].blind
    text = (
        "The grader says why to those who see names." if blind else f"{error.message}. {error.hint}".strip()
    )
    return _message_page(500, "This did not work", text, again=False)


def show_http_error(error: HTTPException) -> AnyResponse:
    """Return any other answer than a page. After a link of another site, browsers hold back the cookie that they have
    just been given; the page itself asks once more, and that is no other site's request."""
    code = error.code or 500
    title = {403: "Not allowed", 404: "Not found", 413: "Too much text"}.get(code, "This did not work")
    cross = request.headers.get("Sec-Fetch-Site") == "cross-site"
    return _message_page(
        code, title, error.description or "", again=code == 403 and request.path == "/" and cross
    )


def _message_page(code: int, title: str, text: str, *, again: bool) -> AnyResponse:
    if SCRIPT in request.headers:
        return make_response(jsonify(error=text), code)
    return Response(render_template("told.html", title=title, text=text, again=again), code)
