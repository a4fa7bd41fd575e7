"""The commands for a whole class: grade it, work on the results, publish and return them; and those for a course."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.classes.feedback.forms import FORGES, FORMS
from grader.cli.commands.grading import DEFAULT_OUT
from grader.cli.declare import (
    BATCH_FOLDER,
    CLASS_EXIT_CODES,
    FEEDBACK_EXIT_CODES,
    INSTRUCTORS,
    MERGE_EXIT_CODES,
    PUBLISH_EXIT_CODES,
    REPORT_EXIT_CODES,
    REQUESTS_EXIT_CODES,
    RUBRIC,
    STATIC,
    STDOUT,
    Argument,
    AuthorOption,
    BookColumn,
    BookForm,
    BookTemplate,
    DraftsFlag,
    Flag,
    JobsOption,
    JsonFlag,
    LocalOption,
    OnlyOption,
    Option,
    PackageOption,
    SandboxOption,
    command,
    count,
    loading,
    percent,
    port,
)
from grader.errors import ExitCode, UsageError
from grader.installable import require_extra
from grader.report.forms import FORMS as REPORT_FORMS

CLASS = Argument("DIR", BATCH_FOLDER)
ROSTER = Argument(
    "ROSTER|FOLDER",
    "a CSV file (id,source,...), a folder of submissions, the zip that Moodle or Canvas offers for download,"
    " or an export of GitHub Classroom or GitLab",
)
BATCH_OUT = Option(
    "--out",
    "DIR",
    "write results to DIR/<id>/, with gradebook.csv and results.jsonl (default: ./grader-results)",
)
BEFORE = Option("--before", "TIME", "grade the last commit before TIME (default: the rubric's deadline)")
REMOTE_ONLY = Flag("--remote-only", "do not let the roster name any path of this machine")
CLUSTER = Option("--cluster", "ADDRESS", "grade on a Dask cluster: tls://HOST:8786, or local")
CLUSTER_INSECURE = Flag(
    "--cluster-insecure",
    "accept a cluster without certificates (tcp://): anyone who reaches it can run programs there",
)
EXCHANGE = Option(
    "--exchange", "URL", "where a cluster's workers leave results (default: the folder of --out)"
)


@command("batch", group=INSTRUCTORS, exit_codes=CLASS_EXIT_CODES, runs_code=True)
def batch(
    *,
    roster: Annotated[Path, ROSTER],
    rubric: Annotated[str, RUBRIC],
    out: Annotated[Path | None, BATCH_OUT] = None,
    package: PackageOption = None,
    jobs: JobsOption = None,
    only: OnlyOption = (),
    before: Annotated[str | None, BEFORE] = None,
    allow_local: LocalOption = (),
    remote_only: Annotated[bool, REMOTE_ONLY] = False,
    static: Annotated[bool, STATIC] = False,
    cluster: Annotated[str | None, CLUSTER] = None,
    cluster_insecure: Annotated[bool, CLUSTER_INSECURE] = False,
    exchange: Annotated[str | None, EXCHANGE] = None,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Grade a class, or continue a batch that was stopped."""
    with loading():
        from grader.classes.batch.run import BatchOptions
        from grader.cli import class_actions, publishing
        from grader.rubric.load import load_rubric
    loaded = load_rubric(rubric)
    out = out or DEFAULT_OUT
    local = class_actions.allowed_folders(allow_local, remote_only=remote_only)
    named = class_actions.with_package(class_actions.read_listed(roster, out, local), package or "")
    options = BatchOptions(
        out=out,
        jobs=jobs or class_actions.default_jobs(loaded, static=static),
        sandbox=sandbox,
        static_only=static,
        before=publishing.parse_option_time("--before", before),
        only=only,
        cluster=cluster or "",
        cluster_insecure=cluster_insecure,
        allow_local=tuple(str(folder) for folder in local.folders),
        remote_only=remote_only,
    )
    return class_actions.grade_class(named, rubric, loaded, options, exchange, as_json=as_json)


