from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.package.manifest import parse_manifest, read_manifest
from tests.package.trees import MANIFEST


def changed(old: str, new: str) -> bytes:
    assert old in MANIFEST
    return MANIFEST.replace(old, new).encode()


def test_says_what_and_where():
    manifest, fault = parse_manifest(MANIFEST.encode())
    assert fault is None
    assert (manifest.name, manifest.name_line, manifest.format, manifest.build_type) == (
        "lab1",
        3,
        2,
        "catkin",
    )
    assert [(d.kind, d.name, d.line) for d in manifest.dependencies] == [
        ("buildtool_depend", "catkin", 8),
        ("depend", "rospy", 9),
    ]
    assert manifest.maintainers[0].email == "ada@example.org"
    assert manifest.advice == ()


@pytest.mark.parametrize(
    ("old", "new", "advice"),
    [
        ("<license>MIT<", "<license>TODO<", "licence still says TODO"),
        ("ada@example.org", "root@todo.todo", "root@todo.todo"),
        ("<name>lab1<", "<name>Lab1<", "naming conventions"),
        ("<version>0.0.0<", "<version>0.01.0<", "leading zeros"),
        ("  <buildtool_depend>catkin</buildtool_depend>\n", "", "buildtool_depend"),
    ],
)
def test_what_catkin_warns_of_is_advice(old, new, advice, capfd):
    manifest, fault = parse_manifest(changed(old, new))
    assert fault is None
    assert any(advice in line for line in manifest.advice)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("old", "new", "line", "cause"),
    [
        ("  <name>lab1</name>\n", "", 2, "`<name>` is missing"),
        ("<name>lab1<", "<name>my lab<", 3, "`my lab` is not a package name"),
        ("<name>lab1<", "<name><", 3, "`<name>` is empty"),
        ("0.0.0", "1.0", 4, "`1.0` is not a version"),
        ("The lab1 package", "", 5, "`<description>` is empty"),
        ("ada@example.org", "ada", 6, "`ada` is not an e-mail address"),
        ('"ada@example.org"', '""', 6, '`<maintainer>` needs email="name@place.org"'),
        (' email="ada@example.org"', "", 6, '`<maintainer>` needs email="...": write email="..." in the tag'),
        (' format="2"', "", 9, '`<depend>`: begin the file with `<package format="2">`'),
        (
            '<package format="2">',
            '<package format="1">',
            9,
            '`<depend>`: begin the file with `<package format="2">`',
        ),
        ("<license>", '<license a="b">', 7, "takes no attribute `a`: delete `a` with its value"),
        ("<license>MIT</license>", "", 2, "`<license>` is missing"),
        ("<depend>rospy</depend>", "<run_depend>rospy</run_depend>", 9, "`<exec_depend>`"),
        ("<depend>rospy</depend>", "<depend>lab1</depend>", 2, "depends on itself"),
        ("<depend>rospy</depend>", "<build_depend>x</build_depend><depend>x</depend>", 9, "says it all"),
        ('format="2"', 'format="two"', 2, "format must be 1, 2 or 3"),
        ('format="2"', 'format="9"', 2, "format must be 1, 2 or 3"),
        ("<depend>rospy</depend>", "<depend>rospy", 9, "`<depend>` on line 9 is still open"),
        ("</package>", "", 2, "`<package>` on line 2 is never closed"),
        ("<?xml", "\n<?xml", 2, "comes before `<?xml ... ?>`: delete it"),
        ("<depend>rospy</depend>", "<<<<<<< HEAD", 9, ""),
        ("<package format", "<Package format", 2, "`<Package>`: it is called `<package>`"),
    ],
)
def test_what_catkin_refuses_is_a_fault(old, new, line, cause):
    manifest, fault = parse_manifest(changed(old, new))
    assert manifest is None
    assert (fault.file, fault.line) == ("package.xml", line)
    assert cause in fault.explanation


@pytest.mark.parametrize(
    ("data", "kind", "cause"),
    [
        (b"", "XMLSyntaxError", "empty"),
        (b" \n", "XMLSyntaxError", "empty"),
        (MANIFEST.replace("Ada", "Adél").encode("latin-1"), "UnicodeDecodeError", "not saved as UTF-8"),
        (MANIFEST.encode("utf-16"), "UnicodeDecodeError", "UTF-16"),
        (b"<launch/>", "InvalidPackage", "<package>"),
        (b"\0" * 20, "XMLSyntaxError", ""),
        (b"<package>" + b"x" * 5_000_000, "XMLSyntaxError", "never closed"),
    ],
)
def test_what_is_no_manifest_at_all(data, kind, cause):
    manifest, fault = parse_manifest(data)
    assert manifest is None
    assert fault.kind == kind
    assert cause in fault.explanation


