"""What counts as a name, and as an anonymous one, whatever the name is."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from grader.checks.support.processes import base_name, is_named

NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,12}[a-z]", fullmatch=True)
NUMBERS = st.integers(0, 10**13)


@given(name=NAMES, pid=NUMBERS, time_ms=NUMBERS)
def test_plain_and_anonymous(name: str, pid: int, time_ms: int) -> None:
    plain, anonymous = f"/{name}", f"/{name}_{pid}_{time_ms}"
    assert base_name(anonymous) == base_name(plain) == plain
    assert [is_named(plain, [name], kind) for kind in ("allowed", "required", "forbidden")] == [
        True,
        False,
        True,
    ]
    assert [is_named(anonymous, [name], kind) for kind in ("allowed", "required", "forbidden")] == [
        True,
        True,
        False,
    ]


@given(name=NAMES, other=NAMES, pid=NUMBERS)
def test_no_other_name_fits(name: str, other: str, pid: int) -> None:
    for node in (f"/{other}", f"/{other}_{pid}_{pid}", f"/{name}_{pid}", f"/ns/{name}", f"/{name}_x_{pid}"):
        assert is_named(node, [name], "allowed") is (
            other == name and node in {f"/{name}", f"/{name}_{pid}_{pid}"}
        )
