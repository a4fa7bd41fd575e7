"""The pages of docs/reference/ that are made from the code: `make reference` writes them, a test compares them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from grader.evidence.writer import JSON_SCHEMAS, make_json_schemas
from grader.installable import DEFINITIONS
from scripts.reference.checks import checks_page
from scripts.reference.commands import commands_page, exit_codes_page
from scripts.reference.facts import facts_page
from scripts.reference.formats import format_pages
from scripts.reference.labs import labs_page
from scripts.reference.operators import operators_page
from scripts.reference.records import rubric_page

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference"
PAGES: dict[str, Callable[[], str]] = {
    "checks.md": checks_page,
    "commands.md": commands_page,
    "exit-codes.md": exit_codes_page,
    "facts.md": facts_page,
    "labs.md": labs_page,
    "mutation-operators.md": operators_page,
    "rubric.md": rubric_page,
}


def made() -> dict[str, str]:
    """Every file that is made, by its path below the folder of the reference."""
    data = {
        f"../../grader/evidence/{JSON_SCHEMAS}": make_json_schemas(),
        f"../../grader/{DEFINITIONS.name}": make_definitions(),
    }
    return {**{name: page() for name, page in PAGES.items()}, **format_pages(), **data}


def make_definitions() -> str:
    """Return the file of ROS Noetic's own message types and of tf's: the full definition and the MD5 sum of each."""
    store = get_typestore(Stores.ROS1_NOETIC)
    transforms = "geometry_msgs/TransformStamped[] transforms\n"
    store.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
    found = {
        name.replace("/msg/", "/"): store.generate_msgdef(name, ros_version=1)
        for name in sorted(store.fielddefs)
    }
    rows = [f"{json.dumps(name)}: {json.dumps(about)}" for name, about in found.items()]
    return "{\n" + ",\n".join(rows) + "\n}\n"
