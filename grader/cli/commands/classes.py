"""The commands for a whole class: grade it, and work on the results."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.cli.declare import (
    BATCH_FOLDER,
    CLASS_EXIT_CODES,
    INSTRUCTORS,
    MERGE_EXIT_CODES,
    REPORT_EXIT_CODES,
    RUBRIC,
    STATIC,
    STDOUT,
    Argument,
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
from grader.report.forms import FORMS

DEFAULT_OUT = Path("grader-results")
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
        from grader.cli import classes, publishing
        from grader.rubric.load import load_rubric
    loaded = load_rubric(rubric)
    out = out or DEFAULT_OUT
    local = classes.allowed_folders(allow_local, remote_only=remote_only)
    named = classes.with_package(classes.read_listed(roster, out, local), package or "")
    options = BatchOptions(
        out=out,
        jobs=jobs or classes.default_jobs(loaded, static=static),
        sandbox=sandbox,
        static_only=static,
        before=publishing.parse_option_time("--before", before),
        only=only,
        cluster=cluster or "",
        cluster_insecure=cluster_insecure,
        allow_local=tuple(str(folder) for folder in local.folders),
        remote_only=remote_only,
    )
    return classes.grade_class(named, rubric, loaded, options, exchange, as_json=as_json)


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
        from grader.cli import classes
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

    batch, regraded = judge_again(batch, loaded, classes.rubric_source(source), jobs or own, stopped)
    if run_missing_too and any(one.missing for one in regraded):
        warn_without_sandbox(sandbox, loaded)
        with open_class_display() as watcher:
            executor = LocalExecutor(jobs or own * classes.JOBS_PER_CORE)
            batch, regraded = run_missing(
                batch, loaded, regraded, executor=executor, watcher=watcher, sandbox=sandbox
            )
    print_regraded(batch, regraded, as_json=as_json)
    return classes.exit_code(batch.run)


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
    with loading():
        from grader.classes.review import require_library
    require_library()
    with loading():
        from grader.classes.review.markers import share_of
        from grader.classes.review.session import open_session
        from grader.cli import classes
    name = classes.reviewer(marker if author is None else author)
    review = open_session(folder)
    review.blind = blind
    review.share = share_of(folder, marker, of, group)
    return classes.serve_review(review, port=port, author=name, no_browser=no_browser)


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
        from grader.cli import classes
    wanted = classes.WantedBook(
        form=form, out=out, template=template, column=column, wide=per_criterion, drafts=drafts
    )
    return classes.write_class_gradebook(folder, wanted)


@command("report", group=INSTRUCTORS, exit_codes=REPORT_EXIT_CODES)
def report(
    *,
    folder: Annotated[Path, Argument("DIR", f"a submission's folder of results, or {BATCH_FOLDER}")],
    rubric: Annotated[str | None, RUBRIC] = None,
    form: Annotated[
        str | None,
        Option("--form", "", "write only this form (default: all files of DIR)", choices=tuple(FORMS)),
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
    with loading():
        from grader.classes.similarity.comparison import require_library
    require_library()
    with loading():
        from grader.classes.similarity import compare, write_similarity
        from grader.cli.output import say_json
        from grader.cli.similarity import print_similarity, starter_of, submissions_in
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
