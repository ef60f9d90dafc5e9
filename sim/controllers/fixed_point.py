"""Conversion of design values to the integers of the microcontroller."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from gaitswarm.sim.arrays import Ints
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.variables import listed_variables

FRACTION_BITS: Final = 16
"""Of proportional gains and table index scales."""

INTEGRAL_BITS: Final = 32
"""Of the integrator: in its smallest unit, the smallest gain still keeps three digits."""

CONTROL_PERIOD: Final = 0.002
"""One control tick [s]."""

CURRENT_COUNTS: Final = 2079.0
"""Code of one ampere [counts/A], table 4.4."""

ANGLE_COUNTS: Final = 10430.0
"""Code of one radian [counts/rad], table 4.4."""

VOLT_COUNTS: Final = 511.0 / 11.3
"""PWM counts of one volt at the nominal supply [counts/V], table 4.4."""


CONVENTIONS: Final = {variable.name: variable for variable in listed_variables("convention")}
"""Choices that the thesis leaves open, with the defaults for designs that omit them, by name."""

INTEGRATOR_UNIT: Final = CONVENTIONS["integrator_unit"]
"""Unit of an integrator's gain; the thesis's table 4.4 says V/rad."""


def required(design: Mapping[str, float], name: str, *, low: float, high: float) -> float:
    """Return a design's value, checked against the bounds that the controller can represent.

    Args:
        design: Values by name.
        name: Of the value.
        low: Smallest value.
        high: Largest value.

    Raises:
        SimulationInputError: It is missing, not a number, or out of bounds.
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
    value = required(design, name, low=low, high=high)
    if not value.is_integer():
        raise SimulationInputError(f"{name}: {value:g} is not a whole number {low} to {high}")
    return int(value)


def to_fixed(value: float, fraction_bits: int) -> int:
    """Convert to the nearest fixed-point number.

    Args:
        value: To be represented.
        fraction_bits: Of the fixed-point number.
    """
    return math.floor(value * (1 << fraction_bits) + 0.5)


def descale(value: Ints, bits: int) -> Ints:
    """Fixed point to integer, halves up."""
    integer: Ints = (value + (1 << (bits - 1))) >> bits
    return integer


def integral_gain(design: Mapping[str, float]) -> int:
    """Return the integrator's gain in PWM counts per (error count x tick), with `INTEGRAL_BITS`.

    Args:
        design: Values by name, with the gain `I` and, if not the default, its unit.

    Raises:
        SimulationInputError: A value is missing or cannot be represented; names the variable.
    """
    gain = required(design, "I", low=0.0, high=100.0)
    unit = 0
    if INTEGRATOR_UNIT.name in design:
        unit = required_integer(design, INTEGRATOR_UNIT.name, low=0, high=2)
    # In PWM counts/(count s), V/rad at every control tick, and V/(rad s).
    per_tick = (
        CONTROL_PERIOD,
        VOLT_COUNTS / ANGLE_COUNTS,
        VOLT_COUNTS / ANGLE_COUNTS * CONTROL_PERIOD,
    )
    return to_fixed(gain * per_tick[unit], INTEGRAL_BITS)
