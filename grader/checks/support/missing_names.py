"""Names that are not there (modules, classes, types, attributes, arguments), and what is meant by them."""

from __future__ import annotations

import ast
import posixpath
import re
import sys
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.support.console_output import Traceback
from grader.checks.support.exceptions import SLIPS
from grader.checks.support.rospy_calls import fields_of
from grader.checks.support.scripts import (
    BUILD_FIRST_HINT,
    OF_FILES,
    cmake_calls,
    is_product,
    path_in_package,
)
from grader.checks.support.text import near_names, shown
from grader.installable import (
    MODULE_OF,
    PYTHON_2,
    ROS_2,
    TUTORIALS,
    WINDOWS,
    known_packages,
    nearest_module,
    noetic_messages,
)
from grader.line_slips.python import parsed
from grader.model.package import CMAKE, Interface, PackageFacts
from grader.model.python_slip import PythonSlip
from grader.wording import closest, join_words, rename_hiding

SETUP_PAGE = "http://docs.ros.org/en/noetic/api/catkin/html/howto/format2/installing_python.html"
IMPORT_ERRORS = ("ImportError", "ModuleNotFoundError")
ATTRIBUTES_SHOWN = 8
_NO_ATTRIBUTE = re.compile(r"(?:module|type object)? ?'([\w.]+)'(?: object)? has no attribute '(\w+)'")
_NO_TYPE = re.compile(r"cannot import name '(\w+)' from '(\w+)\.msg'")
_FROM_PACKAGE = re.compile(r"cannot import name '(\w+)' from '(\w+)'")
_IN_MODULE = re.compile(r"No module named '(\w+\.(?:msg|srv))\.(\w+)'")
_KEYWORD = re.compile(r"got an unexpected keyword argument '(\w+)'")
NO_MODULE = re.compile(r"No module named '(\w+)'$")
_OF_MESSAGES = re.compile(r"No module named '(\w+)\.(\w+)'(?:$|; '\1' is not a package)")
_HIDDEN = re.compile(
    r"(?:No module named|partially initialized module|^module|cannot import name '\w+' from)"
    r" '(\w+)(?:\.(?!py')[\w.]+)?'"
)
KEYWORDS = (
    "anonymous", "log_level", "disable_signals", "argv", "queue_size", "latch", "tcp_nodelay", "headers", "callback",
    "callback_args", "buff_size", "subscriber_listener", "data_class", "oneshot", "timeout", "default",
)  # fmt: skip
"""Arguments of rospy's functions that are given by their names, those of `init_node` first."""
ATTRIBUTES = {
    "rospy": (
        *("init_node", "Publisher", "Subscriber", "Service", "ServiceProxy", "Rate", "Timer", "Time", "Duration"),
        *("sleep", "spin", "is_shutdown", "on_shutdown", "signal_shutdown", "loginfo", "logwarn", "logerr", "logdebug"),
        *("logfatal", "get_param", "set_param", "has_param", "delete_param", "search_param", "get_time", "get_rostime"),
        *("get_name", "wait_for_message", "wait_for_service", "get_namespace", "get_published_topics", "myargv"),
        *("ROSException", "ROSInterruptException", "ROSInitException", "ServiceException"),
    ),
    "Publisher": ("publish", "unregister", "get_num_connections"),
    "Subscriber": ("unregister", "get_num_connections"),
    "Rate": ("sleep", "remaining"),
    "Time": ("now", "to_sec", "to_nsec", "secs", "nsecs", "is_zero"),
    "Duration": ("to_sec", "to_nsec", "secs", "nsecs"),
    "ServiceProxy": ("wait_for_service", "close"),
}  # fmt: skip
"""What a lab's scripts use of rospy (http://docs.ros.org/en/noetic/api/rospy/html/)."""


_ARG = r"\s*([^,()]+)"
CALLS_OF_ROS_2 = {
    "create_publisher": (rf"{_ARG},{_ARG},{_ARG}\)", r"rospy.Publisher(\2, \1, queue_size=\3)"),
    "create_subscription": (rf"{_ARG},{_ARG},{_ARG},{_ARG}\)", r"rospy.Subscriber(\2, \1, \3)"),
    "create_timer": (rf"{_ARG},{_ARG}\)", r"rospy.Timer(rospy.Duration(\1), \2)"),
    "create_service": (rf"{_ARG},{_ARG},{_ARG}\)", r"rospy.Service(\2, \1, \3)"),
    "create_client": (rf"{_ARG},{_ARG}\)", r"rospy.ServiceProxy(\2, \1)"),
    "create_rate": (rf"{_ARG}\)", r"rospy.Rate(\1)"),
    "get_logger": (r"\)\.info\(([^()]+)\)", r"rospy.loginfo(\1)"),
}
"""Methods of a node of ROS 2: their arguments, and the call of rospy's with them."""


