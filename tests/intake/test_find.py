"""Which folder is the lab's package."""

from __future__ import annotations

import os
import subprocess
import time

import pytest

from grader.errors import PackageNotFound, SubmissionError
from grader.intake.candidates import enclosing_package, find_packages
from grader.intake.choose import WantedPackage
from tests.intake.samples import lab, manifest, opened, repository, write

BROKEN = "<package><name>lab1</name><oops></package>"
NAMELESS = "this is no xml at all"


def tree(*packages: str, **files: str) -> dict[str, str | bytes]:
    """A package in each folder, named as after the colon (`src/a:lab1`) or as the folder."""
    found: dict[str, str | bytes] = dict(files)
    for text in packages:
        folder, _, name = text.partition(":")
        found |= lab(folder, name or folder.rpartition("/")[2])
    return found


@pytest.mark.parametrize(
    ("files", "path", "hints"),
    [
        (tree("lab1"), "lab1", ()),
        (tree(".:lab1"), ".", ()),
        (tree("a/b c/ü/d/e/lab1"), "a/b c/ü/d/e/lab1", ()),
        (tree("other:lab1", "lab1:lab2"), "other", ()),
        (tree("lab2", "lab1", "project"), "lab1", ()),
        (tree("src/lab1", "build/lab1", "devel/share/lab1", "install/share/lab1"), "src/lab1", ()),
        (tree("z/src/lab1", ".hidden/lab1", ".catkin_tools/lab1"), "z/src/lab1", ()),
        (tree("meta", "meta/lab1", "deep/er/lab1"), "deep/er/lab1", ()),
        (tree("lab1", "lab1/src/lab1"), "lab1", ()),
        (tree("x:Lab1"), "x", ("exactly lab1",)),
        (tree("x:Lab1", "y/z:lab1"), "y/z", ()),
        (tree("lab1:lab_one"), "lab1", ("names the package lab_one",)),
        (tree("LAB1:lab_one"), "LAB1", ("names the package lab_one",)),
        (tree("lab1-main:foo"), "lab1-main", ("names the package foo",)),
        # A name that is nearly right counts where it is the only one; lab2 is another lab's.
        (tree("week1:lab_1"), "week1", ("exactly lab1",)),
        (tree("week1:LAB-1", "lab2"), "week1", ("exactly lab1",)),
        (tree("week1:labb1"), "week1", ("exactly lab1",)),
        (tree("week1:alb1"), "week1", ("exactly lab1",)),
        (tree("week1:lb1", "old:lab1"), "old", ()),
        # Of two copies: what catkin sees, then the lab's files, then depth.
        (
            {"lab1/package.xml": manifest("lab1"), "lab1/CMakeLists.txt": "", **tree("src/a/lab1")},
            "src/a/lab1",
            ("src/a/lab1 is graded, lab1 is not",),
        ),
        (
            tree("lab1", "ws/src/a/lab1") | {"ws/.catkin_workspace": ""},
            "ws/src/a/lab1",
            ("ws/src/a/lab1 is",),
        ),
        (tree("lab1", "a/src/lab1") | {"a/src/CATKIN_IGNORE": "", "a/src/CMakeLists.txt": ""}, "lab1", ()),
        (tree("lab1") | {"lab1/package.xml": BROKEN}, "lab1", ()),
        (tree("x:lab1") | {"x/package.xml": BROKEN}, "x", ()),
        (tree("lab1") | {"lab1/package.xml": NAMELESS}, "lab1", ("no name can be read",)),
        (tree("lab1") | {"lab1/package.xml": ""}, "lab1", ("no name can be read",)),
        (tree("lab1", "lab2") | {"lab2/package.xml": NAMELESS}, "lab1", ()),
        (tree("b/lab1", "a/lab1"), "a/lab1", ("a/lab1 is graded, b/lab1 is not",)),
        (tree("b/lab1", "a/c/lab1"), "b/lab1", ("b/lab1 is graded, a/c/lab1 is not",)),
        (tree("backup:lab1", "lab1"), "lab1", ("lab1 is graded, backup is not",)),
        (tree("lab1") | {"lab1/CATKIN_IGNORE": ""}, "lab1", ("lab1/CATKIN_IGNORE: delete",)),
        (tree("old/lab1", "x/lab1") | {"old/CATKIN_IGNORE": ""}, "x/lab1", ()),
        (tree("old/lab1") | {"old/COLCON_IGNORE": ""}, "old/lab1", ("old/COLCON_IGNORE",)),
        ({"lab1/src/a.py": "", "lab2/package.xml": manifest("lab2")}, "lab1", ("has no package.xml",)),
        ({"ws/Lab1/CMakeLists.txt": ""}, "ws/Lab1", ("has no package.xml",)),
        ({"lab1/scripts/talker.py": ""}, "lab1", ("has no package.xml",)),
        ({"lab1/scripts/talker.py": "", **tree("ws/src/lab1")}, "ws/src/lab1", ()),
        ({"lab1/src/lab1/CMakeLists.txt": ""}, "lab1/src/lab1", ("has no package.xml",)),
    ],
)
def test_the_package_is_found(files, path, hints, tmp_path):
    submission = opened(write(tmp_path / "repo", files), tmp_path)
    assert submission.package.path == path
    assert submission.package.folder == tmp_path / "repo" / path
    assert len(submission.hints) == len(hints)
    for hint, part in zip(submission.hints, hints, strict=True):
        assert part in hint


