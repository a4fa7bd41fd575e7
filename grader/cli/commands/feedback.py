"""The commands that end a class's marking: publish the results, and return them to the students."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.classes.feedback.forms import FORGES, FORMS
from grader.cli.declare import (
    BATCH_FOLDER,
    FEEDBACK_EXIT_CODES,
    INSTRUCTORS,
    PUBLISH_EXIT_CODES,
    REQUESTS_EXIT_CODES,
    Argument,
    AuthorOption,
    Flag,
    JsonFlag,
    Option,
    command,
    loading,
)
from grader.errors import ExitCode, UsageError

CLASS = Argument("DIR", BATCH_FOLDER)
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
