"""`grader review DIR`: a web page on this machine alone, to look at a class, give points and decide otherwise."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path

from grader.classes.review import require_library
from grader.cli.output import say
from grader.errors import ExitCode, UsageError


def run(*, folder: Path, port: int = 0, no_browser: bool = False, author: str | None = None) -> ExitCode:
    """Serve the page until Ctrl-C; `author` stands beside decisions (default: what git calls the person)."""
    require_library()
    from grader.classes.review.cards import Wrong, author_of  # noqa: PLC0415
    from grader.classes.review.serve import browser, git_user, serve  # noqa: PLC0415
    from grader.classes.review.session import open_session  # noqa: PLC0415 - an extra: not there everywhere

    try:
        name = author_of(git_user() if author is None else author)
    except Wrong as error:
        raise UsageError(f"--author: {error}") from error
    review = open_session(folder)
    with ExitStack() as stack:

        def opened(address: str) -> None:
            tried = stack.enter_context(browser(address, wanted=not no_browser))
            say(f"{'Opening' if tried else 'Open'} {address}")
            say("Only this machine reaches it, and only with this address. Ctrl-C ends it.")
            sys.stdout.flush()  # whoever reads it from a pipe needs the address now

        done = serve(review, port=port, author=name, opened=opened)
    if done:
        say("Ended. Everything is saved and written.")
        return ExitCode.PASSED
    say(
        f"Ended. What you decided is in overrides.yaml; the gradebook is not written: {review.background.trouble}"
    )
    say(f"  hint: when that is over, grader regrade {folder} writes it")
    return ExitCode.NOT_GRADED
