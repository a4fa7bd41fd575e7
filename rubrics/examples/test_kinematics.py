"""What the example unit-tests asks of src/kinematics.py."""

from math import cos, hypot, pi, sin

import pytest

FILE = "src/kinematics.py"


def hand(shoulder, elbow):
    """Where the hand is."""
    x = 0.5 * cos(shoulder) + 0.3 * cos(shoulder + elbow)
    return x, 0.5 * sin(shoulder) + 0.3 * sin(shoulder + elbow)


@pytest.mark.parametrize("angles", [(0, 0), (pi / 2, 0), (0, pi / 2), (0.4, -1.1)])
def test_forward(student, angles):
    """forward gives back where the hand is."""
    found, right = student(FILE).forward(*angles), hand(*angles)
    assert found == pytest.approx(right, abs=1e-6), (
        f"forward{angles}: {right[0]:.3f}, {right[1]:.3f} is right"
    )


@pytest.mark.parametrize("place", [(0.7, 0), (0, 0.6), (-0.3, 0.4)])
def test_inverse(student, place):
    """inverse gives back angles that bring the hand to the place."""
    found = hand(*student(FILE).inverse(*place))
    away = hypot(found[0] - place[0], found[1] - place[1])
    assert away < 1e-6, f"inverse{place} brings the hand to {found[0]:.3f}, {found[1]:.3f}"


def test_inverse_out_of_reach(student):
    """inverse raises a ValueError where the hand cannot come."""
    with pytest.raises(ValueError):  # noqa: PT011 - the handout names no message
        student(FILE).inverse(1, 1)


@pytest.mark.parametrize("angle", [0.5, -3, pi, 4, -4, 20])
def test_wrap(student, angle):
    """wrap gives back the same angle between -pi and pi."""
    found = student(FILE).wrap(angle)
    assert -pi < found <= pi, f"wrap({angle:.3f}) gives back {found:.3f}"
    assert cos(found - angle) == pytest.approx(1), f"wrap({angle:.3f}) gives back another angle, {found:.3f}"