@pytest.mark.parametrize(
    ("files", "message", "hint"),
    [
        (
            tree("lab2", "project"),
            "packages here: lab2, project",
            "rename that to lab1 (<name> in its package.xml)",
        ),
        (
            tree("a:other"),
            "packages here: other",
            "Write <name>lab1</name> in a/package.xml, line 3, in place of other, project(lab1) in CMakeLists.txt",
        ),
        (tree("a:other"), "packages here: other", "or grade it with --package other."),
        (tree("a:lab2"), "packages here: lab2", "--package lab2"),
        (tree("a:lab_1", "b:lab-1"), "packages here: lab-1, lab_1", "--package NAME"),
        (tree("a:../x\n\x85;rm -rf"), "packages here: ../x ;rm -rf", "--package '../x ;rm -rf'."),
        ({"readme": "x"}, "no package.xml", "<name>lab1</name>"),
        (tree("build/lab1"), "no package.xml", "only a copy in build/"),
        (tree("devel/share/lab1"), "no package.xml", "only a copy in devel/"),
        (tree("ws", "ws/lab1"), "packages here: ws", "below another package.xml"),
        ({"lab1.zip": "", "x": ""}, "no package.xml", "lab1.zip is here"),
        (
            {"a/Package.xml": ""},
            "no package.xml",
            "In a/, Package.xml has to be called package.xml: git mv Package.xml",
        ),
        ({"package (1).xml": ""}, "no package.xml", "git mv 'package (1).xml' package.xml."),
        ({"build/stamps/package.xml.stamp": ""}, "no package.xml", "<name>lab1</name>: was it handed in"),
        (
            {"a/manifest.xml": ""},
            "no package.xml",
            "In a/, manifest.xml is rosbuild's, which catkin does not read: write package.xml, and a CMakeLists.txt w",
        ),
        (
            {**tree("b:other"), "b/package.xml.orig": ""},
            "packages here: other",
            "Write <name>lab1</name> in ",
        ),
        # A workspace that is called like the lab is not the lab's package.
        (tree("lab1/src/other"), "packages here: other", "Write <name>lab1</name> in "),
    ],
)
def test_what_is_there_instead_is_named(files, message, hint, tmp_path):
    with pytest.raises(PackageNotFound) as caught:
        opened(write(tmp_path / "repo", files), tmp_path)
    assert message in caught.value.message
    assert hint in caught.value.hint
    assert "\n" not in caught.value.message + caught.value.hint
    assert list((tmp_path / "work").iterdir()) == []


