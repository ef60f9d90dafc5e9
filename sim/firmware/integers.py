"""Integer widths that a control law needs on a microcontroller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import ControlLaw, LookupTable, Response
from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, INTEGRAL_BITS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.walk import CODE_LIMIT, Coding, check_gains

_INT32: Final = (1 << 31) - 1

Narrow = TypeVar("Narrow", np.int16, np.uint16)

_NARROW: Final = 32
_WIDE: Final = 64


@dataclass(frozen=True, slots=True)
class Range:
    """Largest value of a number in the control tick."""

    name: str  # in tick.c
    meaning: str  # with its unit
    largest: int  # absolute
    bits: int  # of the integer that holds it, sign included


@dataclass(frozen=True, slots=True, eq=False)
class LawIntegers:
    """A control law in the integers of a microcontroller."""

    law: ControlLaw
    full_scale: int  # of the PWM [counts]
    pwm_step: int  # resolution of the PWM [counts]
    # width of numbers with 16 fraction bits, 32 or 64: the smaller one that suffices
    fine_bits: int
    ranges: tuple[Range, ...]

    @property
    def direct(self) -> LookupTable | None:
        return as_table(self.law.direct)

    @property
    def integrated(self) -> LookupTable | None:
        return as_table(self.law.integrated)


def law_integers(law: ControlLaw, coding: Coding) -> LawIntegers:
    """Bound every number of the control tick for any readings."""
    check_gains(law, torque=False)
    direct, integrated = as_table(law.direct), as_table(law.integrated)
    half = 1 << (FRACTION_BITS - 1)
    change = 2 * CODE_LIMIT
    products = max((_largest_product(t) for t in (direct, integrated) if t), default=0) + half
    now = (
        CODE_LIMIT * abs(law.proportional_gain)
        + change * abs(law.derivative_gain)
        + _largest_output(direct)
        + half
    )
    grown = (
        (coding.pwm_counts << INTEGRAL_BITS)
        + CODE_LIMIT * abs(law.integral_gain)
        + _largest_output(integrated)
        + (1 << (INTEGRAL_BITS - 1))
    )
    # The middle of an axis is added to its index; tables have fewer than 2^16 rows.
    fine = _NARROW if max(products, now) <= _INT32 - (1 << 16) else _WIDE
    return LawIntegers(
        law=law,
        full_scale=coding.pwm_counts,
        pwm_step=coding.pwm_step,
        fine_bits=fine,
        ranges=(
            Range("error", "angle error [counts]", CODE_LIMIT, _NARROW),
            Range("change", "of the error over a tick [counts]", change, _NARROW),
            Range("current", "absolute current [counts]", CODE_LIMIT, _NARROW),
            Range("index", "of a table, 16 fraction bits", products, fine),
            Range("now", "direct part [PWM counts], 16 fraction bits", now, fine),
            Range("grown", "integral part [PWM counts], 32 fraction bits", grown, _WIDE),
            Range("pwm", "output [PWM counts]", coding.pwm_counts, 16),
        ),
    )


def as_table(response: Response | None) -> LookupTable | None:
    if response is None or isinstance(response, LookupTable):
        return response
    raise SimulationInputError("firmware requires a table instead of an inference")


def in_16_bits(
    codes: NDArray[np.int64], kind: type[Narrow], what: str, joints: Sequence[str]
) -> NDArray[Narrow]:
    """Check and convert codes (T, J) [counts] to the robot's 16 bits.

    These hold angles of half a turn in either direction, and absolute currents.
    """
    limits = np.iinfo(kind)
    beyond = (codes < limits.min) | (codes > limits.max)
    if beyond.any():
        tick, joint = (int(index) for index in np.argwhere(beyond)[0])
        raise SimulationInputError(
            f"{what} of {joints[joint]} is {int(codes[tick, joint])} counts after {tick} ticks,"
            " which exceeds the firmware's 16 bits; leave this scenario out"
        )
    return codes.astype(kind)


def _largest_product(table: LookupTable) -> int:
    """Of a reading and its index gain."""
    return max(
        CODE_LIMIT * abs(table.error_gain),
        CODE_LIMIT * abs(table.current_gain),
        2 * CODE_LIMIT * abs(table.velocity_gain),
    )


def _largest_output(table: LookupTable | None) -> int:
    if table is None:
        return 0
    values = max(int(table.values.max()), -int(table.values.min()))
    return values * abs(table.output_gain)
