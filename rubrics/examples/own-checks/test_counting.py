"""What this lab's instructor asks of the counter."""

import pytest


def numbers(run):
    """What the student's node counted."""
    return [value for channel in run.student_channels("/numeric_chatter") for value in channel.data]


@pytest.mark.parametrize("scenario", ["talker", "wraps"])
def test_stays_in_range(evidence, scenario):
    """Numbers stay between 0 and 127."""
    found = numbers(evidence[scenario])
    assert found, "no number came"
    assert min(found) >= 0, f"{min(found)} is less than 0"
    assert max(found) <= 127, f"{max(found)} is more than 127"


@pytest.mark.points(2)
def test_comes_around(evidence):
    """After 127 the counter begins again."""
    found = numbers(evidence["wraps"])
    assert 127 in found, "127 is never reached"
    after = found[found.index(127) + 1 :]
    assert after, "nothing comes after 127"
    assert after[0] == 0, f"after 127 comes {after[0]}"


def test_is_written_down(run, package):
    """The talker is a script of the package."""
    assert run.student_nodes(), "no node was running"
    assert package.file("src/numeric_talker.py"), "src/numeric_talker.py is not there"