@pytest.mark.parametrize("path", ["lab1", "catkin_ws/src/lab1"])
def test_an_empty_folder_of_the_name_may_be_a_submodule(path, tmp_path):
    repo = write(tmp_path / "repo", {".gitmodules": "", **tree("b:other")})
    (repo / path).mkdir(parents=True)
    with pytest.raises(PackageNotFound, match="packages here: other") as caught:
        opened(repo, tmp_path)
    assert caught.value.hint.startswith(
        f"{path}/ is empty here; if it is a repository of its own: delete {path}/.git"
    )


def test_an_empty_folder_of_a_package_that_is_needed_may_be_a_submodule(tmp_path):
    needs = manifest("lab1").replace("</package>", "<exec_depend>lab_msgs</exec_depend></package>")
    repo = write(tmp_path / "repo", {**tree("src/lab1"), "src/lab1/package.xml": needs, "src/full/a.txt": ""})
    for name in ("lab_msgs", "other_msgs", "rospy"):
        (repo / "src" / name).mkdir()
    said = [hint for hint in opened(repo, tmp_path).hints if "is empty" in hint]
    why = "src/lab_msgs/ is empty here, and package.xml names lab_msgs: if it is a repository of its own, delete "
    assert [hint[: len(why)] for hint in said] == [why]


@pytest.mark.parametrize(
    ("files", "message", "hint"),
    [
        (
            {**tree("a:first", "b:second"), "b/src/talker.py": "x"},
            "packages here: second, first",
            "--package second.",
        ),
        (
            {**tree("a:first", "b:second"), "a/talker.py": "x", "b/talker.py": "x"},
            "packages here: first, second",
            "--package NAME.",
        ),
        (
            {"week1/talker.py": "x"},
            "no package.xml",
            "makes it, to hold talker.py in week1/; talker.py is not executable: chmod +x it.",
        ),
        (
            {"week1/lab.launch": "x", "week1/set.py": "x"},
            "no package.xml",
            (
                "makes it, to hold lab.launch, set.py in week1/; lab.launch belongs in the package's launch/; "
                "set.py belongs in the package's src/; set.py is not executable"
            ),
        ),
        # However much git keeps beside it.
        (
            {**{f".git/objects/{n:03}/x": "" for n in range(300)}, "my/lab/week1/talker.py": "x"},
            "no package.xml",
            "makes it, to hold talker.py in my/lab/week1/; talker.py is not executable",
        ),
        (
            {"week1/talker.py": "#!/usr/bin/env python\r\n", "week1/listener.py": "#!/usr/bin/env python\n"},
            "no package.xml",
            (
                "week1/; talker.py cannot be started, because of Windows' line ends (CRLF): dos2unix it first; "
                "listener.py, talker.py are not executable: chmod +x them."
            ),
        ),
        (
            {"talker.py": '"""\nprint "this"\n"""\nprint(\'x\')\n    print "hello %s" % name\n'},
            "no package.xml",
            (
                "hold talker.py; talker.py is not executable: chmod +x it; line 5 of talker.py prints as in Python 2: "
                "write print(…), with brackets."
            ),
        ),
    ],
)
def test_what_has_the_labs_files_is_named(files, message, hint, tmp_path):
    wanted = WantedPackage(
        name="lab1", paths=frozenset({"talker.py", "listener.py", "src/set.py", "lab.launch"})
    )
    with pytest.raises(PackageNotFound) as caught:
        opened(write(tmp_path / "repo", files), tmp_path, package=wanted)
    assert message in caught.value.message
    assert hint in caught.value.hint


