"""What the compiler says of C++ where a value, a message or a callback has another type, in a student's words."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Sequence

from grader.checks.support.cpp_errors import (
    FIRST_ERROR_HINT,
    OF_ROS,
    Explain,
    Explained,
    no_type,
    plainly,
)
from grader.checks.support.text import near_names
from grader.installable import noetic_messages
from grader.model.package import PackageFacts
from grader.wording import join_words

_CLASS = (
    r"(?:const )?(?:boost::shared_ptr<)?(?:const )?(\w+)::(\w+?)_?(?:<std::allocator<void> ?>)?(?: ?>)?&?"
)
"""What the compiler calls a message, or a pointer to one."""
_FIELD = r"(?P<scope>\w+)::(?P<name>\w+)_<.*?>::_(?P<field>\w+)_type"
_MESSAGE = r"'(?P<scope>\w+)::(?P<name>\w+?)(?:_<[^']*?>)?(?:::_(?P<field>\w+)_type)?'"
_KIND = r"(?:template )?type(?:; did you mean '(?P<near>\w+)')?"
_STRING = r"std::(?:__cxx11::)?(?:basic_)?string"
_NUMBER = (
    r"'(?:std_msgs::(?:U?Int\d+|Float\d+|Bool)_<.*>::_data_type|geometry_msgs::\w+_<.*>::_\w_type|u?int\d+_t"
    r"|(?:(?:un)?signed )?(?:int|short|char|float|double|long|bool)(?: int)?)'"
)
"""What the compiler calls the type of a number, and of the fields of messages that hold one."""
_PLACE = re.compile(r"^[\w.+-]+:\d+: ")
_TO_NUMBER = "on that line, write a number; `std::stod(…)` makes one of a text"


def _where(found: re.Match[str]) -> str:
    """Return the file and the line that the error begins with; "" where it has none."""
    place = _PLACE.match(found.string)
    return place[0] if place else ""


def _plain(kind: str) -> str:
    """Return a type as it is written: the class of a message has its allocator in its name."""
    return re.sub(r"_<std::allocator<void> ?>", "", kind).strip()


def _field_names(package: PackageFacts, scope: str, name: str) -> tuple[str, ...]:
    """Return the fields of a message of the package's own, or of ROS; none where it is not known."""
    own = [one for one in package.interfaces if posixpath.basename(one.path) == f"{name}.msg"]
    if scope == package.name and own:
        return tuple(one.name for one in own[0].fields if one.value is None)
    return noetic_messages().get(scope, {}).get(name, ())