def test_declared_encoding_does_not_matter_as_catkin_reads_utf8():
    text = MANIFEST.replace('version="1.0"', 'version="1.0" encoding="ISO-8859-1"').replace("Ada", "Adél")
    manifest, _ = parse_manifest(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert manifest.maintainers[0].name == "Adél"


@pytest.mark.parametrize(
    ("declaration", "is_read"),
    [
        ('<?xml version="0.1"?>', True),
        ("<?xml version = '2.0' ?>", True),
        ('<?xml version=""?>', True),
        ('<?xml version="1,0"?>', False),
        ("<?xml version=1.0?>", False),
        ('<?xml vesion="1.0"?>', False),
    ],
)
def test_the_version_of_xml_does_not_matter_as_catkin_reads_any(declaration, is_read):
    text = MANIFEST.replace('<?xml version="1.0"?>', declaration)
    assert declaration in text
    assert (parse_manifest(text.encode())[1] is None) == is_read


def test_format_1_and_conditions_of_format_3():
    one = MANIFEST.replace(' format="2"', "").replace(
        "<depend>rospy</depend>", "<run_depend>rospy</run_depend>"
    )
    manifest, fault = parse_manifest(one.encode())
    assert fault is None
    assert (manifest.format, manifest.dependencies[-1].kind) == (1, "run_depend")
    three = MANIFEST.replace('format="2"', 'format="3"').replace(
        "<depend>rospy</depend>",
        '<depend condition="$ROS_VERSION == 1">rospy</depend>\n'
        '<depend condition="$ROS_VERSION == 2">rclpy</depend>',
    )
    manifest, _ = parse_manifest(three.encode())
    assert [d.name for d in manifest.dependencies] == ["catkin", "rospy"]
    manifest, fault = parse_manifest(three.replace("$ROS_VERSION == 1", "= =").encode())
    assert manifest is None
    assert "condition" in fault.explanation


def test_two_faults_are_both_named():
    _, fault = parse_manifest(changed("0.0.0", "1").replace(b"The lab1 package", b""))
    assert "version" in fault.explanation
    assert "description" in fault.explanation


@pytest.mark.parametrize("where", ["<description>&x;</description>", '<description a="&x;">d</description>'])
def test_entities_are_neither_expanded_nor_read(where):
    doctype = '<!DOCTYPE package [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    body = MANIFEST.split("\n", 1)[1].replace("<description>The lab1 package</description>", where)
    manifest, fault = parse_manifest((doctype + body).encode())
    assert manifest is None
    assert "root:" not in fault.model_dump_json()


def test_billion_laughs_end_at_once():
    entities = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))
    text = f'<!DOCTYPE package [<!ENTITY a0 "lol">{entities}]><package><name>&a11;</name></package>'
    begin = time.process_time()
    manifest, fault = parse_manifest(text.encode())
    assert manifest is None
    assert fault is not None
    assert time.process_time() - begin < 2


def test_a_doctype_without_entities_is_harmless():
    manifest, _ = parse_manifest(
        changed("<package", '<!DOCTYPE package SYSTEM "http://example.org/x.dtd">\n<package')
    )
    assert manifest.name == "lab1"


def test_comments_and_processing_instructions_are_harmless():
    data = changed("<name>", "<!-- a comment --><?an instruction?>\n<name>")
    manifest, fault = parse_manifest(data)
    assert fault is None
    assert manifest is not None


def test_missing_and_misnamed_files_and_links(tmp_path):
    assert read_manifest(tmp_path)[1].kind == "Missing"
    (tmp_path / "Package.xml").write_text(MANIFEST)
    assert "`Package.xml`" in read_manifest(tmp_path)[1].cause
    (tmp_path / "package.xml").symlink_to("/etc/passwd")
    assert read_manifest(tmp_path)[1].kind == "OutsideLink"
    (tmp_path / "package.xml").unlink()
    (tmp_path / "package.xml").symlink_to("package.xml")
    assert read_manifest(tmp_path)[1].kind == "LinkLoop"
    (tmp_path / "package.xml").unlink()
    (tmp_path / "package.xml").write_bytes(b" " * 1_000_001)
    assert read_manifest(tmp_path)[1].kind == "TooLarge"
    (tmp_path / "package.xml").unlink()
    (tmp_path / "package.xml").mkdir()
    assert read_manifest(tmp_path)[1].kind == "NotAFile"


@settings(derandomize=True)
@given(st.binary(max_size=200), st.integers(0, len(MANIFEST)))
def test_never_raises(noise, at):
    text = MANIFEST.encode()
    for data in (noise, text[:at] + noise + text[at:], text[:at]):
        manifest, fault = parse_manifest(data)
        assert (manifest is None) != (fault is None)


def test_a_manifest_of_format_1_with_tags_of_format_2_is_told_its_format() -> None:
    tags = ("<depend>rospy</depend>", "<exec_depend>rospy</exec_depend>")
    _, fault = parse_manifest(changed(*tags).replace(b'format="2"', b'format="1"'))
    assert fault is not None
    assert fault.fix == 'begin the file with `<package format="2">`'
