"""Who says that a file is executable, and what identifies a submission."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from grader.errors import OutputError, UsageError
from grader.model.submission import chmod_hint
from grader.package.facts import read_package
from grader.package.repairs import Wanted, find_repairs
from tests.intake.samples import NODE, commit, git, lab, lab_tar, lab_zip, manifest, opened, repository, write


def snapshot(root: Path) -> list[tuple[str, int, int, int]]:
    return sorted(
        (str(p), p.lstat().st_mode, p.lstat().st_mtime_ns, p.lstat().st_size) for p in root.rglob("*")
    )


def test_a_plain_folder_has_the_disk_s_modes(tmp_path):
    root = write(tmp_path / "ws", lab() | {"lab1/b.py": NODE}, executable=("lab1/b.py",))
    (root / "lab1/link").symlink_to("b.py")
    os.mkfifo(root / "lab1/pipe")
    submission = opened(root, tmp_path)
    assert submission.package.mode_source == "disk"
    assert submission.package.executable == {
        "CMakeLists.txt": False,
        "b.py": True,
        "package.xml": False,
        "src/node.py": False,
    }
    assert (submission.commit, submission.archive_sha256) == (None, None)
    assert submission.hints == ("neither a file nor a folder, so left out: pipe",)


def test_git_s_word_counts_and_a_difference_is_named(tmp_path):
    repo = repository(
        tmp_path / "r", lab() | {"lab1/b.py": NODE, "lab1/t.txt": ""}, executable=("lab1/b.py",)
    )
    (repo / "lab1/src/node.py").chmod(0o755)
    (repo / "lab1/t.txt").chmod(0o755)
    (repo / "lab1/b.py").chmod(0o644)
    submission = opened(repo, tmp_path)
    assert submission.package.executable["src/node.py"] is False
    assert submission.package.executable["b.py"] is True
    assert [hint.partition(":")[0] for hint in submission.hints] == [
        "b.py is executable in git but not on this disk",
        "src/node.py is executable on this disk but not in git",
    ]
    assert "git update-index --chmod=+x src/node.py" in submission.hints[1]
    clone = opened(f"{repo}@main", tmp_path)
    assert (clone.package.executable["src/node.py"], clone.hints) == (False, ())


def test_staged_modes_count_and_untracked_files_come_from_the_disk(tmp_path):
    repo = repository(tmp_path / "r", lab())
    git(repo, "update-index", "--chmod=+x", "lab1/src/node.py")
    write(repo, {"lab1/src/new.py": NODE, "lab1/notes.txt": ""}, executable=("lab1/src/new.py",))
    submission = opened(repo, tmp_path)
    assert submission.package.executable["src/node.py"] is True
    assert submission.package.executable["src/new.py"] is True
    assert any("not in git yet" in hint and "src/new.py" in hint for hint in submission.hints)
    assert not any("notes.txt" in hint for hint in submission.hints)


def test_an_untracked_folder_in_some_repository(tmp_path):
    repo = repository(tmp_path / "r", {"readme": ""})
    write(repo / "ws", lab())
    submission = opened(repo / "ws", tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "disk")
    whole = opened(repo, tmp_path)
    assert whole.commit == git(repo, "rev-parse", "HEAD")


def test_a_folder_inside_a_repository(tmp_path):
    repo = repository(tmp_path / "r", {f"deep/er/{k}": v for k, v in lab().items()})
    submission = opened(repo / "deep", tmp_path)
    assert submission.commit == git(repo, "rev-parse", "HEAD")
    assert submission.package.mode_source == "git"


def test_what_git_ignores_is_read_up_to_the_top_of_the_repository(tmp_path):
    files = {f"ws/src/{path}": text for path, text in lab().items()} | {".gitignore": "# mine\nlaunch/\n"}
    repo = repository(tmp_path / "r", files)
    for root in (repo, repo / "ws", repo / "ws/src/lab1"):
        (line,) = read_package(opened(root, tmp_path).package).git_ignores
        assert (line.file, line.line, line.hides("launch/a.launch", 1)) == ("../../../.gitignore", 2, True)
    write(tmp_path / "untracked", lab() | {"lab1/.gitignore": "launch/\n"})
    assert not read_package(opened(tmp_path / "untracked/lab1", tmp_path).package).git_ignores


def test_a_repository_below_the_folder(tmp_path):
    repo = repository(tmp_path / "ws/src/lab1", lab("."))
    submission = opened(tmp_path / "ws", tmp_path)
    assert submission.commit == git(repo, "rev-parse", "HEAD")
    assert submission.package.mode_source == "git"


def test_a_linked_work_tree(tmp_path):
    repo = repository(tmp_path / "r", lab())
    git(repo, "worktree", "add", "-q", "--detach", str(tmp_path / "second"))
    assert opened(tmp_path / "second", tmp_path).package.mode_source == "git"
    assert opened(f"{tmp_path}/second@main", tmp_path).commit == git(repo, "rev-parse", "HEAD")


@pytest.mark.parametrize("content", ["gitdir: /nowhere/else\n", "junk", None])
def test_a_repository_that_git_cannot_read(content, tmp_path):
    root = write(tmp_path / "ws", lab(), executable=("lab1/src/node.py",))
    if content is None:
        (root / ".git").mkdir()
    else:
        (root / ".git").write_text(content)
    submission = opened(root, tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "disk")
    assert "git cannot read this repository" in submission.hints[0]
    assert submission.package.executable["src/node.py"] is True


def test_a_repository_before_its_first_commit(tmp_path):
    root = write(tmp_path / "ws", lab())
    git(root, "init", "-q")
    assert opened(root, tmp_path).commit is None
    git(root, "add", ".")
    submission = opened(root, tmp_path)
    assert (submission.commit, submission.package.mode_source) == (None, "git")


def test_names_that_git_would_quote(tmp_path):
    names = ("lab1/ü b.py", 'lab1/"q".py', "lab1/new\nline.py")
    repo = repository(tmp_path / "r", lab() | dict.fromkeys(names, NODE), executable=names)
    for path in (repo / name for name in names):
        path.chmod(0o644)
    package = opened(repo, tmp_path).package
    assert [package.executable[name.removeprefix("lab1/")] for name in names] == [True, True, True]


def test_a_name_that_is_not_utf8(tmp_path):
    repo = repository(tmp_path / "r", lab() | {"lab1/caf\udce9.py": NODE, "caf\udce9/x": ""})
    for source in (repo, repo.as_uri()):
        submission = opened(source, tmp_path)
        assert set(submission.package.executable) == {"CMakeLists.txt", "package.xml", "src/node.py"}
        assert "caf\\xe9.py" in submission.hints[0]
        submission.model_dump_json()
    odd = write(tmp_path / "caf\udce9", lab() | {"caf\udce9/package.xml": "broken"})
    submission = opened(odd, tmp_path)
    assert [p.name for p in submission.packages] == ["caf\\xe9"]
    assert "caf\\xe9" in submission.source


def test_a_folder_is_never_written_to(tmp_path):
    repo = repository(tmp_path / "r", lab())
    (repo / "lab1/src/node.py").touch()
    before = snapshot(repo)
    opened(repo, tmp_path)
    assert snapshot(repo) == before
    assert list((tmp_path / "work").iterdir()) == []


def test_the_digest_is_of_the_tree_alone(tmp_path):
    files, scripts = lab(), ("lab1/src/node.py",)
    repo = repository(tmp_path / "r", files, executable=scripts)
    plain = write(tmp_path / "elsewhere", files, executable=scripts)
    os.utime(plain / "lab1/package.xml", (1, 1))
    found = {
        opened(source, tmp_path).digest
        for source in (
            repo,
            repo.as_uri(),
            plain,
            plain / "lab1",
            lab_tar(tmp_path / "a.tgz", packing="gz"),
            lab_zip(tmp_path / "a.zip"),
        )
    }
    assert len(found) == 1
    write(repo, {"lab2/x": ""})
    commit(repo)
    assert {opened(repo, tmp_path).digest} == found


@pytest.mark.parametrize(
    "change",
    [
        lambda root: (root / "src/node.py").write_text("x"),
        lambda root: (root / "src/node.py").chmod(0o755),
        lambda root: (root / "src/node.py").rename(root / "src/nodes.py"),
        lambda root: (root / "new").touch(),
        lambda root: (root / "link").symlink_to("src"),
        lambda root: (root / "link").symlink_to("nowhere"),
        lambda root: os.mkfifo(root / "pipe"),
        lambda root: (root / "src/node.py").unlink(),
    ],
)
def test_every_change_changes_the_digest(change, tmp_path):
    root = write(tmp_path / "lab1", lab("."))
    before = opened(root, tmp_path).digest
    change(root)
    assert opened(root, tmp_path).digest != before
    assert opened(root, tmp_path).digest == opened(root, tmp_path).digest


def test_the_digest_leaves_git_out(tmp_path):
    root = write(tmp_path / "lab1", lab("."))
    before = opened(root, tmp_path).digest
    git(root, "init", "-q")
    shutil.copytree(root / ".git", root / "src/.git")
    assert opened(root, tmp_path).digest == before


def test_the_id(tmp_path, monkeypatch):
    root = write(tmp_path / "Zoë's lab", lab())
    assert opened(root, tmp_path).id == "Zoe-s-lab"
    assert opened(root, tmp_path, submission_id="../s 1").id == "s-1"
    monkeypatch.chdir(root)
    assert opened(".", tmp_path).id == "Zoe-s-lab"
    assert opened(".", tmp_path).root == root


def test_a_source_that_does_not_exist(tmp_path):
    with pytest.raises(UsageError, match="does not exist"):
        opened(tmp_path / "nowhere", tmp_path)
    assert not (tmp_path / "work").exists()


def test_a_work_folder_that_cannot_be_made(tmp_path):
    root = write(tmp_path / "ws", lab() | {"file": ""})
    with pytest.raises(OutputError, match="cannot be written"):
        opened(root, root / "file")


@pytest.mark.usefixtures("without_processes")
def test_a_disk_that_is_full(tmp_path, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    path = lab_zip(tmp_path / "a.zip")
    monkeypatch.setattr(shutil, "copyfileobj", full)
    with pytest.raises(OutputError, match="disk is full"):
        opened(path, tmp_path)


def test_the_package_is_at_hand_after_opening(tmp_path):
    for source in (lab_zip(tmp_path / "a.zip"), repository(tmp_path / "r", lab()).as_uri()):
        folder = opened(source, tmp_path).package.folder
        assert (folder / "package.xml").read_text() == manifest("lab1")


@pytest.mark.parametrize(
    ("handed_in", "by_hand"),
    [
        ("tracked", "chmod +x src/node.py, then git add --chmod=+x src/node.py, commit and push"),
        ("only git lacks it", "git update-index --chmod=+x src/node.py, then commit and push"),
        ("new", "chmod +x src/node.py, then git add --chmod=+x src/node.py, commit and push"),
        ("archive", "chmod +x src/node.py, then pack it again with tar or zip, which keep that permission"),
        ("folder", "chmod +x src/node.py, and hand it in with git, tar or zip, which keep that permission"),
    ],
)
def test_how_a_script_becomes_executable_is_true_for_how_it_was_handed_in(handed_in, by_hand, tmp_path):
    if handed_in in {"tracked", "only git lacks it"}:
        source = repository(tmp_path / "r", lab())
        (source / "lab1/src/node.py").chmod(0o644 if handed_in == "tracked" else 0o755)
    elif handed_in == "new":
        source = repository(tmp_path / "r", {k: v for k, v in lab().items() if k != "lab1/src/node.py"})
        write(source, lab())
    else:
        source = write(tmp_path / "lab", lab())
        (source / "lab1/src/node.py").chmod(0o644)
    if handed_in == "archive":
        source = Path(shutil.make_archive(str(tmp_path / "lab"), "gztar", source))
    handed = opened(source, tmp_path / "out").package
    repairs = find_repairs(
        handed.folder, read_package(handed), Wanted(package="lab1", scripts=("src/node.py",))
    )
    assert [one.fix for one in repairs if one.kind == "executable-bit"] == [by_hand]


@pytest.mark.parametrize("new", [False, True])
def test_what_the_hint_tells_git_is_enough(new, tmp_path):
    repo = repository(tmp_path / "r", {k: v for k, v in lab().items() if not (new and k.endswith("node.py"))})
    write(repo, lab())
    chmod, add = chmod_hint("git", "lab1/src/node.py").removesuffix(", commit and push").split(", then ")
    assert chmod == "chmod +x lab1/src/node.py"
    assert opened(repo, tmp_path).package.executable["src/node.py"] is False
    git(repo, *add.split()[1:])
    assert opened(repo, tmp_path).package.executable["src/node.py"] is True
