"""Where a rubric came from: a digest pins it, and one from the student's repository is shown as what it is."""

from __future__ import annotations

import io
import shutil
from pathlib import Path

import pytest

from grader.cli.class_actions import rubric_source
from grader.errors import HostError, UsageError
from grader.model.figure import Figures
from grader.report.html.page import render_html
from grader.report.markdown import render_markdown
from grader.report.terminal import Terminal, open_console
from grader.rubric.download import BYTES_MAX
from grader.rubric.find import rubrics_folder
from grader.rubric.load import LoadedRubric, checkout_around, load_rubric, origin_of
from tests.classes.fetching.forge import certificate_in, forge
from tests.report.hostile import result, rubric

LAB = "leeds-comp3631-lab1"


def course_rubric(folder: Path) -> LoadedRubric:
    folder.mkdir(parents=True, exist_ok=True)
    return load_rubric(str(shutil.copy(rubrics_folder() / f"{LAB}.yaml", folder / "lab.yaml")))


def test_a_pinned_rubric_is_the_one_with_that_digest(tmp_path: Path) -> None:
    own = course_rubric(tmp_path)
    pinned = load_rubric(f"{own.path}#sha256:{own.digest.upper()}")
    assert (pinned.origin, pinned.digest, own.origin, load_rubric(LAB).origin) == (
        "pinned", own.digest, "elsewhere", "grader",
    )  # fmt: skip
    own.path.write_text(own.path.read_text() + "\n# forged\n")
    forged = load_rubric(str(own.path))
    with pytest.raises(UsageError) as caught:
        load_rubric(f"{own.path}#sha256:{own.digest}")
    assert f"sha256:{forged.digest}, not sha256:{own.digest}" in caught.value.message
    with pytest.raises(UsageError, match="64 hexadecimal digits"):
        load_rubric(f"{own.path}#sha256:{own.digest[:12]}")


def test_a_course_file_pins_the_rubrics_of_its_labs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, course = course_rubric(tmp_path), tmp_path / "course.yaml"
    course.write_text(
        "schema: grader.course/1\ntitle: Robots\nroster: roster.csv\n"
        f"labs: {{lab1: {{rubric: 'lab.yaml#sha256:{own.digest}'}}}}\n"
    )
    loaded = load_rubric(f"{course}#lab1")
    assert (loaded.origin, loaded.digest) == ("pinned", own.digest)
    monkeypatch.chdir(tmp_path)
    pin = f"#sha256:{own.digest}"
    for given in (f"course.yaml#lab1{pin}", f"lab.yaml{pin}"):
        assert rubric_source(given) == f"{tmp_path}/{given}"
        assert load_rubric(rubric_source(given)).origin == "pinned"
    own.path.write_text(own.path.read_text() + "# forged")
    with pytest.raises(UsageError, match=f"not sha256:{own.digest}"):
        load_rubric(f"{course}#lab1")


def test_what_lies_in_the_students_repository_is_the_students(tmp_path: Path) -> None:
    repository = tmp_path / "student"
    package = repository / "src" / "lab1"
    for folder in (package, repository / ".git", repository / "course" / ".git", repository / "module"):
        folder.mkdir(parents=True)
    (repository / "module" / ".git").write_text("gitdir: ../.git/modules/module\n")
    assert checkout_around(package) == repository
    beside = course_rubric(tmp_path / "staff")
    (repository / "link.yaml").symlink_to(beside.path)
    linked = load_rubric(str(repository / "link.yaml"))
    students = {
        "its own": course_rubric(repository),
        "in the package": course_rubric(package),
        "a submodule": course_rubric(repository / "module"),
        "a link": linked,
        "by a way around": load_rubric(f"{tmp_path}/staff/../student/lab.yaml"),
    }
    assert {name: origin_of(lab, (package, repository)) for name, lab in students.items()} == dict.fromkeys(
        students, "submission"
    )
    others = (beside, course_rubric(repository / "course"))
    assert [origin_of(lab, (package, repository)) for lab in others] == ["elsewhere", "elsewhere"]
    assert [origin_of(lab, (None, None)) for lab in students.values()] == ["elsewhere"] * len(students)
    assert origin_of(load_rubric(LAB), (rubrics_folder(),)) == "grader"


@pytest.mark.parametrize(
    ("origin", "words"),
    [
        ("submission", "from the student's repository, where the student can change it"),
        ("pinned", "(pinned by its digest)"),
        ("grader", "(the grader's own)"),
    ],
)
def test_reports_say_where_the_rubric_came_from(origin: str, words: str) -> None:
    of = result().model_copy(update={"rubric_origin": origin})
    stream = io.StringIO()
    Terminal(open_console(stream)).report(of, rubric())
    shown = {
        "markdown": render_markdown(of, rubric()).replace("\\", ""),
        "html": render_html(of, rubric(), Figures()).replace("&#39;", "'"),
        "terminal": " ".join(stream.getvalue().split()),
    }
    if origin == "grader":  # the lab's name says it all there
        assert words not in shown.pop("terminal")
    assert all(words in text for text in shown.values())


def test_a_rubric_is_fetched_by_https_with_its_digest_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site, own = tmp_path / "site", load_rubric(LAB)
    site.mkdir()
    (site / "lab1.yaml").write_bytes(own.path.read_bytes())
    (site / "large.yaml").write_bytes(bytes(BYTES_MAX + 1))
    certificate = certificate_in(tmp_path)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with forge(site, certificate) as server:
        address, pin = f"https://127.0.0.1:{server.port}", f"#sha256:{own.digest}"
        server.moved["/moved"] = "http://127.0.0.1:1"
        url = f"{address}/lab1.yaml{pin}"
        loaded = load_rubric(url)
        assert (loaded.digest, loaded.origin, loaded.rubric.id) == (own.digest, "pinned", LAB)
        assert load_rubric(url) == loaded
        assert len(server.asked) == 1
        loaded.path.write_bytes(b"forged: by hand")
        assert load_rubric(url).rubric.id == LAB
        assert len(server.asked) == 2

        (site / "lab1.yaml").write_bytes(own.path.read_bytes() + b"# forged")
        loaded.path.unlink()
        with pytest.raises(UsageError, match=f"not sha256:{own.digest}"):
            load_rubric(url)
        assert not loaded.path.exists()
        for path, error, words in (
            ("/large.yaml", UsageError, "more than 1 MB"),
            ("/gone.yaml", UsageError, "404"),
            ("/moved/lab1.yaml", HostError, "without https://"),
        ):
            with pytest.raises(error, match=words):
                load_rubric(f"{address}{path}{pin}")

        asked = len(server.asked)
        with pytest.raises(UsageError, match="needs the rubric's digest"):
            load_rubric(f"{address}/lab1.yaml")
        for other in (address.replace("https", "http"), address.replace("//", "//ann:secret@")):
            with pytest.raises(UsageError, match="https:// without a password only") as caught:
                load_rubric(f"{other}/lab1.yaml{pin}")
            assert "secret" not in caught.value.message
        assert len(server.asked) == asked
    with pytest.raises(HostError, match="cannot be fetched"):
        load_rubric(url)


def test_an_address_that_cannot_be_read_is_refused() -> None:
    with pytest.raises(UsageError, match="https:// without a password only"):
        load_rubric("https://[x/lab1.yaml")
