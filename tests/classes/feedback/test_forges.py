"""Comments and issues at stand-ins of GitHub and GitLab: once each, within limits, and for one server alone."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.classes.feedback import forges
from grader.cli.main import run
from tests.classes.feedback.a_class import COMMIT, award, feedback, publish, sent, use
from tests.classes.feedback.forges import TOKEN, Failure, Forge, Repo, forge, github, gitlab

pytestmark = pytest.mark.usefixtures("without_processes")

NAMES = ("ada", "bob")


@pytest.fixture
def slept(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """How long was waited for; nobody waits in the tests."""
    waits: list[float] = []
    made = forges.Api.__init__

    def without_waiting(self: forges.Api, *args: object) -> None:
        made(self, *args, sleep=lambda wait_s: waits.append(round(wait_s)))  # type: ignore[arg-type]

    monkeypatch.setattr(forges.Api, "__init__", without_waiting)
    return waits


@pytest.fixture(params=["github", "gitlab"])
def system(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def server(
    system: str, published: Path, slept: list[float], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Forge]:
    """A stand-in with repositories of two students; the roster has their addresses."""
    with forge(github if system == "github" else gitlab) as made:
        made.repos = {f"course/{name}": Repo((COMMIT,)) for name in NAMES}
        if system == "github":
            monkeypatch.setenv("GITHUB_API_URL", made.address)
            monkeypatch.setenv("GITHUB_TOKEN", TOKEN)
            monkeypatch.delenv("GITHUB_SERVER_URL", raising=False)
            host = "https://github.com"
        else:
            monkeypatch.setenv("CI_SERVER_URL", made.address)
            monkeypatch.delenv("CI_API_V4_URL", raising=False)
            monkeypatch.setenv("GITLAB_TOKEN", TOKEN)
            host = made.address
        use(published, {name: f"{host}/course/{name}.git" for name in (*NAMES, "cem")})
        yield made


def bodies(server: Forge, name: str = "ada") -> list[str]:
    return [comment["body"] for comment in server.repos[f"course/{name}"].comments]


def both(out: Path, system: str, *options: str) -> int:
    return feedback(out, system, "--only", *NAMES, *options)


def test_a_comment_on_the_commit_that_was_graded(published: Path, system: str, server: Forge, capsys) -> None:
    assert both(published, system) == 0
    (ada,), (bob,) = bodies(server), bodies(server, "bob")
    (frozen,) = (published / ".published" / "ada").iterdir()
    assert ada.startswith((frozen / "report.md").read_text().rstrip())
    assert "`bob`" in bob
    assert "bob" not in ada
    said = "".join(capsys.readouterr())
    assert TOKEN not in said + (published / "sent.jsonl").read_text()
    assert both(published, system) == 0
    assert len(bodies(server)) == 1


def test_issues_get_later_feedback_as_comments(published: Path, system: str, server: Forge) -> None:
    repo = server.repos["course/ada"]
    assert both(published, system, "--issues") == 0
    (issue,) = repo.issues
    assert str(issue["title"]).endswith("85 of 100 points")
    award(published, "ada", "style", 9, "clear names")
    publish(published)
    assert both(published, system, "--issues") == 0
    ((number, body),) = repo.notes
    assert (number, len(repo.issues)) == (1, 1)
    assert "85 → 89: override by ann, clear names (style)" in body


def test_a_failure_costs_one_student(published: Path, system: str, server: Forge, capsys) -> None:
    server.repos["course/ada"].commits = ()
    assert feedback(published, system) == 3
    said = capsys.readouterr()
    assert "1 sent by" in said.out
    assert "ada: " in said.err
    assert "says 4" in said.err
    assert "cem: " in said.err
    assert "fay: " in said.err
    assert [line for line in sent(published) if line[2] == "sent"] == [("bob", system, "sent")]


def test_what_everybody_can_read_gets_nothing(published: Path, system: str, server: Forge, capsys) -> None:
    server.repos["course/ada"].private = False
    assert both(published, system) == 3
    assert "ada: everybody can read this repository" in capsys.readouterr().err
    assert (bodies(server), len(bodies(server, "bob"))) == ([], 1)
    assert both(published, system, "--public") == 0
    assert len(bodies(server)) == 1


@pytest.mark.parametrize(
    "limited",
    [
        (Failure(429, {"Retry-After": "7"}), 7),
        (Failure(403, {"Retry-After": "9"}, "You have exceeded a secondary rate limit"), 9),
        (Failure(403, {}, "You have exceeded a secondary rate limit"), 60),
        (Failure(429), 60),
    ],
)
def test_limits_are_waited_for(
    limited: tuple[Failure, int], published: Path, system: str, server: Forge, capsys
) -> None:
    failure, waits = limited
    server.failures = [failure]
    assert both(published, system) == 0
    assert f"too many requests: waiting {waits} s" in capsys.readouterr().err
    assert len(bodies(server)) == 1


@pytest.mark.parametrize("prefix", ["X-RateLimit", "RateLimit"])
def test_a_limit_that_says_when_it_ends(
    prefix: str, published: Path, system: str, server: Forge, slept: list[float]
) -> None:
    reset = {f"{prefix}-Remaining": "0", f"{prefix}-Reset": str(int(time.time()) + 300)}
    server.failures = [Failure(403, reset, "API rate limit exceeded")]
    assert both(published, system) == 0
    assert any(295 <= wait_s <= 302 for wait_s in slept)


def test_who_is_to_wait_for_hours_is_told_so(published: Path, system: str, server: Forge, capsys) -> None:
    server.failures = [Failure(429, {"Retry-After": "86400"})]
    assert both(published, system) == 3
    said = capsys.readouterr().err
    assert "too many requests, for 1440 minutes" in said
    assert "0 of 2 sent; the same command continues" in said
    assert both(published, system) == 0
    assert [len(bodies(server, name)) for name in NAMES] == [1, 1]


@pytest.mark.parametrize(
    "failure", [Failure(502, done=True), Failure(0, done=True), Failure(502), Failure(0)]
)
def test_an_answer_that_is_lost_makes_no_second_comment(
    failure: Failure, published: Path, system: str, server: Forge
) -> None:
    server.failures = [failure]
    assert both(published, system) == 0
    assert [len(bodies(server, name)) for name in NAMES] == [1, 1]


@pytest.mark.parametrize("options", [(), ("--issues",)])
def test_what_was_interrupted_is_looked_for(
    options: tuple[str, ...], published: Path, system: str, server: Forge
) -> None:
    both(published, system, *options)
    path = published / "sent.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    kept = [line for line in lines if not (line["id"] == "ada" and line["state"] == "sent")]
    path.write_text("".join(f"{json.dumps(line)}\n" for line in kept))
    assert both(published, system, *options) == 0
    repo = server.repos["course/ada"]
    assert len(repo.comments) + len(repo.issues) == 1
    assert sent(published)[-1] == ("ada", system, "sent")


def test_a_renamed_repository_is_followed_on_its_own_server_alone(
    published: Path, system: str, server: Forge, capsys
) -> None:
    at = "/repos/course/ada" if system == "github" else "/api/v4/projects/course%2Fada"
    server.moved = {at: "https://elsewhere.example/x"}
    assert both(published, system) == 3
    assert "it is on another server now" in capsys.readouterr().err
    assert len(bodies(server, "bob")) == 1
    server.moved = {at: "https://[elsewhere"}
    assert both(published, system) == 3
    assert "it is on another server now" in capsys.readouterr().err


def test_a_token_that_is_not_taken_ends_the_run(
    published: Path, system: str, server: Forge, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setenv(f"{system.upper()}_TOKEN", "wrong")
    assert both(published, system) == 3
    assert "does not take the token" in capsys.readouterr().err
    assert len(server.asked) == 1


def test_a_token_goes_to_its_own_server_alone(published: Path, system: str, server: Forge, capsys) -> None:
    use(published, dict.fromkeys(NAMES, "https://elsewhere.example/course/ada.git"))
    assert both(published, system) == 3
    assert "its repository is not on" in capsys.readouterr().err
    assert server.asked == []


def test_without_a_token_nothing_is_asked(
    published: Path, system: str, server: Forge, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    for name in ("GITHUB_TOKEN", "GH_TOKEN", "GITLAB_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    assert both(published, system) == 2
    assert "there is no token for http" in capsys.readouterr().err
    assert server.asked == []


@pytest.mark.usefixtures("published")
def test_a_token_of_gits_credential_helpers(
    system: str, server: Forge, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys
) -> None:
    for name in ("GITHUB_TOKEN", "GH_TOKEN", "GITLAB_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    place = "https://github.com" if system == "github" else server.address
    helper = f'"!f() {{ test $1 = get && echo username=teacher && echo password={TOKEN}; }}; f"'
    (tmp_path / ".gitconfig").write_text(f'[credential "{place}"]\n\thelper = {helper}\n')
    monkeypatch.setenv("HOME", str(tmp_path))
    assert both(tmp_path / "results", system) == 0
    assert len(bodies(server)) == len(bodies(server, "bob")) == 1
    assert TOKEN not in "".join(capsys.readouterr())


def test_a_token_is_never_sent_in_the_clear(
    published: Path, system: str, server: Forge, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    name = "GITHUB_API_URL" if system == "github" else "CI_API_V4_URL"
    monkeypatch.setenv(name, "http://forge.example")
    assert both(published, system) == 2
    assert "a token is sent by https:// only" in capsys.readouterr().err
    monkeypatch.setenv(name, "https://[forge.example")
    assert both(published, system) == 2
    assert "this is not the address of a server" in capsys.readouterr().err


def test_a_dry_run_asks_no_server(published: Path, system: str, server: Forge, capsys) -> None:
    assert both(published, system, "--dry-run") == 0
    said = capsys.readouterr().out
    assert "ada → " in said
    assert f"commit {COMMIT[:12]}" in said
    assert server.asked == []


@pytest.mark.parametrize(
    ("source", "place"),
    [
        ("https://github.com/org/lab-ada.git", ("github.com", "org/lab-ada")),
        ("https://token@github.com/org/lab-ada", ("github.com", "org/lab-ada")),
        ("git@github.com:org/lab-ada.git", ("github.com", "org/lab-ada")),
        ("ssh://git@git.x.example:2222/a/b/c.git", ("git.x.example", "a/b/c")),
        ("http://127.0.0.1:8080/a/b", ("127.0.0.1:8080", "a/b")),
    ],
)
def test_the_repository_in_an_address(source: str, place: tuple[str, str]) -> None:
    assert forges.host_and_path(source) == place


def ask(server: Forge, system: str, name: str, **about: object) -> None:
    """A student opens an issue, as each API gives it."""
    repo = server.repos[f"course/{name}"]
    number = len(repo.issues) + 1
    title, text = about.pop("title", "A question"), about.pop("text", "")
    if system == "github":
        web = f"https://github.com/course/{name}/issues/{number}"
        issue = {"number": number, "html_url": web, "body": text, "state": "open", "labels": []}
    else:
        web = f"{server.address}/course/{name}/-/issues/{number}"
        issue = {"iid": number, "web_url": web, "description": text, "state": "opened", "labels": []}
    repo.issues.append({"title": title, "created_at": "2026-11-20T10:00:00Z", **issue, **about})


def asked(out: Path, system: str, *options: str) -> int:
    return run(["requests", str(out), "--from", system, *options])


def test_questions_come_in_from_issues(published: Path, system: str, server: Forge, capsys) -> None:
    ask(
        server, system, "ada", title="style: why 5?", text="The names are\nthose of the handout; answers too."
    )
    ask(server, system, "ada", title="Please look again", text="=at `answers`, thank you")
    ask(server, system, "ada", title="style, settled", state="closed")
    ask(server, system, "bob", title="Does it rain?")
    if system == "github":
        ask(server, system, "bob", title="style", pull_request={"url": "https://x"})
    assert asked(published, system) == 3
    said = capsys.readouterr()
    assert "ada style (2026-11-20T10:00:00Z, " in said.out
    assert "    style: why 5?\n    The names are\n    those of the handout; answers too.\n" in said.out
    assert "    =at `answers`, thank you\n" in said.out
    assert "\n2 questions, 0 answered; " in said.out
    assert "no criterion is named: Does it rain?" in said.err
    assert "cem: " in said.err
    assert TOKEN not in "".join(said) + (published / f"requests-{system}.csv").read_text()
    award(published, "ada", "style", 7, answer="Line 12 shadows a name.")
    del server.repos["course/ada"]
    assert asked(published, system) == 3
    said = capsys.readouterr()
    assert "\n2 questions, 1 answered; " in said.out
    assert "    answer: Line 12 shadows a name.\n" in said.out
    assert f"ada: {server_name(server, system)}/course/ada: " in said.err


def server_name(server: Forge, system: str) -> str:
    return "github.com" if system == "github" else server.address.partition("//")[2]


def test_only_issues_with_a_label(published: Path, system: str, server: Forge, capsys) -> None:
    label = {"name": "lab 1"} if system == "github" else "lab 1"
    ask(server, system, "ada", title="style", labels=[label])
    ask(server, system, "ada", title="answers")
    asked(published, system, "--label", "lab 1")
    assert "\n1 question, 0 answered; " in capsys.readouterr().out


@pytest.mark.parametrize("options", [(), ("--issues",)])
def test_answers_to_feedback_are_questions(
    options: tuple[str, ...], published: Path, system: str, server: Forge, capsys
) -> None:
    both(published, system, *options)
    repo = server.repos["course/ada"]
    text = "Could you look at style once more?"
    if options:
        repo.notes.append((1, text))
    elif system == "github":
        repo.comments.append({"commit_id": COMMIT, "body": text, "html_url": "https://github.com/c"})
    else:
        repo.comments.append({"commit_id": COMMIT, "body": text})
    capsys.readouterr()
    asked(published, system)
    said = capsys.readouterr().out
    assert "ada style (" in said
    assert f"    {text}\n" in said
    assert "\n1 question, 0 answered; " in said


def test_a_label_is_of_a_forge(published: Path) -> None:
    assert run(["requests", str(published), "--label", "x"]) == 2
