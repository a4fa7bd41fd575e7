"""Repositories that are sent to do harm: no setting of theirs is heeded, no link or pointer out of them followed."""

from __future__ import annotations

import os
import shutil
import subprocess
import zlib
from hashlib import sha1

import pytest

from grader.errors import SubmissionError, UsageError
from grader.intake.limits import IntakeLimits
from grader.intake.source import parse_source
from tests.intake.samples import NODE, commit, git, lab, manifest, opened, repository, write

PYTHON = ("lab1/src/node.py",)


@pytest.fixture
def victim(tmp_path):
    """Another student's, whose script is executable in git and who has a file of their own."""
    return repository(tmp_path / "victim", lab() | {"lab1/solution.py": "42"}, executable=PYTHON)


@pytest.fixture
def mark(tmp_path):
    return tmp_path / "ran"


def refused(source, tmp_path, **fields):
    with pytest.raises(SubmissionError) as caught:
        opened(source, tmp_path / "refused", **fields)
    assert caught.value.message.isprintable()
    assert caught.value.hint
    assert list((tmp_path / "refused/work").iterdir()) == []
    return caught.value.message


def ways(repo):
    """In place, and as a clone."""
    return (repo, f"{repo}@main")


def add_object(repo, kind, content):
    """An object that git itself would not write."""
    data = b"%s %d\0%s" % (kind, len(content), content)
    name = sha1(data).hexdigest()  # noqa: S324 - git's own
    place = repo / ".git/objects" / name[:2] / name[2:]
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(zlib.compress(data))
    return name


def with_tree_entry(repo, mode, name, target):
    """A commit on main whose tree has the lab and one more entry, of whatever name."""
    entries = subprocess.run(
        ["git", "cat-file", "tree", "HEAD^{tree}"],  # noqa: S607 - the machine's git
        cwd=repo,
        check=True,
        capture_output=True,
    ).stdout
    tree = add_object(repo, b"tree", b"%s %s\0%s" % (mode, name, bytes.fromhex(target)) + entries)
    head = git(repo, "commit-tree", tree, "-m", "odd")
    (repo / ".git/refs/heads/main").write_text(head + "\n")


def test_no_setting_of_a_repository_runs_or_leads_anywhere(tmp_path, victim, mark):
    repo = repository(
        tmp_path / "student", lab() | {".gitattributes": "* filter=x diff=x\n"}, executable=PYTHON
    )
    trap = f"touch {mark}; false"
    settings: dict[str, str] = {}
    for key in (
        *("core.fsmonitor", "core.sshCommand", "core.pager", "core.editor", "core.askPass", "core.gitProxy"),
        *("core.alternateRefsCommand", "uploadpack.packObjectsHook", "credential.helper", "gpg.program"),
        *("filter.x.smudge", "filter.x.clean", "filter.x.process", "diff.x.textconv", "diff.external"),
        *(
            "remote.origin.uploadpack",
            "remote.origin.vcs",
            "alias.ls-files",
            "alias.rev-parse",
            "interactive.diffFilter",
        ),
    ):
        settings[key] = trap
    settings |= {
        "core.worktree": str(victim),
        "include.path": "/etc/shadow",
        "extensions.partialClone": "origin",
        "remote.origin.url": f"ext::sh -c 'touch {mark}'",
        "core.repositoryformatversion": "1",
    }
    for key, value in settings.items():
        git(tmp_path, "config", "--file", str(repo / ".git/config"), key, value)
    for source in ways(repo):
        submission = opened(source, tmp_path)
        assert submission.package.mode_source == "git"
        assert submission.package.executable["src/node.py"] is True
        assert "solution.py" not in submission.package.executable
    assert not mark.exists()


def test_a_bare_repository_in_the_package_is_no_repository(tmp_path, mark):
    """git takes any folder with HEAD, objects and refs for one, and heeds its settings."""
    root = write(tmp_path / "student", lab())
    git(root / "lab1", "init", "-q", "--bare", ".")
    git(root / "lab1", "config", "core.fsmonitor", f"touch {mark}")
    (root / ".git").mkdir()
    assert opened(root, tmp_path).package.mode_source == "disk"
    assert not mark.exists()


