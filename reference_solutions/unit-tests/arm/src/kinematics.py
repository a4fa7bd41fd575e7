"""Where the hand of an arm with two joints is, and the angles that bring it to a place (m, rad)."""
from math import acos, atan2, cos, hypot, pi, sin

UPPER = 0.5
LOWER = 0.3


def forward(shoulder, elbow):
    x = UPPER * cos(shoulder) + LOWER * cos(shoulder + elbow)
    y = UPPER * sin(shoulder) + LOWER * sin(shoulder + elbow)
    return x, y


def inverse(x, y):
    reach = hypot(x, y)
    if reach > UPPER + LOWER or reach < UPPER - LOWER:
        raise ValueError('out of reach')
    elbow = acos((reach ** 2 - UPPER ** 2 - LOWER ** 2) / (2 * UPPER * LOWER))
    shoulder = atan2(y, x) - atan2(LOWER * sin(elbow), UPPER + LOWER * cos(elbow))
    return shoulder, elbow


def wrap(angle):
    return pi - (pi - angle) % (2 * pi)
