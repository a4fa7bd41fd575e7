"""A package that `find_package(…)` does not find: misspelt, of no ROS, not handed in, or not on this machine."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from grader.checks.support.cpp_errors import Explained
from grader.checks.support.scripts import cmake_calls
from grader.installable import ROS_2, exists_somewhere, install_hint, is_no_package, known_packages
from grader.model.package import MANIFEST, PackageFacts
from grader.wording import is_another_number, is_word_of, join_words

ALWAYS_THERE = ("catkin", "rospy", "roscpp", "std_msgs")
ONE_EDIT = 0.88
SLIPS_OF_COMPONENTS = ("COMPONENT", "COMPONENETS", "COMPONETS", "COMPONENTES", "Components", "components")
KEYWORDS = ("REQUIRED", "COMPONENTS")
_SIGNS = re.compile(r"[,:]|[;.]$")
"""What other languages write between names."""
PLACEHOLDER = "it is only a placeholder in the help text of catkin_create_pkg"
SLIP = 0.8
"""How alike a name is that is written for one that every machine has: `pospy` for `rospy`."""


def is_of_another_lab(name: str, package: PackageFacts) -> bool:
    """Return whether a package that the launch files name and nobody has is one of another lab, `lab1` for `lab2`: this
    one has none of the files that they find in it."""
    sources = [source for file in package.launch_files for source in file.includes]
    sources += [load.source or "" for file in package.launch_files for load in file.loads]
    inside = [source.partition(f"$(find {name})/")[2] for source in sources]
    return is_another_number(name, package.name) and not any(path and package.file(path) for path in inside)


def _misspelt_components(package: PackageFacts) -> dict[str, str]:
    """Return what find_package(…) reads as names and is none, with what is meant: with a sign behind it (`rospy,`), a
    slip of a package that every machine has, or a half of its name (`std msgs`)."""
    calls = [call.args for call in cmake_calls(package, "find_package")]
    named = [name for args in calls if args[:1] == ("catkin",) for name in args[1:]]
    whole_names = {half: whole for whole in ALWAYS_THERE for half in whole.split("_")}
    found: dict[str, str] = {}
    for name in dict.fromkeys((*(args[0] for args in calls if args), *named)):
        bare = " ".join(_SIGNS.sub(" ", name).split())
        whole = whole_names.get(name, "")
        near = get_close_matches(bare, ALWAYS_THERE, 1, SLIP) if bare not in known_packages() else []
        meant = bare if not near or " " in bare else near[0]
        meant = whole if is_word_of(name, whole, named) else meant
        if meant and meant != name and name not in (*KEYWORDS, *ALWAYS_THERE):
            found[name] = meant
    return found


def _explain_misspelt(slips: Mapping[str, str], package: PackageFacts) -> Explained:
    right = "; ".join(f"write {new} instead of {old}" for old, new in slips.items())
    declared = {one.name for one in package.manifest.dependencies} if package.manifest else set[str]()
    too = "; in package.xml too" if declared.intersection(slips) else ""
    signs = {sign[0] for old in slips for sign in _SIGNS.findall(old)}
    if all(_SIGNS.sub(" ", old).split() == new.split() for old, new in slips.items()):
        parts = [old.strip("".join(signs)) for old in slips]
        where = f"with a `{min(signs)}` behind {'it' if len(parts) == 1 else 'each'}"
        if any(" " in new for new in slips.values()):
            parts, where = [f"`{old}`" for old in slips], "as one word"
        return Explained(
            f"find_package(…) names {join_words(parts)} {where}; only spaces go between names", right + too
        )
    named = join_words(f"`{old}`" if signs else old for old in slips)
    what = "is no package of that name" if len(slips) == 1 else "are no packages of these names"
    return Explained(f"find_package(…) names {named}, and there {what}", right + too)


def _of_submission(name: str, packages: Sequence[PackageFacts]) -> Explained | None:
    """Explain a package that the lab asks for: it was not handed in, or another one that needs it does not declare it.
    catkin builds a package after those that it declares."""
    of_empty = f"/ is empty here, and {MANIFEST} names {name}:"
    empty = next((hint for hint in packages[0].hints if of_empty in hint), "")
    if empty and name not in known_packages():
        return Explained(f"it needs the package {name}, whose folder is empty here", empty.partition(": ")[2])
    mine = next((one for one in packages if one.name == name), None)
    others = [one.manifest.dependencies for one in packages if one.manifest and one is not mine]
    if mine and not mine.files:
        return Explained(f"it needs the package {name}, which is not here", f"hand in {name} too")
    if mine and any(all(needed.name != name for needed in declared) for declared in others):
        why = f"it needs the package {name}, and is built before it, since package.xml does not declare it"
        return Explained(why, f"add <depend>{name}</depend> to package.xml")
    return None


def missing_package(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    name = found[1]
    near = get_close_matches(name, (*ALWAYS_THERE, *known_packages()), 1, ONE_EDIT)
    if name in SLIPS_OF_COMPONENTS:
        why = f"find_package(…) reads {name} as the name of a package: the keyword is COMPONENTS"
        return Explained(why, f"write COMPONENTS instead of {name}")
    if slips := _misspelt_components(package):
        return _explain_misspelt(slips, package)
    if explained := _of_submission(name, (package, *package.also)) or _of_no_ros(name, package):
        return explained
    named = [one for c in cmake_calls(package, "find_package") for one in c.args]
    dummies = [one for one in named if re.fullmatch(r"dep(end)?\d", one)]
    own = {package.name, *(one.name for one in package.also)}
    if name in known_packages() or (not near and name not in dummies and exists_somewhere(name, own)):
        return Explained(
            f"it needs the package {name}, which this grading machine lacks",
            install_hint(name, lines),
            of_machine=True,
            lacks=name,
        )
    dropped = f"remove {join_words(dummies)}" if len(dummies) > 1 else "correct its name or remove it"
    meant = f"write {near[0]}" if near and name not in dummies else dropped
    hint = f"{meant} in find_package(…) and package.xml; a package of your own must be pushed with this one"
    why = f"find_package(…) names {name}, but there is no package of that name"
    return Explained(f"{why}: {PLACEHOLDER}" if name in dummies else why, hint)


def _of_no_ros(name: str, package: PackageFacts) -> Explained | None:
    """Explain a name of ROS 2's or of a Python module's; None for any other."""
    if name in ROS_2:
        return Explained(f"it needs {name}, which is from ROS 2", f"take {name} out: this lab is for ROS 1")
    if not is_no_package(name):
        return None
    where = "find_package(…) and package.xml" if is_declared(name, package) else "find_package(…)"
    why = f"find_package(…) names {name}, which is a Python module and no package of ROS"
    return Explained(why, f"take {name} out of {where}: a script imports it without that")


def is_declared(name: str, package: PackageFacts) -> bool:
    return package.manifest is not None and any(one.name == name for one in package.manifest.dependencies)