@pytest.mark.parametrize("form", ["gitdir: {0}/.git\n", "gitdir: ../victim/.git", "gitdir: {0}/.git/../.git"])
def test_a_git_file_that_leads_to_another_repository(form, tmp_path, victim):
    root = write(tmp_path / "student", lab())
    (root / ".git").write_text(form.format(victim))
    submission = opened(root, tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "disk")
    assert submission.package.executable["src/node.py"] is False
    assert "outside of the submission" in submission.hints[0]
    assert "outside of the submission" in refused(f"{root}@main", tmp_path)


@pytest.mark.parametrize("what", [".git", ".git/objects", ".git/refs", ".git/index", ".git/HEAD"])
def test_a_link_to_another_repository(what, tmp_path, victim):
    root = repository(tmp_path / "student", lab())
    place = root / what
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    place.symlink_to(victim / what)
    submission = opened(root, tmp_path)
    assert submission.package.executable["src/node.py"] is False
    assert "solution.py" not in submission.package.executable
    refused(f"{root}@main", tmp_path)


def test_a_commondir_that_leads_to_another_repository(tmp_path, victim):
    root = repository(tmp_path / "student", lab())
    (root / ".git/commondir").write_text(f"{victim}/.git\n")
    assert "outside of the submission" in opened(root, tmp_path).hints[0]
    assert "outside of the submission" in refused(f"{root}@main", tmp_path)


def test_alternates_that_borrow_another_student_s_objects(tmp_path, victim):
    root = repository(tmp_path / "student", lab())
    (root / ".git/objects/info").mkdir(exist_ok=True)
    (root / ".git/objects/info/alternates").write_text(f"{victim}/.git/objects\n")
    (root / ".git/refs/heads/main").write_text(git(victim, "rev-parse", "HEAD") + "\n")
    assert "borrows its objects" in refused(f"{root}@main", tmp_path)
    assert "solution.py" not in opened(root, tmp_path).package.executable


def test_a_submodule_in_place_is_read_by_its_own_repository(tmp_path):
    inner = repository(tmp_path / "inner", lab("."), executable=("src/node.py",))
    outer = repository(tmp_path / "outer", {"readme": ""})
    git(outer, "-c", "protocol.file.allow=always", "submodule", "--quiet", "add", str(inner), "lab1")
    assert (outer / "lab1/.git").is_file()
    for source in (outer, outer / "lab1"):
        assert opened(source, tmp_path).package.mode_source == "git"


@pytest.mark.full
@pytest.mark.parametrize(
    "url", ["ext::sh -c touch% {mark}", "--upload-pack=touch {mark}", "file://{victim}", "-u touch {mark}"]
)
@pytest.mark.parametrize("name", ["lab2", "../../x", "-x"])
def test_submodules_are_never_fetched(url, name, tmp_path, victim, mark):
    url = url.format(mark=mark, victim=victim)
    text = f'[submodule "{name}"]\n\tpath = {name}\n\turl = {url}\n\tupdate = !touch {mark}\n'
    repo = repository(tmp_path / "student", lab() | {".gitmodules": text})
    git(repo, "update-index", "--add", "--cacheinfo", f"160000,{'a' * 40},lab2")
    git(repo, "commit", "-q", "-m", "submodule")
    for source in ways(repo):
        opened(source, tmp_path)
    assert not mark.exists()
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    "text",
    [
        "ext::sh -c 'touch x'",
        "--upload-pack=touch x",
        "-oProxyCommand=touch:x",
        "-x:path",
        "ssh://-oProxyCommand=touch/x",
        "https://-oProxyCommand=touch/x",
        "file://host/etc",
        "https://h/x@--upload-pack=x",
        "fd::17/x",
        "transport::x",
    ],
)
def test_addresses_that_are_options_or_programs(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError):
        parse_source(text)


@pytest.mark.parametrize("name", ["-x", "--upload-pack=x"])
def test_refs_that_begin_with_a_dash(name, tmp_path):
    repo = repository(tmp_path / "student", lab())
    (repo / f".git/refs/heads/{name}").write_text(git(repo, "rev-parse", "HEAD") + "\n")
    assert opened(f"{repo}@main", tmp_path).commit
    with pytest.raises(UsageError):
        opened(f"{repo}@{name}", tmp_path)