@pytest.mark.parametrize(
    ("files", "path"),
    [
        (("scripts/talker.py", "README.md"), "."),
        (("ws/src/week1/scripts/talker.py", "ws/src/week1/launch/a.launch"), "ws/src/week1"),
        (("week1/src/listener.py", "week2/src/other.py"), "week1"),
        (("week1/CMakeLists.txt", "week1/nodes/talker.py"), "week1"),
        # what is there in place of the manifest is told by its criterion
        (("manifest.xml", "CMakeLists.txt", "src/talker.py"), "."),
        (("week1/package (1).xml", "week1/scripts/talker.py"), "week1"),
        (("manifest.xml", "catkin_generated/stamps/a/package.xml.stamp", "scripts/talker.py"), "."),
    ],
)
def test_without_any_manifest_the_only_folder_with_the_labs_files_is_taken(files, path, tmp_path):
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py", "listener.py"}))
    found = opened(write(tmp_path / "repo", dict.fromkeys(files, "x")), tmp_path, package=wanted)
    assert (found.package.path, found.package.name) == (path, "lab1")
    assert "it was taken for the package lab1 because of the lab's files in it" in found.hints[0]


@pytest.mark.parametrize(
    "files",
    [
        {"a/scripts/talker.py": "x", "b/scripts/talker.py": "x"},
        {"a/scripts/other.py": "x"},
        {**tree("other"), "a/scripts/talker.py": "x"},
        {"a/scripts/talker.py": "x", "b/package (1).xml": ""},
        {"a/scripts/talker.py": "x", **tree("build/lab1")},
        {"ws/src/week1/talker.py": "x"},
        {"ws/src/CMakeLists.txt": "x", "ws/src/week1/talker.py": "x"},
        {"src/other.py": "x", "week1/talker.py": "x"},
        {"src/other.py": "x", "CMakeLists.txt": "x", "devel/lib/lab1/talker.py": "x"},
    ],
)
def test_no_folder_without_a_manifest_is_taken_where_another_may_be_meant(files, tmp_path):
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py", "listener.py"}))
    with pytest.raises(PackageNotFound):
        opened(write(tmp_path / "repo", files), tmp_path, package=wanted)


def test_a_folder_of_another_package_is_not_taken_for_it_either(tmp_path):
    repo = write(tmp_path / "repo", {**tree(".", "other"), "week1/scripts/talker.py": "x"})
    with pytest.raises(PackageNotFound):
        opened(repo / "week1", tmp_path, package=WantedPackage(name="lab1", paths=frozenset({"talker.py"})))


@pytest.mark.parametrize(
    ("beside", "path"), [({}, "labb1"), ({"lab1/CMakeLists.txt": ""}, "lab1"), (tree("lab2"), "labb1")]
)
def test_a_folder_of_scripts_is_not_taken_where_a_package_of_nearly_that_name_has_them(
    beside, path, tmp_path
):
    files = {"lab1/scripts/talker.py": "", **tree("labb1"), "labb1/scripts/talker.py": "", **beside}
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py"}))
    assert opened(write(tmp_path / "repo", files), tmp_path, package=wanted).package.path == path


def test_what_another_copy_has_and_the_graded_one_has_not_is_named(tmp_path):
    files = {**tree("src/lab1", "lab1"), "lab1/scripts/talker.py": "", "src/lab1/scripts/listener.py": ""}
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py", "listener.py"}))
    found = opened(write(tmp_path / "repo", files), tmp_path, package=wanted)
    assert found.package.path == "src/lab1"
    assert found.hints[-1] == (
        "talker.py is in lab1, which is not graded: move it to src/lab1, into the same folder there"
    )


