"""What was on the parameter server at a time; maps are taken apart into their leaves (`/details/name/first`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from grader.checks.support.text import near_names
from grader.evidence.events import ParamEvent
from grader.evidence.run import Run
from grader.wording import join_words

SYSTEM = (
    "/rosdistro",
    "/rosversion",
    "/run_id",
    "/use_sim_time",
    "/rosout_disable_topics_generation",
    "/roslaunch/",
)


def absolute(name: str) -> str:
    """With the slash in front, and none at the end."""
    return "/" + name.strip("/")


def leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - as XML-RPC gives it
    """A parameter as its leaves; an empty map is one of its own."""
    if isinstance(value, Mapping) and value:
        for key, item in value.items():
            yield from leaves(f"{name.rstrip('/')}/{key}", item)
    else:
        yield name, value


def tree(
    run: Run, *, until_ns: int | None = None, by: Callable[[str], bool] = lambda _: True
) -> dict[str, Any]:
    """The server's leaves after all changes up to `until_ns` by those callers that `by` wants."""
    found: dict[str, Any] = {}
    for at_ns, event in run.params:
        if (until_ns is None or at_ns <= until_ns) and by(event.caller_id):
            _apply(found, event)
    return found


def own(found: Mapping[str, Any]) -> dict[str, Any]:
    """Without what ROS itself keeps there."""
    return {name: value for name, value in found.items() if not name.startswith(SYSTEM)}


def _apply(found: dict[str, Any], event: ParamEvent) -> None:
    name = absolute(event.name)
    below = f"{name.rstrip('/')}/"
    for known in [n for n in found if n == name or n.startswith(below)]:
        del found[known]
    if event.action == "set":
        for known in [n for n in found if name.startswith(f"{n}/")]:
            del found[known]  # a value gives way to a map
        found.update(leaves(name, event.value))


def instead(found: Mapping[str, Any], name: str) -> str:
    """`there is no /details/name/first` with what is there in its place."""
    last = name.rpartition("/")[2]
    others = own(found)
    same = [n for n in others if n.rpartition("/")[2] == last]
    near = same or near_names(name, others) or list(others)
    return f"there is no {name}" + (f"; there is {join_words(near)}" if near else "")
