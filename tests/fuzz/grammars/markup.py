"""XML: manifests and launch files, sound ones and such as no editor would write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars.common import ODD, encoded, joined, words

RAW = (
    "<!-- a -->", "<!-- a -- b -->", "<![CDATA[x]]>", "<?pi x?>", "&lt;", "&x;", "&#0;", "&#x10FFFF;", "<", ">", "&",
    "<a", "</a>", '<!DOCTYPE a [<!ENTITY x "y">]>', "<ns:b/>", '<b xmlns="urn:x"/>', "\n", "\0", "\x0c",
)  # fmt: skip
HEADS = (
    "", "", "", '<?xml version="1.0"?>\n', '<?xml version="1.0" encoding="latin-1"?>', "\n\n", "\ufeff",
    '<!DOCTYPE launch [<!ENTITY a "&b;"><!ENTITY b "&a;">]>', '<?xml version="1.1" encoding="nonsense"?>',
)  # fmt: skip

PACKAGE_TAGS = (
    "name", "version", "description", "maintainer", "license", "author", "url", "depend", "build_depend", "run_depend",
    "exec_depend", "buildtool_depend", "test_depend", "build_export_depend", "doc_depend", "group_depend",
    "member_of_group", "conflict", "replace", "export", "build_type", "metapackage", "architecture_independent",
)  # fmt: skip
PACKAGE_ATTRIBUTES = {
    "format": ("1", "2", "3", "4", "", "2.5"),
    "email": ("a@b.org", "a", "x@todo.todo"),
    "condition": (
        "$ROS_VERSION == 1", "$ROS_VERSION == 2", "1 == ", "(((1 == 1)))", "$X and ($Y or 1 < 2)", "a b c", "((((((",
    ),
    "type": ("website", "x"),
    "version_gte": ("1.0.0", "x"),
    "version_lt": ("0", ""),
    "compatibility": ("1.0",),
    "file": ("LICENSE",),
}  # fmt: skip
NEEDED = (
    "<name>lab1</name><version>0.1.0</version><description>d</description>"
    '<maintainer email="a@b.org">A</maintainer><license>BSD</license>'
)
PACKAGE_TEXTS = (
    "lab1",
    "rospy",
    "std_msgs",
    "catkin",
    "0.1.0",
    "1.2.3.4",
    "TODO",
    "BSD",
    "A text",
    "ament_cmake",
)

LAUNCH_TAGS = (
    "node", "node", "group", "include", "arg", "param", "rosparam", "remap", "env", "machine", "test", "launch", "Node"
)  # fmt: skip
LAUNCH_VALUES = (
    "lab1", "talker.py", "talker", "$(arg a)", "$(arg a)$(arg a)", "$(eval 1)", "$(find lab1)/launch/b.launch",
    "$(find lab1)/launch/a.launch", "$(dirname)/b.launch", "$(optenv X y z)", "$(anon x)", "/", "//a//b", "~x", "true",
    "false", "1", "0", "True", "$(arg missing)", "../../x", "screen", "log", "a b", "$(", "$()",
)  # fmt: skip
LAUNCH_ATTRIBUTES = dict.fromkeys(
    (
        "pkg", "type", "name", "ns", "output", "args", "if", "unless", "file", "value", "default", "from", "to",
        "param", "command", "textfile", "pass_all_args", "respawn", "required", "launch-prefix", "machine",
        "clear_params",
    ),
    LAUNCH_VALUES,
)  # fmt: skip


def element(
    tags: Sequence[str], attributes: Mapping[str, Sequence[str]], texts: Sequence[str]
) -> SearchStrategy[str]:
    """An element with whatever fits below it, well-formed or nearly."""
    written = [f'{name}="{value}"' for name, values in attributes.items() for value in (*values, *ODD)]
    given = joined(st.sampled_from(written), " ", most=4)
    leaf = st.one_of(words(*texts), st.sampled_from(RAW))

    def around(inner: SearchStrategy[str]) -> SearchStrategy[str]:
        return st.builds(_tag, st.sampled_from(tags), given, joined(inner, "\n", most=6), st.integers(0, 30))

    return st.recursive(around(leaf), around, max_leaves=8)


def _tag(tag: str, attributes: str, inner: str, fault: int) -> str:
    end = {0: "", 1: f"</{tag.upper()}>", 2: "/>"}.get(fault, f"</{tag}>")
    return f"<{tag} {attributes}>{inner}{end}"


def _document(root: str, attributes: SearchStrategy[str], inner: SearchStrategy[str]) -> SearchStrategy[str]:
    return st.builds(
        lambda head, given, text, tail: f"{head}<{root}{given}>\n{text}\n</{root}>{tail}",
        st.sampled_from(HEADS),
        attributes,
        inner,
        st.sampled_from(("", "", "", "\n", "<a/>", "x", "\0")),
    )


def manifest() -> SearchStrategy[bytes]:
    inner = element(PACKAGE_TAGS, PACKAGE_ATTRIBUTES, PACKAGE_TEXTS)
    needed = st.sampled_from((NEEDED, ""))
    text = st.builds("\n".join, st.tuples(needed, joined(inner, "\n")))
    formats = st.sampled_from(PACKAGE_ATTRIBUTES["format"]).map(lambda value: f' format="{value}"')
    return encoded(_document("package", formats, text))


def _launch() -> SearchStrategy[str]:
    inner = element(LAUNCH_TAGS, LAUNCH_ATTRIBUTES, LAUNCH_VALUES)
    return _document("launch", st.just(""), joined(inner, "\n"))


def launch() -> SearchStrategy[bytes]:
    return encoded(_launch())


def launch_files() -> SearchStrategy[bytes]:
    return encoded(st.builds("{}\n%%% launch/b.launch\n{}".format, _launch(), _launch()))
