"""What `package.xml` lacks without which nothing builds, or which the lab asks for."""

from __future__ import annotations

import re

from grader.installable import known_packages, noetic_messages
from grader.model.package import MANIFEST, PackageFacts
from grader.model.repair import Repair
from grader.package.manifest import parse_manifest, required_tags
from grader.package.repairs.editing import UTF16, Files, as_text, keep_first_version, read_data, repair_xml
from grader.package.repairs.files import to_utf8
from grader.package.repairs.names import Wanted, is_near
from grader.package.xml import parse_xml
from grader.wording import is_one_edit, is_word_of, the_same_on

FORMAT_1 = r"<package(\s+format\s*=\s*[\"']1[\"'])?\s*>"
VALUES = (
    (r"(<package)(?:\s+format\s*=\s*[\"']1[\"'])?(?=>(?:.|\n)*<(?:exec_depend|build_export_depend|depend)>)",
     r'\1 format="2"', 'the tags below belong to `format="2"`'),
    (r"(<package\s+format\s*=\s*[\"'])(?![123][\"'])[^\"']*", r"\g<1>2", "there is no such format"),
    (r"(<version>)(?!\s*\d+\.\d+\.\d+\s*<)[^<]*(?=<)", r"\g<1>0.0.0", "this is not a version"),
    (r"(<maintainer\b[^>]*email=[\"'])(?![^\"'@]+@[\w-]+(?:\.[\w-]+)+[\"'])[^\"']*", r"\1you@example.org",
     "this is not an e-mail address"),
    (r"(?<=>)(\s*<(name|version|description)>[^<]*</\2>)(?=\1)", "", "the same tag is there twice"),
)  # fmt: skip
"""What a tag of a manifest says that catkin refuses, what is written for it, and the reason."""
RUN_NEEDS = re.compile(r"<(?:depend|run_depend|exec_depend|build_export_depend)\b[^<>]*>\s*([\w-]+)\s*<")
ALL_NEEDS = re.compile(r"<(build_depend|depend|run_depend|exec_depend)\b[^<>]*>\s*([\w-]+)\s*<")


SLIPS_MAX = 20
"""Of one dependency's name: more are not a student's."""
OF_ROS = {"rospy", "roscpp", "catkin", "message_generation", "message_runtime", "tf", "tf2"}
"""Packages that every ROS has, besides those with messages."""


def repair_manifest(files: Files, package: PackageFacts, wanted: Wanted) -> str:
    """Find what the manifest lacks, and return the name that the package has in the end."""
    data = read_data(files.folder, MANIFEST) or b""
    if data.startswith(UTF16):
        files.put(MANIFEST, as_text(to_utf8(data)))
        first = (files.text(MANIFEST) or "").split("\n", 1)[0]
        message, fix = f"{MANIFEST} is saved as UTF-16", f"save {MANIFEST} as UTF-8 in your editor"
        place = {"file": MANIFEST, "line": 1, "before": first, "after": first}
        files.add(Repair(kind="manifest-line", **place, message=message, fix=fix))
    text = files.text(MANIFEST)
    if text is None:
        return package.name
    keep_first_version(files, MANIFEST, "manifest-line")
    repair_xml(files, MANIFEST, "package", "manifest-line")
    _correct_values(files)
    _rename_dependencies(files)
    _add_required(files, package.name)
    _add_buildtool(files)
    for name in wanted.dependencies:
        _add_dependency(files, name)
    manifest, _ = parse_manifest((files.text(MANIFEST) or "").encode())
    return manifest.name if manifest is not None else package.name


def _parses(text: str) -> bool:
    return parse_xml(text.encode(), MANIFEST, root="package")[0] is not None


def _correct_values(files: Files) -> None:
    """Correct what catkin refuses: a format, a version, an address, a tag that is there twice."""
    for pattern, new, message in VALUES:
        text = files.text(MANIFEST) or ""
        plain = _blank_comments(text)
        found = re.search(pattern, plain) if _parses(text) else None
        if found:
            changed = text[: found.start()] + found.expand(new) + text[found.end() :]
            line = text.count("\n", 0, found.end() - len(found[0].lstrip())) + 1
            fix = "" if new else f"delete line {line}"
            files.change("manifest-line", MANIFEST, changed, f"line {line} of {MANIFEST}: {message}", fix)


def _rename_dependencies(files: Files) -> None:
    """Write `exec_depend` for `run_depend`, which only format 1 has."""
    text = files.text(MANIFEST) or ""
    found = list(re.finditer(r"(?<=<)(/?)run_depend(?=[\s>])", _blank_comments(text)))
    if not found or not _parses(text) or re.search(FORMAT_1, text):
        return
    changed = text
    for one in reversed(found):
        changed = f"{changed[: one.start()]}{one[1]}exec_depend{changed[one.end() :]}"
    first, *more = sorted({text.count("\n", 0, one.start()) + 1 for one in found})
    message = f"line {first} of {MANIFEST}: only format 1 has <run_depend>"
    fix = f"write exec_depend instead of run_depend{the_same_on(more)}"
    files.change("manifest-line", MANIFEST, changed, message, fix)