def test_thousands_of_refs_and_a_long_history(tmp_path):
    repo = repository(tmp_path / "student", lab())
    head = git(repo, "rev-parse", "HEAD")
    names = sorted(f"refs/{kind}{n}" for n in range(5000) for kind in ("heads/b", "tags/t"))
    lines = "".join(f"{head} {name}\n" for name in names)
    commits = [f"commit refs/heads/main\ncommitter a <a> {n} +0000\ndata 0\n" for n in range(2000)]
    commits[0] += f"from {head}\n"
    stream = "".join(commits)
    command = ["git", "fast-import", "--quiet"]
    subprocess.run(command, cwd=repo, input=stream, text=True, check=True)
    (repo / ".git/packed-refs").write_text(f"# pack-refs with: peeled fully-peeled sorted\n{lines}")
    submission = opened(f"{repo}@main", tmp_path)
    assert git(repo, "rev-list", "--count", "HEAD") == "2001"
    assert git(submission.root, "rev-list", "--count", "HEAD") == "1"


@pytest.mark.parametrize(
    "what", [".git/packed-refs", ".git/HEAD", ".git/index", ".git/config", ".git/refs/heads/x"]
)
def test_a_pipe_in_a_repository_is_never_waited_for(what, tmp_path):
    repo = repository(tmp_path / "student", lab())
    (repo / what).unlink(missing_ok=True)
    os.mkfifo(repo / what)
    assert opened(repo, tmp_path).package.mode_source == "disk"


@pytest.mark.parametrize("content", [b"\0" * 4000, b"DIRC\0\0\0\2\xff\xff\xff\xff", b"x" * 70, b""])
def test_an_index_that_is_none(content, tmp_path):
    repo = repository(tmp_path / "student", lab())
    (repo / ".git/index").write_bytes(content)
    assert opened(repo, tmp_path).package.mode_source == "disk"


def test_a_config_of_a_gigabyte_is_not_read(tmp_path):
    repo = repository(tmp_path / "student", lab())
    os.truncate(repo / ".git/config", 1 << 30)
    assert opened(repo, tmp_path).package.mode_source == "disk"
    assert "config is not what git writes" in refused(f"{repo}@main", tmp_path)


@pytest.mark.parametrize("name", [b"..", b".git", b".GIT", b".git ", b"git~1", b"."])
def test_trees_with_names_that_git_does_not_write(name, tmp_path):
    repo = repository(tmp_path / "student", lab())
    with_tree_entry(repo, b"40000", name, git(repo, "rev-parse", "HEAD^{tree}"))
    assert "git itself does not write" in refused(f"{repo}@main", tmp_path)
    assert not (tmp_path / "refused/lab1").exists()


@pytest.mark.parametrize("name", [b"../../evil", b"/evil", b"a/../../evil"])
def test_trees_with_a_path_for_a_name(name, tmp_path):
    repo = repository(tmp_path / "student", lab())
    with_tree_entry(repo, b"100644", name, git(repo, "rev-parse", "HEAD:lab1/package.xml"))
    refused(f"{repo}@main", tmp_path)
    assert not list(tmp_path.rglob("evil"))


@pytest.mark.full
@pytest.mark.parametrize("leaf", [b"", b"100644 x\0"])
def test_a_tree_that_holds_itself_over_and_over(leaf, tmp_path, monkeypatch):
    """Some hundred bytes that stand for ten thousand million folders, with files in them or without."""
    monkeypatch.setattr("grader.intake.git._SILENCE_S", 2.0)
    repo = repository(tmp_path / "student", lab())
    content = leaf + bytes.fromhex(git(repo, "rev-parse", "HEAD:lab1/package.xml")) if leaf else b""
    name = add_object(repo, b"tree", content)
    for _ in range(10):
        entries = (b"40000 %d\0%s" % (number, bytes.fromhex(name)) for number in range(10))
        name = add_object(repo, b"tree", b"".join(entries))
    with_tree_entry(repo, b"40000", b"a", name)
    message = refused(f"{repo}@main", tmp_path, limits=IntakeLimits(entries=5000))
    assert "more than 5000 files" in message if leaf else "not finished within 2 s" in message


def test_names_with_newlines_and_too_long_for_a_disk(tmp_path):
    repo = repository(tmp_path / "student", lab() | {"lab1/a\nb": "x"})
    blob = git(repo, "rev-parse", "HEAD:lab1/package.xml")
    git(repo, "update-index", "--add", "--cacheinfo", f"100644,{blob},lab1/{'x' * 300}")
    git(repo, "commit", "-q", "-m", "long")
    submission = opened(f"{repo}@main", tmp_path)
    assert "a\nb" in submission.package.executable
    assert "name too long, so left out: lab1/xxx" in submission.hints[0]