def other_name(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """A message type, a module, an attribute or an argument that there is none of, and what is meant."""
    if meant := own_message(found, package):
        return meant
    if wrong := _NO_TYPE.match(found.message):
        return _other_types(wrong[1], wrong[2])
    if wrong := _NO_ATTRIBUTE.search(found.message):
        source = found.innermost.source
        of_line = ((s.message, s.fix) for s in package.slips if s.name == f"{wrong[1]}.{wrong[2]}")
        meant = next(of_line, None) or _call_of_ros_2(wrong[2], source) or _field_of_number(found, wrong[1])
        return meant or _other_attributes(package, wrong[1], wrong[2], source)
    if wrong := re.match(r"(\w+) is not an attribute of (\w+)$", found.message):
        known = fields_of(package, wrong[2])
        source = found.innermost.source
        left = [one for one in known if not re.search(rf"\b{one}=", source)]
        near = near_names(wrong[1], known) or (left if len(left) == 1 else ())
        hint = f"write `{near[0]}=` instead of `{wrong[1]}=`" if near else ""
        said = f"{wrong[2]} has {join_words(known[:ATTRIBUTES_SHOWN])}" if known else ""
        return said, hint or f"leave out `{wrong[1]}=`, or write the field that you mean"
    if wrong := _KEYWORD.search(found.message):
        return _other_argument(wrong[1], of_node="init_node" in found.message)
    is_import = found.kind in IMPORT_ERRORS
    finders = (_own_module, _class_of_module, _other_module) if is_import else ()
    return next(filter(None, (find(found, package) for find in finders)), None)


def _call_of_ros_2(name: str, source: str) -> tuple[str, str] | None:
    if name not in CALLS_OF_ROS_2:
        return None
    arguments, new = CALLS_OF_ROS_2[name]
    call = re.search(rf"[\w.]+\.{name}\({arguments}", source)
    written = call.expand(new) if call else re.sub(r"\\\d", "…", new)
    return f"`{name}` is from ROS 2", f"write `{written}` in place of that call"


def _other_argument(name: str, *, of_node: bool) -> tuple[str, str]:
    if near := near_names(name, KEYWORDS):
        return f"it is called {near[0]}", f"write {near[0]}= instead of {name}="
    moved = f"move `{name}=` from there into the brackets of `rospy.init_node(…)`"
    is_misplaced = name in KEYWORDS[:4] and not of_node
    return "it takes no such argument", moved if is_misplaced else f"leave out `{name}=`"


def hiding_file(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint where a file beside the script has the name of the module that is imported."""
    wanted = _HIDDEN.search(found.message)
    script = path_in_package(package, found.own_frames[0].file) if found.own_frames else None
    if wanted is None or script is None:
        return None
    name = wanted[1]
    path = PurePosixPath(script).with_name(f"{name}.py")
    known = {package.name, "rospy", *noetic_messages(), *known_packages(), *sys.stdlib_module_names}
    if package.file(str(path)) is None or name not in known:
        return None
    what = f"the package {name}" if name in {package.name, *noetic_messages()} else f"the module {name}"
    cause = f"Python finds {path} where {what} is meant, because it looks beside the script first"
    return cause, rename_hiding(str(path))


def own_message(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return why the import of a traceback fails where `right_import` knows a better one, and that."""
    return right_import(found.innermost.source, package) if found.kind in IMPORT_ERRORS else None


def right_import(source: str, package: PackageFacts) -> tuple[str, str] | None:
    """Return the import as it has to be where the line looks for what the build makes of the package's own messages,
    services and actions in another place, or by another name."""
    asked = _imported_names(source)
    if asked is None:
        return None
    module, names = asked
    there = noetic_messages().get(module.removesuffix(".msg"), {})
    places = [
        (name, f"{one.name}.{own.module}")
        for one in (*package.also, package)
        for own in one.interfaces
        for name in own.classes
        if name not in there
    ]
    made = dict(sorted(places, key=lambda one: one[1] == module))  # two packages may have one of that name
    near_by = module.partition(".")[0] in {package.name, *(one.name for one in package.also)}
    meant = {name: _class_of(name, made, near=near_by) for name in names}
    aliases = dict(re.findall(r"\b(\w+)( as \w+)", source))
    lines: dict[str, list[str]] = {}
    for name in names:
        lines.setdefault(made.get(meant[name], module), []).append(f"{meant[name]}{aliases.get(name, '')}")
    right = [f"from {place} import {', '.join(several)}" for place, several in lines.items()]
    own = [meant[name] for name in names if meant[name] in made]
    is_right = all(meant[name] == name and made.get(name, module) == module for name in names)
    if not own or is_right:
        return None
    cause = f"the build makes {join_words(own)}, in {made[own[0]]}"
    return cause, f"write {join_words(f'`{line}`' for line in right)}"


def _imported_names(source: str) -> tuple[str, tuple[str, ...]] | None:
    """Return the module and the names of a line that imports, None of any other: `import a.b` is `b` of `a`."""
    # A hostile line may be nested too deeply for the parser.
    with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        for node in parsed(source).body[:1]:
            if isinstance(node, ast.ImportFrom) and node.module:
                return node.module, tuple(alias.name for alias in node.names)
            if isinstance(node, ast.Import) and "." in node.names[0].name:
                module, _, name = node.names[0].name.rpartition(".")
                return module, (name,)
    return None


def _class_of(name: str, made: Collection[str], *, near: bool) -> str:
    """Return the class that is meant by a name; the name itself where none is."""
    if name in made or not near:
        return name
    of_action = f"{name}Action"
    return of_action if of_action in made else next(iter(near_names(name, made)), name)


def unmade(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint of an import of what the build makes, and has not made; None of any other."""
    makers = (one for one in (package, *package.also) if _makes(one, found.message))
    maker = None if own_message(found, package) else next(makers, None)
    undefined = _undefined(found, package)
    if maker is None or (maker is package and undefined):
        return undefined or _unlisted(found, package)
    wanted = re.match(r"cannot import name '(\w+)'", found.message)
    if wanted is not None and "__init__.py" in found.message:  # the build made others
        own = next((one for one in maker.interfaces if wanted[1] in one.classes), None)
        if own is None:
            made = join_words(name for one in maker.interfaces for name in one.classes)
            return f"the build makes {made}", f"write the one that you mean instead of {wanted[1]}"
        return f"the build has not made it from {own.path}", _listing([own])
    asked = re.search(rf"'{re.escape(maker.name or '')}\.(msg|srv)'", found.message)
    if asked is not None and all(own.module != asked[1] for own in maker.interfaces):
        kind = {"msg": "message", "srv": "service"}[asked[1]]
        hint = f"write the definition in {asked[1]}/, and list it in add_{kind}_files(…)"
        return f"the package has no .{asked[1]} file to build it from", hint
    whose = "the package's own messages" if maker is package else f"the messages of {maker.name}"
    hint = BUILD_FIRST_HINT
    if (listed := maker.file(CMAKE)) is None or listed.link_problem:
        hint = f"first add the {CMAKE} that `catkin_create_pkg` writes. In it, {_listing(maker.interfaces)}"
        hint += ", and call generate_messages(…)"
    elif not cmake_calls(maker, "generate_messages"):
        hint = "call generate_messages(…) above catkin_package(…)"
        if not cmake_calls(maker, *OF_FILES):
            # names no file: a repair that does is told behind it
            kinds = {PurePosixPath(one.path).suffix for one in maker.interfaces}
            calls = join_words((f"{call}(…)" for call, kind in OF_FILES.items() if kind in kinds), "or")
            hint = f"list them in {calls}, and call generate_messages(…)"
    return f"the build makes {whose}", hint


def _undefined(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint of an import of definitions from a package that has none, or lists none."""
    module, names = (found.kind in IMPORT_ERRORS and _imported_names(found.innermost.source)) or ("", ())
    kind = {f"{package.name}.msg": "message", f"{package.name}.srv": "service"}.get(module)
    listed = package.interfaces and cmake_calls(package, *OF_FILES)
    if kind is None or listed or f"'{package.name}" not in found.message:
        return None
    folder = module.rpartition(".")[2]
    for other in package.also:  # the one of the submission's packages that it comes from
        if any(set(names) & {*one.classes} for one in other.interfaces if one.module == folder):
            line = found.innermost.source.replace(str(package.name), str(other.name), 1)
            return f"{other.name} makes this {kind}", f"write `{shown(line)}`"
    if package.interfaces:
        return None
    name = re.sub(r"(Request|Response)$", "", names[0]) if folder == "srv" else names[0]
    file = f"{folder}/{name}.{folder}" if name != "*" else f"the definition in {folder}/"
    hint = f"write {file}, list it in add_{kind}_files(…), and call generate_messages(…) in {CMAKE}"
    return f"the package has no .{folder} file to build it from", hint


def _listing(interfaces: Iterable[Interface]) -> str:
    """Return the advice to name these definitions in the calls that make them."""
    files = [PurePosixPath(one.path) for one in interfaces]
    calls = {call: [path.name for path in files if path.suffix == kind] for call, kind in OF_FILES.items()}
    return "list " + join_words(f"{join_words(names)} in {call}(…)" for call, names in calls.items() if names)


def _unlisted(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint of a name that `from lab1.srv import *` does not bring, because CMakeLists.txt
    lists other definitions than its own."""
    wanted = re.match(r"name '(\w+)' is not defined", found.message)
    file = found.innermost.file
    if wanted is None or any(s.name == wanted[1] and file.endswith(f"/{s.file}") for s in package.slips):
        return None
    for maker in (package, *package.also):
        own = next((one for one in maker.interfaces if wanted[1] in one.classes), None)
        call = next((c for c, kind in OF_FILES.items() if own is not None and own.path.endswith(kind)), "")
        listed = [word for one in cmake_calls(maker, call) for word in one.args]
        if own and "FILES" in listed and not {PurePosixPath(own.path).name, "DIRECTORY"} & {*listed}:
            return f"the build has not made it from {own.path}", _listing([own])
    return None


def _makes(package: PackageFacts, message: str) -> bool:
    """Return whether the build makes the module that the message names."""
    named = any(f"'{package.name}{inner}'" in message for inner in ("", ".msg", ".srv"))
    return named and bool(package.interfaces)


def unimported_module(found: Traceback, package: PackageFacts) -> str:
    """Return a module that the script uses, and does not import, where it uses nothing of the one that it imports and
    that is not there; "" for none."""
    file, asked = found.innermost.file, NO_MODULE.search(found.message)
    own = [s for s in package.slips if file.endswith(f"/{s.file}")]
    unused = {s.message for s in own if s.kind == "unused-import"}
    if asked is None or asked[1] in known_packages() or asked[1] not in unused:
        return ""
    return next((s.name for s in own if s.kind == "undefined" and s.fix == IMPORT % s.name), "")


def _class_of_module(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the class, or the module, that is meant by a name of another case: `from queue import queue`."""
    file, line = found.innermost.file, found.innermost.line
    slips = (s for s in package.slips if s.kind == "misspelt" and s.line == line)
    meant = next((s for s in slips if file.endswith(f"/{s.file}")), None)
    return (meant.message, meant.fix) if meant and _FROM_PACKAGE.search(found.message) else None


def _other_module(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return what a module is meant by one that is not there: a class, one of Python 3, one that is spelt alike."""
    message = found.message
    if inner := _IN_MODULE.search(message):
        own = f"write `from {inner[1]} import {inner[2]}`"
        source = found.innermost.source
        hint = (
            f"{own} on a line of its own, and take {inner[1]}.{inner[2]} out of this one"
            if "," in source
            else own
        )
        return f"{inner[2]} is a class in {inner[1]}", hint
    inner = _OF_MESSAGES.search(message)
    if inner and inner[1] in noetic_messages() and (right := closest(inner[2], ("msg", "srv"))):
        return (
            f"did you mean {inner[1]}.{right}?",
            f"write {inner[1]}.{right} instead of {inner[1]}.{inner[2]}",
        )
    if inner and inner[2] == "py":
        return (
            f"a module's name has no `.py` of its file: it is {inner[1]}",
            f"write {inner[1]} instead of {inner[1]}.py",
        )
    asked, wanted = NO_MODULE.search(message), _FROM_PACKAGE.search(message)
    if asked and (known := _module_of_others(asked[1], package, found.innermost.source)):
        return known
    meant = unimported_module(found, package)
    near = near_names(asked[1], noetic_messages()) if asked and asked[1] not in known_packages() else ()
    near = () if meant else near
    if wanted and wanted[1] in noetic_messages().get(wanted[2], ()):
        near = (wanted[2],)
    if near:
        line = f"from {near[0]}.msg import {wanted[1] if wanted else '…'}"
        source = found.innermost.source.strip()
        if asked and re.match(r"import [\w.]+( as \w+)?$", source):
            line = source.replace(asked[1], near[0], 1)
        return f"messages come from {near[0]}.msg", f"write `{line}`"
    meant = meant or (nearest_module(asked[1], package.own_modules) if asked else "")
    return (f"did you mean {meant}?", f"write {meant} instead of {asked[1]}") if asked and meant else None


def _module_of_others(name: str, package: PackageFacts, source: str) -> tuple[str, str] | None:
    """Return the cause and the hint for a module of ROS 2, of Windows, of Python 2, of a tutorial's package, or for a
    folder. `source` is the line of the import: what it names so, the lines below it use."""
    if name in ROS_2:
        return f"{name} is from ROS 2", "this lab is for ROS 1: write the node with rospy"
    if name in WINDOWS:
        return f"{name} is only on Windows", f"write the script without {name}"
    if name in PYTHON_2:
        return f"{name} is a Python 2 module", _as_in_python_3(name, source)
    if name in TUTORIALS - {package.name}:
        fix = f"write your package's name instead of {name}, or leave the line out"
        if package.interfaces and re.match(r"\s*import ", source):
            own = re.sub(rf"\b{name}\b", package.name or "", source.strip())
            fix = f"write `{own}`"
        return "tutorials use that name for the reader's own package", fix
    if any(file.path.startswith(f"{name}/") for file in package.files):
        why = f"{name}/ is a folder of the package, and Python looks for modules in the script's own folder"
        return why, "put the module's file into the folder of the script, and import it by its own name"
    return None


def _as_in_python_3(name: str, source: str) -> str:
    """Return what to write for a module of Python 2 in this line."""
    if brought := re.match(rf"\s*from\s+{name}\s+import\s+([\w, ]+)", source):
        return f"write `from {PYTHON_2[name]} import {brought[1].strip()}`"
    bare = re.search(rf"^\s*import\b.*\b{name}\b(?!\s+as\b)", source)
    right = f"`{PYTHON_2[name]} as {name}`" if bare else PYTHON_2[name]
    return f"write {right} instead of {name}"


_RELAYED = re.compile(r"cannot import name '\w+' from '(\w+)' \(/\S*/devel/lib/")


def _own_module(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return why Python does not find a file of the package's own, and what lets it."""
    relayed = _RELAYED.match(found.message)
    asked = relayed or NO_MODULE.search(found.message)
    script = path_in_package(package, found.innermost.file)
    if asked is None or script is None:
        return None
    paths = [PurePosixPath(file.path) for file in package.files if not is_product(file.path)]
    if asked[1] == package.name and PurePosixPath(f"src/{asked[1]}/__init__.py") in paths:
        return _own_python_package(asked[1], package)
    folder, line = PurePosixPath(script).parent, found.innermost.source.strip()
    # `from basic_comms.tools import say`, of a file that lies in no Python package of that name
    inner = re.match(r"from (\w+)(?:\.(\w+) (import .*)| (import (\w+)))$", line)
    inner = inner if inner and inner[1] == asked[1] == package.name else None
    name = (inner[2] or inner[5]) if inner else asked[1]
    files = sorted(
        (path for path in paths if path.name == f"{name}.py"), key=lambda path: path.parent != folder
    )
    if not files:
        return None
    file, place, instead = files[0], "os.path.dirname(__file__)", ""
    if inner:
        cause = f"{file} is there, and no Python package {asked[1]} that it is a part of"
        instead = f"write `{inner[4] or f'from {name} {inner[3]}'}` instead of the import, and "
    if file.parent != folder:
        cause = cause if instead else f"{file} is in another folder, and Python looks beside {script}"
        place = f"os.path.join({place}, '{posixpath.relpath(str(file.parent), str(folder))}')"
    elif relayed:
        cause = f"catkin_install_python makes a program of {file}, and Python finds that in place of it"
    elif instead:
        pass
    elif any("/devel/lib/" in frame.file for frame in found.frames):
        program = f"the program that catkin_install_python makes from {script}"
        cause = f"{file} is there, and {program} does not look beside it"
    else:
        return None
    return cause, f"{instead}write `import os, sys; sys.path.insert(0, {place})` above the import"


def _own_python_package(name: str, package: PackageFacts) -> tuple[str, str] | None:
    """Return what keeps the build from making `src/<name>/` known to Python."""
    call = "catkin_python_setup()"
    if package.file("setup.py") is None:
        fix = f"write setup.py as {SETUP_PAGE} says, and call {call} above catkin_package(…)"
        return f"src/{name}/ exists, but without a setup.py Python does not find it", fix
    if cmake_calls(package, "catkin_python_setup"):
        return None
    return (
        f"src/{name}/ is there, and CMakeLists.txt does not call {call}",
        f"call {call} above catkin_package(…)",
    )


def _other_types(name: str, package: str) -> tuple[str, str] | None:
    """Return which packages of ROS have the message, or what the one that was asked has that is spelt alike."""
    having = [other for other, names in noetic_messages().items() if name in names]
    near = near_names(name, noetic_messages().get(package, ()))
    if having:
        lines = join_words([f"from {other}.msg import {name}" for other in having], "or")
        return f"{package} has no {name}, {join_words(having)} has", lines
    return (f"{package} has {near[0]}", f"from {package}.msg import {near[0]}") if near else None


def _other_attributes(package: PackageFacts, owner: str, wrong: str, source: str) -> tuple[str, str] | None:
    """Return what a message has, or an object of rospy's, in place of an attribute that it has not."""
    known = ATTRIBUTES.get(owner) or fields_of(package, owner)
    having = [
        kind
        for own in package.interfaces
        for kind, names in own.members.items()
        if kind != owner and wrong in names and owner in {*own.classes, *own.members}
    ]
    # `self._result.count`: what is called so is the right part, with a field of another one
    part = (re.search("(Request|Response|Goal|Result|Feedback)$", owner) or [""])[0]
    is_right_part = bool(part and re.search(rf"(?i)\b\w*_?{part[:3]}\w*\.{wrong}\b", source))
    if len(having) == 1 and not near_names(wrong, known) and not is_right_part:
        return f"{wrong} is a field of {having[0]}", f"make it as {having[0]}(), not as {owner}()"
    if not known:
        return None
    # Two letters are the beginning of too many names.
    alike = [name for name in known if min(len(name), len(wrong)) > 2 and _begins_alike(name, wrong)]
    near = near_names(wrong, known) or (tuple(alike) if len(alike) == 1 else ())
    if near:
        return f"{owner} has {near[0]}", _line_with(source, wrong, near[0])
    if owner in ATTRIBUTES:
        return None
    of_value = any(hasattr(kind, wrong) for kind in (str, float, list))
    # what is set is no method of a text
    if len(known) == 1 and of_value and not re.search(rf"\.{wrong}\s*[-+*/]?=(?!=)", source):
        return f"it is the whole message ({owner})", f"write `.{known[0]}.{wrong}` instead of `.{wrong}`"
    why, fix = _other_field(owner, known, wrong, source, _types_in(package, owner))
    of_own = [f", or add it to {one.path}" for one in package.interfaces if owner in one.classes]
    return why, fix + "".join(of_own if "that you mean" in fix else ())


def _types_in(package: PackageFacts, owner: str) -> dict[str, str]:
    """Return the types of the fields of a message of the package's own, by name; nothing where all have the same."""
    fields = [
        f for one in package.interfaces if one.classes == (owner,) for f in one.fields if f.value is None
    ]
    types = {field.name: field.type for field in fields}
    return types if len({*types.values()}) > 1 else {}


def _other_field(
    owner: str, known: tuple[str, ...], wrong: str, source: str, kinds: Mapping[str, str]
) -> tuple[str, str]:
    """Return what a message has in place of a field that it has not, and that is like none of its own."""
    inner = re.search(rf"\.{wrong}\.({'|'.join(known)})\b", source)
    if inner:  # `feedback.feedback.count`: this is the inner part already
        return f"it is the {owner} already", f"write `.{inner[1]}` instead of `.{wrong}.{inner[1]}`"
    if len(known) == 1:
        return f"{owner} has only {known[0]}", _line_with(source, wrong, known[0])
    way = [
        field
        # A field often has the name of its type in small letters: `pose`, a Pose.
        for field in known
        if any(wrong in types.get(field.capitalize(), ()) for types in noetic_messages().values())
    ]
    if len(way) == 1:
        return f"{wrong} is in its {way[0]}", _line_with(source, wrong, f"{way[0]}.{wrong}")
    names = [f"{name} ({kinds[name]})" if name in kinds else name for name in known[:ATTRIBUTES_SHOWN]]
    listed = join_words(names) + (", …" if len(known) > ATTRIBUTES_SHOWN else "")
    return f"{owner} has {listed}", f"write the field that you mean instead of {wrong}"


def _field_of_number(found: Traceback, owner: str) -> tuple[str, str] | None:
    """Return which field of a message has a number in place of its own fields: that shows when it is published."""
    frame = found.frames[-1] if found.frames else None
    if owner not in {"int", "float"} or frame is None or frame.marked is None or not frame.in_library:
        return None
    path = re.match(r"_x\.((?:\w+\.)*\w+)\.(\w+)$", frame.source[slice(*frame.marked)])
    if path is None:
        return None
    field, inner = path[1], f"{path[1]}.{path[2]}"
    if path[2] in {"secs", "nsecs"}:
        return f"the message's {field} is a Time, and not a number", f"write `.{field} = rospy.Time.now()`"
    return f"the message's {field} has fields of its own", f"write `.{inner} = …`, not `.{field} = …`"


def _begins_alike(name: str, wrong: str) -> bool:
    return name.startswith(wrong) or wrong.startswith(name)


def _line_with(source: str, wrong: str, right: str) -> str:
    """Return the advice to write the line with another attribute, where it sets the wrong one, or has it once."""
    line, count = re.subn(rf"^([^=]*)\.{wrong}(?=\s*=(?!=))", rf"\g<1>.{right}", source)
    if (apart := f".{right.replace('_', '.')}") != f".{right}" and apart in source:  # `rospy.init.node`
        line, count = source.replace(apart, f".{right}"), 1
    elif not count:
        line, count = re.subn(rf"\.{wrong}\b", f".{right}", source)
    return f"write `{shown(line)}`" if count == 1 else f"write {right} instead of {wrong}"


IMPORT = "write `import %s` at the top"
"""The fix of a module's name that is not there, as `package/lint/script_names.py` writes it."""


class NameSlip(NamedTuple):
    """A name that is not there: why, and what to do; `imports` are the lines of which one brings it."""

    name: str
    line: int
    why: str
    fix: str
    imports: tuple[str, ...] = ()


def name_slip(slip: PythonSlip, package: PackageFacts) -> NameSlip | None:
    """Return what a slip says of a name that is not there; None of any other slip."""
    name, why, fix = slip.name, slip.message, slip.fix
    others = [other for other in package.slips if other.file == slip.file]
    gone = [s for s in others if s.kind == "commented-out" and s.name.startswith(f"{name} = ")]
    if gone and slip.kind in {"misspelt", "undefined"}:
        why = f"line {gone[0].line}, which gives it its value, is commented out"
        return NameSlip(name, slip.line, why, gone[0].fix)
    if slip.kind == "misspelt":
        return NameSlip(name, slip.line, why, f"on line {slip.line}, {fix}")
    if slip.kind != "undefined":
        return None
    if known := SLIPS.get(f"name '{name}' is not defined"):
        return NameSlip(name, slip.line, known[0], f"on line {slip.line}, {known[1]}")
    having = [f"{package}.msg" for package, types in noetic_messages().items() if name in types]
    made = [
        f"{p.name}.{i.module}" for p in (package, *package.also) for i in p.interfaces if name in i.classes
    ]
    of_python = [MODULE_OF[name]] if name in MODULE_OF else []
    lines = tuple(f"from {module} import {name}" for module in of_python or made or having)
    if of_python or (name[:1].isupper() and lines and "<package>" in fix):
        why, fix = (
            f"{name} is not imported",
            f"write {join_words([f'`{one}`' for one in lines], 'or')} at the top",
        )
        return NameSlip(name, slip.line, why, fix, lines)
    is_module = fix == IMPORT % name
    return NameSlip(name, slip.line, why, fix, (f"import {name}",) if is_module else ())