@pytest.mark.parametrize(
    ("beside", "told"),
    [
        (
            {"week1/scripts/talker.py": ""},
            [
                "talker.py is at week1/scripts/talker.py, in another package: copy it to lab1/scripts/talker.py"
            ],
        ),
        (
            {"week1/launch/lab.launch": '<node pkg="week1"/>', "lab1/scripts/talker.py": ""},
            [
                (
                    "lab.launch is at week1/launch/lab.launch, in another package: copy it to lab1/launch/lab.launch, "
                    'with pkg="lab1" in it'
                )
            ],
        ),
        (
            {
                "week1/launch/lab.launch": '<node pkg="week1" type="talker.py"/><node type="b.py"/><node type="a.py"/>',
                **dict.fromkeys(("lab1/scripts/talker.py", "lab1/src/b.py", "week1/src/a.py"), ""),
            },
            [
                (
                    "lab.launch is at week1/launch/lab.launch, in another package: copy it to lab1/launch/lab.launch, "
                    'with pkg="lab1" in it and without its <node> of a.py'
                )
            ],
        ),
        ({"week1/scripts/other.py": ""}, []),
        (
            {"launch/lab.launch": "", "lab1/scripts/talker.py": ""},
            ["lab.launch is at launch/lab.launch, outside of the package: move it to lab1/launch/lab.launch"],
        ),
    ],
)
def test_what_another_package_has_and_the_lab_s_own_has_not_is_named(beside, told, tmp_path):
    files = {**tree("lab1", "lab1"), **tree("week1", "week1"), "lab1/scripts/listener.py": "", **beside}
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py", "listener.py", "lab.launch"}))
    found = opened(write(tmp_path / "repo", files), tmp_path, package=wanted)
    assert list(found.hints) == told


def test_what_lies_beside_the_src_of_a_workspace_is_named(tmp_path):
    files = {**tree("src/lab1"), "src/lab1/scripts/talker.py": "", "launch/lab.launch": ""}
    wanted = WantedPackage(name="lab1", paths=frozenset({"talker.py", "lab.launch"}))
    found = opened(write(tmp_path / "repo", files), tmp_path, package=wanted)
    where = (
        "lab.launch is at launch/lab.launch, outside of the package: move it to src/lab1/launch/lab.launch"
    )
    assert list(found.hints) == [where]


@pytest.mark.parametrize(
    "text",
    [
        manifest("lab1"),
        "\ufeff" + manifest("lab1"),
        "\n\n  " + manifest("lab1"),
        "This file has no style of its own.\n" + manifest("lab1"),
        '<package xmlns="http://x/y"><name>lab1</name></package>',
        '<p:package xmlns:p="http://x/y"><p:name>lab1</p:name></p:package>',
        "<package><name>\n  lab1 <!-- mine -->\n</name></package>",
        "<package><!-- <name>no</name> --><name>lab1</name><name>lab2</name></package>",
        '<?xml version="1.0" encoding="utf-16"?><package><name>lab1</name></package>'.encode("utf-16"),
        "<package><description>a & b</description><name>lab1</name></package>",
    ],
)
def test_the_name_is_read_from_any_manifest(text, tmp_path):
    write(tmp_path / "repo", {"x/package.xml": text})
    assert opened(tmp_path / "repo", tmp_path).package.name == "lab1"


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE p [<!ENTITY n "lab1">]><package><name>&n;</name></package>',
        '<!DOCTYPE p [<!ENTITY n SYSTEM "secret">]><package><name>&n;</name></package>',
        "<package><name>lab1</name></package>" + " " * (1 << 20),
        "<package><name/></package>",
        "<package/>",
        "lab1 < lab1",
        b"\xff\xfe\x00",
    ],
)
def test_nothing_is_read_from_a_manifest_that_plays_tricks(text, tmp_path):
    write(tmp_path / "repo", {"x/package.xml": text, "x/secret": "lab1"})
    with pytest.raises(PackageNotFound, match="packages here: x"):
        opened(tmp_path / "repo", tmp_path)


def test_a_manifest_is_not_read_through_a_link_that_leads_out(tmp_path):
    write(tmp_path, {"outside.xml": manifest("lab1"), "repo/inside.xml": manifest("lab1"), "repo/x/a": ""})
    link = tmp_path / "repo/x/package.xml"
    link.symlink_to(tmp_path / "outside.xml")
    with pytest.raises(PackageNotFound):
        opened(tmp_path / "repo", tmp_path)
    link.unlink()
    link.symlink_to("../inside.xml")
    assert opened(tmp_path / "repo", tmp_path).package.path == "x"


