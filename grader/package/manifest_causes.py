"""What catkin_pkg refuses, in plain words, and the line of `package.xml` that it is about."""

from __future__ import annotations

import re

from lxml import etree

from grader.package.xml import line_of

# catkin_pkg's message, the tag whose line is named, and the words ({0}, {1}: the pattern's groups)
_CAUSES = (
    (r'contain a single "package" root', "", "the file must hold one `<package> ... </package>`"),
    (r'exactly one "(\w+)" tag', "{0}", "there must be exactly one `<{0}>` tag"),
    (r'not contain more than one "(\w+)"', "{0}", "there may be only one `<{0}>` tag"),
    (r'"(\w+)" tag must have the attribute "(\w+)"', "{0}", '`<{0}>` needs {1}="..."'),
    (r'Invalid email ""', "maintainer", '`<maintainer>` needs email="name@place.org"'),
    (r'Invalid email "(.*?)"', "maintainer", "`{0}` is no e-mail address: write name@place.org"),
    (r"must have an email", "maintainer", '`<maintainer>` needs email="name@place.org"'),
    (r"name must not be empty", "name", "`<name>` is empty"),
    (r'Package name "(.*?)" does not follow naming', "name",
     "`{0}` is no package name: it takes letters, digits, `_` and `-`, no spaces, and begins with a letter"),
    (r"version must not be empty", "version", "`<version>` is empty: write 0.0.0"),
    (r'version "(.*?)" does not follow version', "version", "`{0}` is no version: write 0.0.0"),
    (r"description must not be empty", "description", "`<description>` is empty: write a sentence"),
    (r"at least one maintainer", "", '`<maintainer email="...">` is missing'),
    (r'at least one "license"', "", "`<license>` is missing"),
    (r"license tag must neither", "license", "`<license>` is empty"),
    (r"must not contain the following tags: (.*)", "{0}", "format {format} knows no `<{0}>`"),
    (r"must not contain the following children: (.*)", "",
     "there is a tag inside another where only text belongs (`<{0}>`): a closing tag is missing before it"),
    (r'"(\w+)" tag must not have the following attributes: (.*)', "{0}", "`<{0}>` takes no attribute `{1}`"),
    (r"replace <run_depend> tags with <exec_depend>", "run_depend",
     "in format 2 and 3 `<run_depend>` is written `<exec_depend>`"),
    (r"replace <exec_depend> tags with <run_depend>", "exec_depend",
     'in format 1 `<exec_depend>` is written `<run_depend>`; or begin with `<package format="2">`'),
    (r"generic dependency on '(.*?)' is redundant with: (.*)", "depend",
     "`<depend>{0}</depend>` says it all: delete `<{1}>{0}</{1}>`"),
    (r'test dependency on "(.*?)" is redundant', "test_depend", "delete `<test_depend>{0}</test_depend>`"),
    (r'must not "\w+" on a package with the same name', "", "the package depends on itself: delete the line"),
    (r"invalid literal for int|format version", "", 'the format must be 1, 2 or 3: `<package format="2">`'),
    (r"condition '(.*)' failed to parse", "", "the condition `{0}` cannot be read"),
    (r"Only one <build_type>", "export", "there may be only one `<build_type>`"),
)  # fmt: skip


def explain(message: str, root: etree._Element) -> tuple[int | None, str]:
    """The line and the causes, `; ` between them, of catkin_pkg's `message`; "" where it is not known."""
    known: dict[str, int | None] = {}
    for text in filter(None, (part.strip("- ") for part in message.split("\n"))):
        for pattern, tag, cause in _CAUSES:
            if found := re.search(pattern, text):
                groups = found.groups()
                said = cause.format(*groups, format=root.get("format", "1"))
                known.setdefault(said, _line_of(root, tag.format(*groups)))
                break
    line = next((number for number in known.values() if number is not None), line_of(root))
    return line, "; ".join(known)


def _line_of(root: etree._Element, tags: str) -> int | None:
    """The line of the last element with one of the tags: where a tag stands twice, the second is too much."""
    wanted = tags.split(", ")
    lines = [
        line_of(element)
        for element in root
        if isinstance(element.tag, str) and etree.QName(element).localname in wanted
    ]
    return lines[-1] if lines else None