def test_a_giant_in_a_commit_is_left_out(tmp_path):
    names = ("giant", "[a]*? b\\c", "!d", "lab1/data.bin")
    files = dict.fromkeys(names, bytes(2 << 20))
    repo = repository(tmp_path / "student", lab() | files)
    submission = opened(f"{repo}@main", tmp_path, limits=IntakeLimits(file_bytes=1 << 20))
    assert not any((submission.root / name).exists() for name in names)
    assert set(submission.package.executable) == {"CMakeLists.txt", "package.xml", "src/node.py"}
    assert submission.package.mode_source == "git"


@pytest.mark.parametrize("attribute", ["working-tree-encoding=UTF-32", "ident", "filter=x"])
def test_attributes_that_make_a_file_larger_are_not_heeded(attribute, tmp_path):
    repo = repository(tmp_path / "student", lab() | {"lab1/a.txt": "$Id$"})
    write(repo, {".gitattributes": f"*.txt {attribute}\n"})
    git(repo, "add", ".gitattributes")
    git(repo, "commit", "-q", "-m", "attributes")
    assert (opened(f"{repo}@main", tmp_path).package.folder / "a.txt").read_text() == "$Id$"


def test_line_ends_that_a_commit_asks_for_are_given_as_to_everybody(tmp_path):
    repo = repository(tmp_path / "student", lab() | {".gitattributes": "*.py text eol=crlf\n"})
    assert b"\r\n" in (opened(f"{repo}@main", tmp_path).package.folder / "src/node.py").read_bytes()


def test_links_of_a_commit_are_links_and_nothing_else(tmp_path):
    repo = repository(tmp_path / "student", lab())
    for name, target in (
        ("out", "/etc/passwd"),
        ("up", "../../.."),
        ("loop", "loop"),
        ("one", "two"),
        ("two", "one"),
    ):
        (repo / "lab1" / name).symlink_to(target)
    commit(repo)
    for source in ways(repo):
        package = opened(source, tmp_path).package
        assert set(package.executable) == {"CMakeLists.txt", "package.xml", "src/node.py"}
        assert (package.folder / "loop").readlink().name == "loop"


def test_a_link_that_is_no_path_is_left_out(tmp_path):
    repo = repository(tmp_path / "student", lab() | {"long": "x" * 9000})
    blob = git(repo, "rev-parse", "HEAD:long")
    git(repo, "update-index", "--add", "--cacheinfo", f"120000,{blob},lab1/link")
    git(repo, "commit", "-q", "-m", "link")
    assert not os.path.lexists(opened(f"{repo}@main", tmp_path).package.folder / "link")


@pytest.mark.parametrize("way", [0, 1])
def test_a_pointer_of_git_lfs_is_named(way, tmp_path):
    pointer = f"version https://git-lfs.github.com/spec/v1\noid sha256:{'a' * 64}\nsize 12345\n"
    repo = repository(
        tmp_path / "student", lab() | {"lab1/map.png": pointer, ".gitattributes": "*.png filter=lfs\n"}
    )
    (hint,) = opened(ways(repo)[way], tmp_path).hints
    assert hint.startswith("only a pointer of Git LFS")
    assert "map.png" in hint


# A package behind a link


def test_a_package_given_as_a_link_inside_is_followed(tmp_path):
    root = write(
        tmp_path / "ws",
        {".store/one/package.xml": manifest("lab1"), ".store/one/src/node.py": NODE, "src/x": ""},
    )
    (root / "src/lab1").symlink_to("../.store/one")
    submission = opened(root, tmp_path)
    assert submission.package.path == ".store/one"
    assert "lab1 is a link, followed to .store/one" in submission.hints


@pytest.mark.parametrize("target", ["../../victim/lab1", "{victim}/lab1", "lab1", "hop"])
def test_a_package_given_as_a_link_outside_is_not_followed(target, tmp_path, victim):
    root = write(tmp_path / "ws", {"src/x": ""})
    (root / "src/hop").symlink_to("../../victim/lab1")
    (root / "src/lab1").symlink_to(target.format(victim=victim))
    assert "no package lab1" in refused(root, tmp_path)


def test_a_script_behind_a_link_to_another_student_is_not_read(tmp_path, victim):
    root = write(tmp_path / "ws", lab())
    (root / "lab1/src/node.py").unlink()
    (root / "lab1/src/node.py").symlink_to(victim / "lab1/src/node.py")
    submission = opened(root, tmp_path)
    assert "src/node.py" not in submission.package.executable