@command("regrade", group=INSTRUCTORS, exit_codes=CLASS_EXIT_CODES, runs_code=True)
def regrade(
    *,
    folder: Annotated[Path, CLASS],
    rubric: Annotated[str | None, RUBRIC] = None,
    run_missing_too: Annotated[
        bool, Flag("--run-missing", "run the submissions that lack a recording of a scenario")
    ] = False,
    jobs: Annotated[int | None, Option("--jobs", "N", "how many at a time", count)] = None,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Judge a class again from its evidence, without ROS."""
    with loading():
        from grader.classes.batch.folder import open_batch
        from grader.classes.batch.job import LocalExecutor
        from grader.classes.batch.regrade import regrade as judge_again
        from grader.classes.batch.regrade import run_missing
        from grader.cli import class_actions
        from grader.cli.class_display import open_class_display, print_regraded
        from grader.cli.host_support import warn_without_sandbox
        from grader.cli.output import say_beside
        from grader.portable import cores
        from grader.rubric.load import load_rubric
    batch = open_batch(folder)
    source = rubric or batch.run.rubric_source
    loaded = load_rubric(source)
    own = cores()

    def stopped(done: int, of: int) -> None:
        say_beside(f"{done} of {of} judged again; the same command continues")

    batch, regraded = judge_again(batch, loaded, class_actions.rubric_source(source), jobs or own, stopped)
    if run_missing_too and any(one.missing for one in regraded):
        warn_without_sandbox(sandbox, loaded)
        with open_class_display() as watcher:
            executor = LocalExecutor(jobs or own * class_actions.JOBS_PER_CORE)
            batch, regraded = run_missing(
                batch, loaded, regraded, executor=executor, watcher=watcher, sandbox=sandbox
            )
    print_regraded(batch, regraded, as_json=as_json)
    return class_actions.exit_code(batch.run)


@command("review", group=INSTRUCTORS)
def review(
    *,
    folder: Annotated[Path, CLASS],
    port: Annotated[int, Option("--port", "N", "the page's port (default: any that is free)", port)] = 0,
    no_browser: Annotated[bool, Flag("--no-browser", "only print the address")] = False,
    author: Annotated[
        str | None,
        Option("--author", "NAME", "who reviews (default: git config user.name); the page can change it"),
    ] = None,
    marker: Annotated[
        str | None,
        Option("--marker", "NAME", "who reviews, as --author; with --of, only that marker's share"),
    ] = None,
    of: Annotated[
        str | None, Option("--of", "N|NAMES", "how many markers share the class, or their names: ann,bob,cyd")
    ] = None,
    group: Annotated[str | None, Option("--group", "NAME", "only the submissions of one group")] = None,
    blind: Annotated[
        bool, Flag("--blind", "hide names, ids and repositories of what is not published yet")
    ] = False,
) -> ExitCode:
    """Review a class in the browser: award points, override marks, comment.

    The page is served to this machine alone until Ctrl-C.
    """
    require_extra("review", "reviewing a class", "flask", "waitress")
    with loading():
        from grader.classes.review.markers import share_of
        from grader.classes.review.session import open_session
        from grader.cli import class_actions
    name = class_actions.reviewer(marker if author is None else author)
    review = open_session(folder)
    review.blind = blind
    review.share = share_of(folder, marker, of, group)
    return class_actions.serve_review(review, port=port, author=name, no_browser=no_browser)


@command("overrides merge", group=INSTRUCTORS, exit_codes=MERGE_EXIT_CODES)
def overrides_merge(
    *,
    folder: Annotated[Path, CLASS],
    others: Annotated[
        Sequence[Path], Argument("OTHER", "folders of results of the same class, with overrides.yaml")
    ],
) -> ExitCode:
    """Put other markers' decisions beside those in DIR.

    Where two decided differently, DIR's stays and the conflict is named.
    """
    with loading():
        from grader.classes.batch.folder import open_batch
        from grader.classes.review.markers import merge
        from grader.cli.output import say
        from grader.rubric.load import load_rubric
        from grader.wording import plural
    batch = open_batch(folder)
    rubric = load_rubric(batch.run.rubric_source).rubric
    conflicts = 0
    for other in others:
        merged = merge(batch, rubric, other)
        conflicts += len(merged.conflicts)
        for conflict in merged.conflicts:
            say(f"{other}: conflict: {conflict}")
        say(f"{other}: {plural(merged.added, 'decision')} added, {merged.same} there already")
    say(f"  hint: grader regrade {folder}, or a review of it, applies them")
    return ExitCode.BELOW_PASS_MARK if conflicts else ExitCode.PASSED


@command("gradebook", group=INSTRUCTORS)
def gradebook(
    *,
    folder: Annotated[Path, CLASS],
    form: BookForm,
    out: Annotated[str, Option("--out", "FILE", "where to write it; - is stdout (default: in DIR)")] = "",
    template: BookTemplate = None,
    column: BookColumn = "",
    per_criterion: Annotated[bool, Flag("--per-criterion", "add a column for each criterion")] = False,
    drafts: DraftsFlag = False,
) -> ExitCode:
    """Write a class's gradebook for people, programs or a learning platform.

    It has what is published; of a class of which nothing is published, it has results as they are now.
    What a person has to know about it goes to stderr. Raises UsageError if the template would be overwritten.
    """
    with loading():
        from grader.cli import class_actions
    wanted = class_actions.WantedBook(
        form=form, out=out, template=template, column=column, wide=per_criterion, drafts=drafts
    )
    return class_actions.write_class_gradebook(folder, wanted)


@command("report", group=INSTRUCTORS, exit_codes=REPORT_EXIT_CODES)
def report(
    *,
    folder: Annotated[Path, Argument("DIR", f"a submission's folder of results, or {BATCH_FOLDER}")],
    rubric: Annotated[str | None, RUBRIC] = None,
    form: Annotated[
        str | None,
        Option("--form", "", "write only this form (default: all files of DIR)", choices=tuple(REPORT_FORMS)),
    ] = None,
    out: Annotated[str, Option("--out", "FILE", "where to write that form (default: -, stdout)")] = "",
    prefix: Annotated[
        str | None,
        Option("--prefix", "PATH", "the package's folder in the repository, for paths (default: found here)"),
    ] = None,
    student: Annotated[bool, Flag("--student", "leave hidden criteria out of that form")] = False,
    anonymous: Annotated[
        Path | None, Option("--anonymous", "FILE", "also write the class's page without names to FILE")
    ] = None,
) -> ExitCode:
    """Write the reports of a result or a class again, without ROS."""
    with loading():
        from grader.classes.batch.folder import RUN, open_batch
        from grader.classes.batch.renew_results import has_result
        from grader.cli import results
    # before anything is written
    batch = open_batch(folder) if (folder / RUN).is_file() else None
    if batch is not None:
        batch.refuse_newer()
    single = batch is None and has_result(folder)
    if form:
        if not single or anonymous:
            raise UsageError(f"{folder}: --form is for one submission", hint="give its own folder: DIR/<id>")
        loaded = results.rubric_of(rubric, folder)
        return results.write_form(folder, loaded, form, out or STDOUT, prefix, student=student)
    if out or prefix is not None or student:
        raise UsageError("--out, --prefix and --student go with --form", hint="see grader report --help")
    if anonymous and batch is None:
        raise UsageError(
            f"{folder}: only a class has a page, and there is no {RUN}", hint="give the batch's --out"
        )
    folders = [folder] if single else results.folders_in(folder, batch)
    code = results.write_reports(folders, results.rubric_of(rubric, folders[0], batch))
    if batch is not None:
        results.write_class_pages(batch, anonymous)
    return code


@command("similar", group=INSTRUCTORS)
def similar(
    *,
    folder: Annotated[Path, CLASS],
    starter: Annotated[
        Sequence[Path],
        Option(
            "--starter",
            "PATH",
            "code that everyone was given: a folder, an archive or a program; may be repeated",
            repeated=True,
        ),
    ] = (),
    threshold: Annotated[
        float,
        Option(
            "--threshold",
            "PERCENT",
            "how much of a submission's code the other must share (default: 80)",
            percent,
        ),
    ] = 80.0,
    as_json: JsonFlag = False,
) -> ExitCode:
    """Find nearly identical submissions, for a person to look at; marks do not change."""
    require_extra("similarity", "comparing submissions", "copydetect")
    with loading():
        from grader.classes.similarity.sources import compare, write_similarity
        from grader.cli.class_actions import print_similarity, starter_of, submissions_in
        from grader.cli.output import say_json
        from grader.portable import cores
    folders, names, groups = submissions_in(folder)
    given = [*starter, *starter_of(folder)]
    found = compare(folders, starter=given, groups=groups, threshold=threshold / 100, jobs=cores())
    written = write_similarity(found, folder, names)
    if as_json:
        say_json(found.model_dump(mode="json", by_alias=True))
    else:
        print_similarity(found, names, written, sys.stdout)
    return ExitCode.PASSED


TOKENS = """\
  GITHUB_TOKEN, GITHUB_SERVER_URL         the token for GitHub, and its server (default: https://github.com)
  GITLAB_TOKEN, CI_SERVER_URL             the token for GitLab, and its server (default: https://gitlab.com)

"""
VARIABLES = f"""variables:
  GRADER_SMTP_USER, GRADER_SMTP_PASSWORD  log in at the mail server
  GRADER_SMTP_FROM                        as --from
{TOKENS}"""


FORM = Option("--form", "", "how it gets to the students", choices=tuple(FORMS))
SHOW_ONE = Flag("--dry-run", "show one of them, and who could get nothing; send nothing")
CHANGED_SINCE = Option("--changed-since", "TIME", "send only what was published after TIME")
PLACE = Option("--out", "PATH", "the folder, zip or folder of mails to write (default: in DIR)")
SMTP = Option(
    "--smtp", "URL", "email: send through smtp://HOST:587 (STARTTLS) or smtps://HOST (default: files)"
)
ISSUES = Flag("--issues", "github, gitlab: an issue for each student in place of a comment on the commit")
PUBLIC = Flag("--public", "github, gitlab: also in repositories that everybody can read")


@command("publish", group=INSTRUCTORS, exit_codes=PUBLISH_EXIT_CODES)
def publish(
    *,
    folder: Annotated[Path, CLASS],
    only: Annotated[
        Sequence[str], Option("--only", "ID", "publish only these, even if they are still open")
    ] = (),
    dry_run: Annotated[
        bool, Flag("--dry-run", "only show what would be published, and what changes")
    ] = False,
    show_hidden: Annotated[bool, Flag("--show-hidden", "show students the hidden criteria, too")] = False,
    author: AuthorOption = None,
    as_json: JsonFlag = False,
) -> ExitCode:
    """Publish a class's results: gradebooks and feedback have them from then on.

    Results are drafts until then, and changes after it are drafts until it is run again.
    """
    with loading():
        from grader.cli import publishing
    return publishing.publish(
        folder, only, dry_run=dry_run, show_hidden=show_hidden, author=author, as_json=as_json
    )


@command("feedback", group=INSTRUCTORS, notes=VARIABLES, exit_codes=FEEDBACK_EXIT_CODES)
def feedback(
    *,
    folder: Annotated[Path, CLASS],
    form: Annotated[str, FORM],
    dry_run: Annotated[bool, SHOW_ONE] = False,
    only: Annotated[Sequence[str], Option("--only", "ID", "send to these only")] = (),
    changed_since: Annotated[str | None, CHANGED_SINCE] = None,
    again: Annotated[bool, Flag("--again", "send what was sent before, too")] = False,
    drafts: Annotated[bool, Flag("--drafts", "send results as they are now, published or not")] = False,
    out: Annotated[Path | None, PLACE] = None,
    smtp: Annotated[str, SMTP] = "",
    sender: Annotated[str, Option("--from", "ADDRESS", "email: the address to send from")] = "",
    branch: Annotated[str, Option("--branch", "NAME", "git: the branch (default: feedback)")] = "",
    issues: Annotated[bool, ISSUES] = False,
    public: Annotated[bool, PUBLIC] = False,
) -> ExitCode:
    """Return what is published to the students, each result once.

    A failure costs one student, not the run; the same command goes on where it was stopped.
    """
    with loading():
        from grader.classes.feedback.forms import SendSettings
        from grader.classes.feedback.send import Recipients
        from grader.cli import publishing
        from grader.cli.output import say_beside
    given = {
        "--out": out is not None,
        "--smtp": bool(smtp),
        "--from": bool(sender),
        "--branch": bool(branch),
        "--issues": issues,
        "--public": public,
    }
    publishing.check_options(FORMS[form], given)
    settings = SendSettings(
        folder=folder,
        out=out,
        smtp=smtp,
        sender=sender,
        branch=branch,
        issues=issues,
        public=public,
        told=say_beside,
    )
    since = publishing.parse_option_time("--changed-since", changed_since)
    wanted = Recipients(only=only, changed_since=since, again=again)
    return publishing.send(folder, FORMS[form], settings, wanted, drafts=drafts, dry_run=dry_run)


@command("requests", group=INSTRUCTORS, notes=f"variables:\n{TOKENS}", exit_codes=REQUESTS_EXIT_CODES)
def requests(
    *,
    folder: Annotated[Path, CLASS],
    forge: Annotated[
        str | None,
        Option(
            "--from", "", "first get the open issues, and the answers to feedback, from there", choices=FORGES
        ),
    ] = None,
    label: Annotated[str, Option("--label", "NAME", "only issues with this label")] = "",
    as_json: JsonFlag = False,
) -> ExitCode:
    """List what the students of a class ask about criteria, and what was answered.

    Questions are rows of DIR/requests*.csv; `grader review` shows them beside the criterion, and takes the answer.
    """
    with loading():
        from grader.cli import publishing
    if label and forge is None:
        raise UsageError("--label chooses among the issues of a forge", hint="give --from, too")
    return publishing.list_requests(folder, forge, label, as_json=as_json)


COURSE = Argument("COURSE", "the course's file, course.yaml")
LAB = Argument("NAME", "the lab's name in that file")


@command("course status", group=INSTRUCTORS)
def show_course(*, course: Annotated[Path, COURSE], as_json: JsonFlag = False) -> ExitCode:
    """List the labs of a course: what is graded, open, published and sent, and the next command for each."""
    with loading():
        from grader.cli import class_actions
    return class_actions.print_status(course, as_json=as_json)


@command("course grade", group=INSTRUCTORS, exit_codes=CLASS_EXIT_CODES, runs_code=True)
def grade_course(
    *,
    course: Annotated[Path, COURSE],
    lab: Annotated[str, LAB],
    jobs: JobsOption = None,
    only: OnlyOption = (),
    allow_local: LocalOption = (),
    static: Annotated[bool, STATIC] = False,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Grade one lab of a course as `grader batch` does, with the deadline, late policy and attempts of the course.

    The same command continues one that was stopped.
    """
    with loading():
        from grader.cli import class_actions
    return class_actions.grade_lab(
        course,
        lab,
        jobs=jobs,
        only=only,
        allow_local=allow_local,
        static=static,
        sandbox=sandbox,
        as_json=as_json,
    )


@command("course publish", group=INSTRUCTORS, exit_codes=PUBLISH_EXIT_CODES)
def publish_course(
    *,
    course: Annotated[Path, COURSE],
    lab: Annotated[str, LAB],
    dry_run: Annotated[bool, Flag("--dry-run", "only show what would be published and sent")] = False,
    author: AuthorOption = None,
) -> ExitCode:
    """Publish one lab of a course, and return it to the students by the course's form of feedback."""
    with loading():
        from grader.cli import class_actions
    return class_actions.publish_lab(course, lab, dry_run=dry_run, author=author)


@command("course gradebook", group=INSTRUCTORS)
def write_book(
    *,
    course: Annotated[Path, COURSE],
    form: BookForm,
    out: Annotated[
        str, Option("--out", "FILE", "where to write it; - is stdout (default: beside the course file)")
    ] = "",
    template: BookTemplate = None,
    column: BookColumn = "",
    per_lab: Annotated[bool, Flag("--per-lab", "add a column for each lab, on a platform")] = False,
    drafts: DraftsFlag = False,
) -> ExitCode:
    """Write a course's gradebook: each lab's points, and 0 to 100 for all labs by their weights.

    It has what is published; of a lab of which nothing is published, it has results as they are now, and says so.
    """
    with loading():
        from grader.cli import class_actions
    wanted = class_actions.WantedBook(
        form=form, out=out, template=template, column=column, wide=per_lab, drafts=drafts
    )
    return class_actions.write_course_gradebook(course, wanted)
