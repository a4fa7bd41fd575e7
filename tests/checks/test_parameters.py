"""The parameter server's state from its changes, against a plain model of nested maps."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from grader.checks.support.parameters import (
    describe_missing,
    leaves,
    params_on_server,
    without_system_params,
)
from tests.support.timeline import build_runs

NAMES = st.lists(st.sampled_from("abc"), min_size=1, max_size=3)
VALUES = st.recursive(
    st.integers(),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner, min_size=1, max_size=2),
    max_leaves=4,
)
CHANGES = st.lists(st.tuples(NAMES, st.one_of(st.none(), VALUES)), max_size=8)


def model(changes: list[tuple[list[str], Any]]) -> dict[str, Any]:
    """As the master keeps it: a change replaces what was at its name."""
    root: dict[str, Any] = {}
    for keys, value in changes:
        place = root
        for key in keys[:-1]:
            if not isinstance(place.get(key), dict) and value is None:
                place = {}
                break
            if not isinstance(place.get(key), dict):
                place[key] = {}
            place = place[key]
        if value is None:
            place.pop(keys[-1], None)
        else:
            place[keys[-1]] = _copy(value)
    return dict(_leaves(root, ""))


def _copy(value: Any) -> Any:
    return {k: _copy(v) for k, v in value.items()} if isinstance(value, dict) else value


def _leaves(value: Any, name: str) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [leaf for key, item in value.items() for leaf in _leaves(item, f"{name}/{key}")]
    return [(name, value)]


@given(CHANGES)
def test_tree_is_what_the_master_keeps(changes: list[tuple[list[str], Any]]) -> None:
    lines = [
        {
            "action": "delete" if value is None else "set",
            "name": "/" + "/".join(keys),
            "value": value,
            "at_s": 0.01 * n,
        }
        for n, (keys, value) in enumerate(changes)
    ]
    run = build_runs({"params": lines, "host": [], "graph": []})["run"]
    assert params_on_server(run) == model(changes)


def test_tree_of_one_time_and_of_some_callers() -> None:
    lines = [
        {"name": "/x", "value": 1, "at_s": 1, "caller_id": "/roslaunch"},
        {"name": "/x", "value": 2, "at_s": 2, "caller_id": "/node"},
    ]
    run = build_runs({"params": lines})["run"]
    assert params_on_server(run) == {"/x": 2}
    assert params_on_server(run, until_ns=run.params[0][0]) == {"/x": 1}
    assert params_on_server(run, by=lambda caller: caller != "/node") == {"/x": 1}


def test_leaves_of_an_empty_map_and_of_the_root() -> None:
    assert dict(leaves("/a", {})) == {"/a": {}}
    assert dict(leaves("/", {"a": {"b": 1}})) == {"/a/b": 1}


def test_instead_prefers_the_same_last_name() -> None:
    found = {"/rosdistro": "noetic", "/details/first": 1, "/details/nam/last": 2}
    assert (
        describe_missing(found, "/details/name/first")
        == "there is no /details/name/first; there is /details/first"
    )
    assert describe_missing({}, "/x") == "there is no /x"
    assert without_system_params(found).keys() == {"/details/first", "/details/nam/last"}
