"""YAML that is written to keep its reader busy: bounded time, and a line that says what is wrong."""

from __future__ import annotations

import resource
import time

import pytest

from grader.errors import RubricError
from grader.rubric.yaml_lines import read_source


def doubling(line: str, rounds: int = 40) -> str:
    """Anchors of which each stands for the one before, twice."""
    return "a0: &a0 {x: 1}\n" + "".join(line.format(n, n - 1) for n in range(1, rounds))


@pytest.mark.full
@pytest.mark.parametrize(
    ("text", "says"),
    [
        (doubling("a{0}: &a{0} [*a{1}, *a{1}]\n"), "aliases multiply"),
        (doubling("a{0}: &a{0} {{x: *a{1}, y: *a{1}}}\n"), "aliases multiply"),
        (doubling("a{0}: &a{0} {{<<: [*a{1}, *a{1}]}}\n"), "aliases multiply"),
        (doubling("a{0}: &a{0} {{<<: [*a{1}, *a{1}]}}\n").replace("x: 1", ""), "aliases multiply"),
        ("a: &a [*a]\n", "nested too deeply|aliases|recursive"),
        ("a: &a {<<: *a}\n", "aliases multiply|deeply|undefined"),
        ("[" * 100_000, "nested too deeply|expected"),
        ("{a: " * 100_000, "nested too deeply|expected"),
        ("- " * 100_000, "nested too deeply"),
        ("? " * 100_000, "nested too deeply|expected"),
        ("a: " + "!!python/object/apply:os.system [id]", "tag"),
        ("a: !!python/name:os.system x", "tag|constructor"),
        ("a: " + "9" * 900_000, "cannot be read"),
        ("a: " + "1:" * 400_000 + "1", "cannot be read|too"),
        ("a: 1\n" * 5_000, "given twice"),
        ("x" * 1_000_001, "larger than 1 MB"),
        ("a: \x1b[2J", "character that YAML does not allow"),
    ],
)
def test_a_rubric_that_multiplies(text, says, tmp_path):
    path = tmp_path / "r.yaml"
    path.write_text(text)
    begin, peak = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(RubricError, match=says) as caught:
        _read(path)
    assert time.process_time() - begin < 5
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak < 300_000
    assert all(fault.isprintable() for fault in caught.value.faults)


def _read(path):
    """All faults as one error, those that are only noted too."""
    source = read_source(path, "r.yaml")
    raise RubricError([source.fault(*fault) for fault in source.faults])


def test_a_rubric_without_an_end_is_not_read_to_it(tmp_path):
    (tmp_path / "r.yaml").symlink_to("/dev/zero")
    with pytest.raises(RubricError, match="larger than 1 MB"):
        read_source(tmp_path / "r.yaml", "r.yaml")
