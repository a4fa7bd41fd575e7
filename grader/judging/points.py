"""Points are rounded as people round them: half up, in decimals."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal


def round_half_up(points: float, digits: int) -> float:
    """`round_half_up(2.25, 1)` is 2.3, where Python's own `round` says 2.2."""
    step = Decimal(1).scaleb(-digits)
    return float(Decimal(repr(points)).quantize(step, rounding=ROUND_HALF_UP))