def test_links_are_not_followed(tmp_path):
    root = write(tmp_path / "repo", tree("a/lab1"))
    (root / "a/loop").symlink_to(root)
    (root / "b").symlink_to("a")
    (root / "CMakeLists.txt").symlink_to("/opt/ros/nowhere/toplevel.cmake")
    (root / "outside").symlink_to(tmp_path)
    submission = opened(root, tmp_path)
    assert (submission.package.path, submission.hints) == ("a/lab1", ())


def test_a_link_in_the_package_s_place_is_named(tmp_path):
    write(tmp_path, {"real/package.xml": manifest("lab1"), "repo/readme": ""})
    (tmp_path / "repo/lab1").symlink_to(tmp_path / "real")
    with pytest.raises(PackageNotFound) as caught:
        opened(tmp_path / "repo", tmp_path)
    assert "lab1 is a link" in caught.value.hint


def test_a_folder_inside_the_package_stands_for_the_package(tmp_path):
    root = write(tmp_path / "ws", tree("lab1", "lab2") | {"lab1/src/deep/x": ""})
    submission = opened(root / "lab1/src/deep", tmp_path)
    assert (submission.package.path, submission.root, submission.id) == (".", root / "lab1", "lab1")
    with pytest.raises(PackageNotFound):
        opened(root / "lab2/src", tmp_path)


def test_enclosing_package(tmp_path):
    root = repository(tmp_path / "ws", tree("a/lab1", "a/lab1/src/copy"))
    inner = root / "a/lab1/src/copy"
    assert enclosing_package(inner / "src") == root / "a/lab1"
    assert enclosing_package(root / "a/lab1/package.xml") == root / "a/lab1"
    assert enclosing_package(root / "a/lab1") == root / "a/lab1"
    assert enclosing_package(root / "a") is None
    (root / ".git").rename(tmp_path / "gone")
    assert enclosing_package(inner / "src") == inner


def test_find_packages(tmp_path):
    root = write(tmp_path / "ws", tree("src/lab1", "lab2:two", "build/x") | {"bare/CMakeLists.txt": ""})
    assert find_packages(root) == [("two", root / "lab2"), ("lab1", root / "src/lab1")]
    assert find_packages(root / "src/lab1/src") == [("lab1", root / "src/lab1")]
    assert find_packages(root / "bare") == []


def test_other_packages_are_listed(tmp_path):
    files = tree("lab1", "b/lab1", "msgs:my_msgs", "broken", "hidden/x") | {
        "broken/package.xml": NAMELESS,
        "hidden/CATKIN_IGNORE": "",
    }
    submission = opened(write(tmp_path / "repo", files), tmp_path)
    assert [(p.name, p.path) for p in submission.packages] == [("broken", "broken"), ("my_msgs", "msgs")]
    assert submission.packages[1].executable == {
        "CMakeLists.txt": False,
        "package.xml": False,
        "src/node.py": False,
    }


def test_the_package_keeps_a_second_manifest_below_it(tmp_path):
    root = write(tmp_path / "repo", tree("lab1", "lab1/src/copy:other"))
    submission = opened(root, tmp_path)
    assert "src/copy/package.xml" in submission.package.executable
    assert submission.packages == ()


def test_what_a_build_left_is_not_even_looked_at(tmp_path, monkeypatch):
    files = tree("src/lab1") | {
        f"{space}/d{n}/x": "" for space in ("build", "devel", ".git") for n in range(9)
    }
    root = write(tmp_path / "repo", files)
    seen = []
    scandir = os.scandir
    monkeypatch.setattr(os, "scandir", lambda path: seen.append(str(path)) or scandir(path))
    assert opened(root, tmp_path).package.path == "src/lab1"
    assert not [path for path in seen if "/d" in path.removeprefix(str(root))]


@pytest.fixture
def deep(tmp_path):
    """Folders in each other, more than Python's own functions can walk through or delete."""
    root = tmp_path / "deep"
    root.mkdir()
    here = os.open(root, os.O_RDONLY)
    for _ in range(1500):
        os.mkdir("d", dir_fd=here)
        below = os.open("d", os.O_RDONLY, dir_fd=here)
        os.close(here)
        here = below
    os.close(here)
    yield root
    subprocess.run(["rm", "-rf", str(root)], check=True)  # noqa: S607 - rm knows no limit


