"""Design values to the integers that the microcontroller computes with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.errors import SimulationInputError

FRACTION_BITS: Final = 16
"""Fractional bits of proportional gains and table index scales."""

INTEGRAL_BITS: Final = 20
"""Fractional bits of the integrator: at 500 Hz the smallest gain still keeps three digits."""

CONTROL_PERIOD: Final = 0.002
"""One control tick [s]."""


CURRENT_COUNTS: Final = 2079.0
"""Code of one ampere [counts/A], table 4.4."""


def required(design: Mapping[str, float], name: str, *, low: float, high: float) -> float:
    """A design's value, checked against what the controller can represent.

    Args:
        design: Values by name.
        name: Of the value.
        low: Least value.
        high: Largest value.

    Returns:
        The value.

    Raises:
        SimulationInputError: It is missing, no number, or out of bounds.
    """
    try:
        value = float(design[name])
    except KeyError:
        raise SimulationInputError(
            f"{name}: missing from the design, which has {', '.join(sorted(design)) or 'nothing'}"
        ) from None
    except (TypeError, ValueError):
        raise SimulationInputError(f"{name}: {design[name]!r} is not a number") from None
    if not low <= value <= high:
        raise SimulationInputError(f"{name}: {value:g} is outside [{low:g}, {high:g}]")
    return value


def required_integer(design: Mapping[str, float], name: str, *, low: int, high: int) -> int:
    """A design's whole value.

    Args:
        design: Values by name.
        name: Of the value.
        low: Least value.
        high: Largest value.

    Returns:
        The value.

    Raises:
        SimulationInputError: It is missing, not whole, or out of bounds.
    """
    value = required(design, name, low=low, high=high)
    if not value.is_integer():
        raise SimulationInputError(f"{name}: {value:g} is not a whole number {low} to {high}")
    return int(value)


def to_fixed(value: float, fraction_bits: int) -> int:
    """Nearest fixed-point number.

    Args:
        value: To be represented.
        fraction_bits: Of the fixed-point number.

    Returns:
        Its integer.
    """
    return math.floor(value * (1 << fraction_bits) + 0.5)


def descale(value: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    """Fixed point to integer, halves up.

    Args:
        value: Fixed-point numbers, of any shape.
        bits: Their fraction bits.

    Returns:
        Integers of the same shape.
    """
    integer: NDArray[np.int64] = (value + (1 << (bits - 1))) >> bits
    return integer


def integral_gain(gain: float) -> int:
    """Gain of the integrator in fixed point.

    Args:
        gain: PWM counts per (error count x second).

    Returns:
        PWM counts per (error count x tick), with `INTEGRAL_BITS` fraction bits.
    """
    return to_fixed(gain * CONTROL_PERIOD, INTEGRAL_BITS)