def _no_message(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of a callback, or a topic, with what is no message: a pointer to one, or another class."""
    kind, where = _plain(found[1]), _where(found)
    bare = kind.removeprefix("const ").rstrip("*& ")
    if kind.endswith("*"):
        why = f"{where}a callback takes a plain pointer, `{kind}`, and ROS has none to give it"
        return Explained(why, f"write `const {bare}::ConstPtr&` as the type of what the callback takes")
    return Explained(f"{where}`{kind}` is no message type", "write the type of the topic's messages")


def _explain_subscription(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """roscpp takes the message's type from a function, and of a lambda or of what `bind` makes it has to be told."""
    given = found[1]
    why = "subscribe(…) does not take this callback"
    if "lambda" in given or "bind" in given.lower():
        kind = "a lambda" if "lambda" in given else "what bind(…) makes"
        hint = "write the type behind subscribe: nh.subscribe<std_msgs::String>(…), with your own type"
        return Explained(f"{why}: {kind} does not tell it the message's type", hint)
    if method := re.search(r"\((\w+)::\*\)", given):
        fix = f"give the object behind the method: `this` in a method of {method[1]}, elsewhere the address of one"
        return Explained(f"{why}: a method of {method[1]} needs its object", fix)
    if function := re.search(r"([\w:]+) \(&\)\((.*?)\)\)?(?:'|\u2026|$)", given):
        taken = re.sub(r"<[^<>]*>", "", re.sub(r"<[^<>]*>", "", function[2]))
        if function[1] != "void":
            why = f"{_where(found)}{why}: it returns {function[1]}"
            return Explained(why, "write `void` in front of the callback's name")
        if taken.count(","):
            why = f"{_where(found)}{why}: it takes {taken.count(',') + 1} values, and ROS gives it the message alone"
            return Explained(why, "delete what the callback takes besides the message")
        if not taken.strip():
            hint = "write `const std_msgs::String::ConstPtr& msg`, with the topic's type, into the callback's brackets"
            return Explained(f"{_where(found)}{why}: it takes no message", hint)
    return Explained(f"{found.string}: these arguments do not fit", f"write it as in `{OF_ROS['subscribe']}`")


def _no_arrow(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Of `msg.data`, `msg` being what a callback gets."""
    source = re.compile(rf"\|.*?\b(\w+)\.{found[1]}\b")
    name = next((m[1] for line in lines if (m := source.search(line))), "msg")
    why = "a ConstPtr is a pointer, whose fields stand behind `->`"
    return Explained(why, f"write `{name}->{found[1]}` in place of `{name}.{found[1]}`")


def _other_callback(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of `subscribe<A>(…)` with a callback that takes a B."""
    takes, gives = (f"{found[number]}::{found[number + 1]}" for number in (1, 3))
    why = f"{_where(found)}subscribe<{gives}>(…) is given a callback that takes a {takes}"
    return Explained(why, f"write the type of the topic's messages in both: {gives} or {takes}")


def _other_class(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of a message that is given another one, or a value that one of its fields is to have."""
    scope, name, other = found["scope"], found["name"], _plain(found["other"])
    kind = f"{scope}::{name}"
    if field := found["field"]:
        why = f"{_where(found)}{field} of a {kind} has fields of its own, and is given a value"
        named = (
            "`x` and its others" if scope == "geometry_msgs" else f"`rosmsg show {scope}/{name}` names them"
        )
        return Explained(why, f"on that line, give a value to each field of {field}: {named}")
    if re.fullmatch(r"(?:const )?\w+::\w+", other) and not other.startswith("std::"):
        other = other.removeprefix("const ")
        why = f"{_where(found)}a {kind} is given a {other}, which is another type"
        return Explained(why, f"on that line, use a {kind}, or declare the variable as a {other}")
    fields = _field_names(package, scope, name)
    why = f"{_where(found)}a {kind} is given a value, and not its field"
    behind = join_words([f"`.{one}`" for one in fields], "or")
    return Explained(why, f"write {behind} behind the message on that line" if fields else FIRST_ERROR_HINT)


def _text_for_field(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of a text that a field of the package's own message is given."""
    name, field = found["name"], found["field"]
    own = [one for one in package.interfaces if posixpath.basename(one.path).startswith(f"{name}.")]
    kind = next((f.type for one in own for f in one.fields if f.name == field), "")
    if not re.fullmatch(r"u?int\d+|float\d+|bool|byte|char", kind):
        return Explained(found.string, FIRST_ERROR_HINT)
    return Explained(f"{_where(found)}{field} has the type {kind}, and is given a text", _TO_NUMBER)


def _other_value(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of `std_msgs::String msg = "text"`, and of what one call makes that is kept as what another one makes."""
    given, wanted = _plain(found[1]), _plain(found[2])
    if (message := re.fullmatch(r"(\w+)::(\w+)", wanted)) and not re.match(r"(?:const )?\w+_msgs::", given):
        fields = _field_names(package, message[1], message[2])
        if fields:
            why = f"{_where(found)}a {wanted} is made of a value, and it is a message with fields"
            shown = join_words([f"`msg.{one} = …;`" for one in fields])
            return Explained(why, f"write `{wanted} msg;`, and below it {shown}")
    why = f"{_where(found)}a {wanted} cannot be made of a {given}"
    return Explained(why, f"on that line, write {given} in place of {wanted}, or give it a {wanted}")


def _not_in_namespace(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Of `lab_msgs::Nums`; a message is a class whose name ends with `_`, which no one writes."""
    if found["scope"] == package.name or found["scope"] in noetic_messages():
        told = no_type(found, package, lines)
        return told._replace(why=f"{_where(found)}{told.why}")
    near = found["near"]
    return Explained(found.string, f"write {near} in place of {found['name']}" if near else FIRST_ERROR_HINT)


def _no_field(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """A field that the package's own message, or that part of its service, does not have."""
    kind, part, name = found["kind"], (found["part"] or "").lower(), found["field"]
    own = next(
        (one for one in package.interfaces if posixpath.basename(one.path).partition(".")[0] == kind), None
    )
    meant = re.search(r"; did you mean '([^']+)'", found.string)
    if meant or own is None or found["package"] != package.name:
        return Explained(found.string, f"write {meant[1]} in place of {name}" if meant else FIRST_ERROR_HINT)
    fields = [one.name for one in own.fields if one.part == part and one.value is None]
    other = next((one.part for one in own.fields if one.name == name and one.part != part), "")
    of = f"the {part} of {kind}" if part else kind
    why = f"{of} has no field {name}"
    if other:
        return Explained(
            f"{why}: it is one of the {other}", f"write the {other}'s variable in front of {name}"
        )
    near = near_names(name, fields)
    hint = (
        f"write {near[0]} in place of {name}"
        if near
        else f"write the one that you mean of {join_words(fields)}"
    )
    return Explained(f"{why}; it has {join_words(fields)}" if fields else why, hint)


_OWNER = (
    r"(?:const )?(?:struct )?(?P<package>\w+)::(?P<kind>\w+?)(?:::)?(?P<part>Request|Response)?(?:_<[^']*)?"
)
TYPE_ERRORS: tuple[tuple[str, Explain], ...] = (
    (
        r"cast from 'const char ?\*' to '(\w+)' loses precision",
        plainly(
            "`({1})` makes one {1} of where the text in quotes lies in memory",
            "remove the `({1})` on that line: a text in quotes goes into a std_msgs/String as it is",
        ),
    ),
    (
        rf"(?:invalid conversion from|cannot convert) 'const char ?(?:\*|\[\d+\])' to {_NUMBER}",
        plainly(
            "a text in quotes stands where a number belongs", "on that line, write the number without quotes"
        ),
    ),
    (
        rf"cannot convert '{_STRING}\b.* to {_NUMBER} in (?:assignment|initialization)",
        plainly("a text stands where a number belongs", _TO_NUMBER),
    ),
    (
        rf"(?:invalid conversion from|cannot convert) '(?:const char|{_STRING}\b).* to '{_FIELD}'",
        _text_for_field,
    ),
    (rf"no match for 'operator=' \(operand types are {_MESSAGE} and '(?P<other>[^']+)'", _other_class),
    (rf"'(?P<name>\w+)' in namespace '(?:::)?(?P<scope>\w+)' does not name a {_KIND}", _not_in_namespace),
    (r"conversion from '([^']+)' to non-scalar type '([^']+)' requested", _other_value),
    (
        rf"invalid initialization of reference of type '{_CLASS}' from expression of type '{_CLASS}'",
        _other_callback,
    ),
    (r"no matching function for call to '(?:ros::)?NodeHandle::subscribe(.*)", _explain_subscription),
    (r"'__s_get\w+' is not a member of '([^']+)'", _no_message),
    (
        r"'__get\w+' in '\w+', which is of (non-class|pointer) type",
        plainly("publish(…) is given what is no message, but of a {1} type", "write `pub.publish(msg)`"),
    ),
    (r"(?:ConstPtr|Ptr|shared_ptr).* has no member named '(\w+)'", _no_arrow),
    (rf"'{_OWNER}' has no member named '(?P<field>\w+)'", _no_field),
)
"""Errors by what they say; each is tried before those of `cpp_errors.CPP_ERRORS`."""
