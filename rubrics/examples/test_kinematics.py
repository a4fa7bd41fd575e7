"""The tests that the example unit-tests runs on src/kinematics.py."""

from math import cos, pi, radians, sin

import pytest

FILE = "src/kinematics.py"


def hand(shoulder, elbow, upper=0.5, lower=0.3):
    """Return where the hand is."""
    x = upper * cos(shoulder) + lower * cos(shoulder + elbow)
    return x, upper * sin(shoulder) + lower * sin(shoulder + elbow)


def rounded(found):
    """Return numbers in brackets as the messages show them, and all else as it is."""
    return f"({', '.join(f'{n:.3f}' for n in found)})" if has_numbers(found) else found


def has_numbers(found):
    """Return whether it is two numbers."""
    return (
        isinstance(found, list | tuple) and len(found) == 2 and all(isinstance(n, int | float) for n in found)
    )


@pytest.mark.parametrize("angles", [(0, 0), (pi / 2, 0), (2.5, pi / 2), (0.4, -1.1)])
def test_forward(student, angles):
    """forward returns where the hand is."""
    found, right = student(FILE).forward(*angles), hand(*angles)
    call = f"forward({angles[0]:.3g}, {angles[1]:.3g})"
    taken = found == pytest.approx(hand(*map(radians, angles)), abs=1e-6)
    swapped = found == pytest.approx(hand(*angles, 0.3, 0.5), abs=1e-6)
    assert found == pytest.approx(right, abs=1e-6), (
        f"{call} should return ({right[0]:.3f}, {right[1]:.3f}), and returned {rounded(found)}"
        f"{': it takes its angles for degrees' if taken else ': the two lengths are swapped' if swapped else ''}"
    )


@pytest.mark.parametrize("place", [(0.7, 0), (0, 0.6), (-0.3, 0.4)])
def test_inverse(student, place):
    """inverse returns angles that bring the hand to the place."""
    angles = student(FILE).inverse(*place)
    assert has_numbers(angles), f"inverse{place} returned {angles}, not two angles"
    found, meant = hand(*angles), hand(*map(radians, angles))
    assert found == pytest.approx(place, abs=1e-6), (
        f"inverse{place} brings the hand to {rounded(found)}"
        f"{': its angles are in degrees' if meant == pytest.approx(place, abs=1e-6) else ''}"
    )


def test_inverse_out_of_reach(student):
    """inverse raises a ValueError for a place that the hand cannot reach."""
    with pytest.raises(ValueError):  # noqa: PT011 - the handout names no message
        student(FILE).inverse(1, 1)


@pytest.mark.parametrize("angle", [0.5, -3, pi, 4, -4, 20])
def test_wrap(student, angle):
    """wrap returns the same angle between -pi and pi."""
    found = student(FILE).wrap(angle)
    assert isinstance(found, int | float), f"wrap({angle:.3f}) returned {found}, not an angle"
    assert -pi < found <= pi, f"wrap({angle:.3f}) returned {found:.3f}, which is not between -pi and pi"
    assert cos(found - angle) == pytest.approx(1), (
        f"wrap({angle:.3f}) returned {found:.3f}, which is another angle"
    )