def _blank_comments(text: str) -> str:
    """Return the text with blanks in place of its comments and CDATA, so that all else stays where it is."""
    return re.sub(
        r"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)",
        lambda found: re.sub(r"[^\n]", " ", found[0]),
        text,
        flags=re.DOTALL,
    )


def _add_required(files: Files, name: str) -> None:
    """Add the tags without which catkin refuses a manifest."""
    for tag, line in required_tags(name).items():
        text = files.text(MANIFEST) or ""
        if _parses(text) and not re.search(rf"<{tag}\b", _blank_comments(text)):
            _insert(files, line, f"{MANIFEST} has no <{tag}>")


def _add_buildtool(files: Files) -> None:
    text = files.text(MANIFEST) or ""
    plain = _blank_comments(text)
    if re.search(r"<buildtool_depend[^>]*>\s*catkin\s*<|<build_type>\s*ament", plain) or not _parses(text):
        return
    message = f"{MANIFEST} does not name catkin as its build tool"
    named = re.finditer(r"<buildtool_depend>([\w-]+)<", plain)
    given = next((found for found in named if is_near(found[1], "catkin")), None)
    if given is not None:
        changed = f"{text[: given.start(1)]}catkin{text[given.end(1) :]}"
        files.change("manifest-line", MANIFEST, changed, f"{message}: it names {given[1]}")
    else:
        _insert(files, "<buildtool_depend>catkin</buildtool_depend>", message)


def _spell_dependency(files: Files, name: str) -> None:
    """Write the name of a package in place of slips of it, which no package has, and of its words one by one."""
    text = files.text(MANIFEST) or ""
    tags = re.compile(r"<(\w*depend)\b[^<>]*>\s*([\w-]+)\s*</\1>")
    given = {found[2] for found in tags.finditer(_blank_comments(text))} if _parses(text) else set[str]()
    near = {one for one in given if one.lower() == name or is_word_of(one, name, given)}
    near |= {one for one in given if is_one_edit(one, name) and not _is_version(one, name)}
    slips = near - {name, *known_packages(), *noetic_messages(), *OF_ROS}
    for _ in range(SLIPS_MAX):  # each change reads the file again
        found = next((one for one in tags.finditer(_blank_comments(text)) if one[2] in slips), None)
        if found is None:
            return
        line = text.count("\n", 0, found.start(2)) + 1
        message, fix = f"line {line} of {MANIFEST}: there is no package {found[2]}", ""
        begin, end, new = (*found.span(2), name)
        there = {one[1] for one in tags.finditer(_blank_comments(text)) if one[2] == name}
        if "depend" in there or (there and found[1] == "depend"):
            # catkin refuses a <depend> beside another tag for the same package
            begin, end, new = (*found.span(), "")
            fix = f"delete <{found[1]}>{found[2]}</{found[1]}> on line {line}"
        text = f"{text[:begin]}{new}{text[end:]}"
        files.change("manifest-line", MANIFEST, text, message, fix)


def _is_version(one: str, other: str) -> bool:
    """Return whether only a number tells them apart: `openni2_camera` is another package than `openni_camera`."""
    return re.sub(r"\d", "", one) == re.sub(r"\d", "", other)


def _add_dependency(files: Files, name: str) -> None:
    _spell_dependency(files, name)
    text = files.text(MANIFEST) or ""
    given = {match[2] for match in ALL_NEEDS.finditer(_blank_comments(text))}
    if name in given or not _parses(text):
        return
    old = re.search(FORMAT_1, text) is not None
    lines = [f"<build_depend>{name}</build_depend>", f"<run_depend>{name}</run_depend>"]
    message = f"{MANIFEST} does not name {name}, which the lab needs"
    _insert(files, "\n".join(lines) if old else f"<depend>{name}</depend>", message)


def declare_for_running(files: Files, name: str, message: str) -> None:
    """Declare a package that is needed at run time, unless the manifest does."""
    _spell_dependency(files, name)
    text = _blank_comments(files.text(MANIFEST) or "")
    if name not in RUN_NEEDS.findall(text):
        tag = "run_depend" if re.search(FORMAT_1, text) else "exec_depend"
        _insert(files, f"<{tag}>{name}</{tag}>", message)


def _insert(files: Files, tags: str, message: str) -> None:
    """Put the tags below the last dependency, or the licence, or before the end, where the file still parses."""
    text = files.text(MANIFEST) or ""
    lines = text.split("\n")
    after = [i for i, line in enumerate(lines) if re.search(r"</(\w*depend|license)>\s*$", line)]
    end = next((i for i, line in reversed(list(enumerate(lines))) if "</package>" in line), len(lines))
    for at in (*[i + 1 for i in reversed(after)], end):
        around = lines[at - 1] if at else ""
        indentation = around[: len(around) - len(around.lstrip())] if at in [i + 1 for i in after] else "  "
        changed = "\n".join([*lines[:at], *(f"{indentation}{tag}" for tag in tags.split("\n")), *lines[at:]])
        plain = _blank_comments(changed)
        if _parses(changed) and plain != _blank_comments(text) and tags.split("\n", 1)[0] in plain:
            files.change("manifest-line", MANIFEST, changed, message)
            return