def test_a_very_deep_tree(deep, tmp_path):
    write(deep, tree("lab1"))
    assert opened(deep, tmp_path).package.path == "lab1"
    write(deep, {"package.xml": manifest("lab1")})
    with pytest.raises(SubmissionError, match="folders in each other"):
        opened(deep, tmp_path)


def test_an_empty_folder_and_one_that_cannot_be_read(tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    with pytest.raises(SubmissionError, match="is empty"):
        opened(tmp_path / "empty", tmp_path)
    root = write(tmp_path / "repo", tree("lab1", "closed"))
    scandir = os.scandir

    def refusing(path):
        if str(path).endswith("closed"):
            raise PermissionError(13, "Permission denied", os.fspath(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refusing)
    assert opened(root, tmp_path).package.path == "lab1"
    with pytest.raises(SubmissionError, match="Permission denied"):
        opened(root / "closed", tmp_path)


def test_the_work_folder_may_lie_in_the_submission(tmp_path):
    root = write(tmp_path / "repo", tree(".:lab1"))
    plain = opened(root, tmp_path)
    within = opened(root, root)
    assert within.digest == plain.digest
    assert set(within.package.executable) == set(plain.package.executable)


FILES = frozenset({"numeric_talker.py", "lab1.launch"})


@pytest.mark.parametrize(
    ("asked", "path"),
    [("lab_1", "a"), ("other", "z/src/other"), ("lab1", "lab1"), ("../..", "dots"), ("a b", "blank")],
)
def test_a_package_that_is_asked_for_is_taken_by_its_own_name(asked, path, tmp_path):
    files = tree("a:lab_1", "lab1", "other", "z/src/other", "dots:../..", "blank:a\nb")
    files["z/.catkin_workspace"] = ""
    submission = opened(
        write(tmp_path / "repo", files),
        tmp_path,
        package=WantedPackage(name="lab1", paths=FILES, asked=asked),
    )
    assert (submission.package.path, submission.package.name) == (path, asked)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("week1", ["lab1 is the name of src/lab1 too: first move src/lab1 out of this workspace"]),
        ("lab1", []),
        ("other", []),
    ],
)
def test_the_lab_s_name_is_told_where_a_package_beside_has_it(asked, told, tmp_path):
    files = tree("src/lab1", "src/week1:week1", "later/src/other")
    found = opened(write(tmp_path / "repo", files), tmp_path, package=WantedPackage(name="lab1", asked=asked))
    assert [hint for hint in found.hints if "is the name of" in hint] == told


def test_a_package_that_is_asked_for_and_is_not_there(tmp_path):
    repo = write(tmp_path / "repo", tree("a:lab_1", "lab1"))
    with pytest.raises(PackageNotFound, match=r"no package lab_2 .*: lab1, lab_1") as caught:
        opened(repo, tmp_path, package=WantedPackage(name="lab1", asked="lab_2"))
    assert caught.value.hint == "Give one of these names with --package, or leave it out."


def test_a_copy_behind_a_link_is_no_second_one(tmp_path):
    repo = write(tmp_path / "repo", tree("z/lab1"))
    (repo / "src").mkdir()
    (repo / "src/lab1").symlink_to("../z/lab1")
    (repo / "src/out").symlink_to("/")
    submission = opened(repo, tmp_path)
    assert (submission.package.path, submission.hints) == ("z/lab1", ())


def test_a_thousand_copies_are_chosen_from_in_no_time(tmp_path):
    copies = {f"c{i:04}/package.xml": manifest("lab1") for i in range(1000)}
    repo = write(tmp_path / "repo", {**copies, "c0030/src/numeric_talker.py": ""})
    begun = time.process_time()
    submission = opened(repo, tmp_path, package=WantedPackage(name="lab1", paths=FILES))
    assert submission.package.path == "c0030"
    assert len(submission.hints[0]) < 300
    assert time.process_time() - begun < 10
