"""The tests that the example unit-tests runs on src/kinematics.py."""

from math import cos, hypot, pi, sin

import pytest

FILE = "src/kinematics.py"


def hand(shoulder, elbow):
    """Return where the hand is."""
    x = 0.5 * cos(shoulder) + 0.3 * cos(shoulder + elbow)
    return x, 0.5 * sin(shoulder) + 0.3 * sin(shoulder + elbow)


@pytest.mark.parametrize("angles", [(0, 0), (pi / 2, 0), (0, pi / 2), (0.4, -1.1)])
def test_forward(student, angles):
    """forward returns where the hand is."""
    found, right = student(FILE).forward(*angles), hand(*angles)
    assert found == pytest.approx(right, abs=1e-6), (
        f"forward({angles[0]:.3g}, {angles[1]:.3g}) should return ({right[0]:.3f}, {right[1]:.3f})"
    )


@pytest.mark.parametrize("place", [(0.7, 0), (0, 0.6), (-0.3, 0.4)])
def test_inverse(student, place):
    """inverse returns angles that bring the hand to the place."""
    found = hand(*student(FILE).inverse(*place))
    away = hypot(found[0] - place[0], found[1] - place[1])
    assert away < 1e-6, f"inverse{place} brings the hand to {found[0]:.3f}, {found[1]:.3f}"


def test_inverse_out_of_reach(student):
    """inverse raises a ValueError for a place that the hand cannot reach."""
    with pytest.raises(ValueError):  # noqa: PT011 - the handout names no message
        student(FILE).inverse(1, 1)


@pytest.mark.parametrize("angle", [0.5, -3, pi, 4, -4, 20])
def test_wrap(student, angle):
    """wrap returns the same angle between -pi and pi."""
    found = student(FILE).wrap(angle)
    assert -pi < found <= pi, f"wrap({angle:.3f}) returned {found:.3f}, which is not between -pi and pi"
    assert cos(found - angle) == pytest.approx(1), (
        f"wrap({angle:.3f}) returned {found:.3f}, which is another angle"
    )
