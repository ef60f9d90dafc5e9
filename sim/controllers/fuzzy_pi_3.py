"""Fuzzy-PI of chapter 3: from error, current and velocity error to voltage and its integral.

Rule 1 has both outputs. The voltage FzzP does not depend on the velocity error, so its table has
two inputs; the integrated FzzI has three (thesis 3.3.2, fig. 3.5, table 3.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from gaitswarm.sim.controllers.base import ControlLaw, Inference, LookupTable, Universe
from gaitswarm.sim.controllers.fixed_point import (
    CONTROL_PERIOD,
    CURRENT_COUNTS,
    FRACTION_BITS,
    INTEGRAL_BITS,
    required,
    required_integer,
    to_fixed,
)
from gaitswarm.sim.controllers.fuzzy_sets import (
    LARGE_BEGINS,
    POSITIVE_PEAK,
    SIGNED,
    SMALL_ENDS,
    UNIVERSE,
    MembershipSets,
)
from gaitswarm.sim.controllers.mamdani import Mamdani, Rule, Shape
from gaitswarm.sim.controllers.quantisation import Axis, Quantised, quantised
from gaitswarm.sim.variables import Variable

ERROR: Final = Axis(bits=10, centred=True)
CURRENT: Final = Axis(bits=6, centred=False)
COARSE_ERROR: Final = Axis(bits=6, centred=True)
COARSE_CURRENT: Final = Axis(bits=4, centred=False)
VELOCITY: Final = Axis(bits=6, centred=True)
"""A range of 30 000 counts/s is 60 counts per tick, so 6 bits resolve every measurable value."""

_INTEGRAL_AXES: Final = {"error": COARSE_ERROR, "current": COARSE_CURRENT, "velocity": VELOCITY}

_CONVENTIONS: Final = (
    LARGE_BEGINS,
    SMALL_ENDS,
    POSITIVE_PEAK,
    # Without extreme outputs, this universe contains all sets entirely.
    UNIVERSE.model_copy(update={"default": 2.0}),
)

_COLUMNS: Final = (
    *("A_ERR", "I_MA", "V_ERR", "FzzP", "FzzI", "FzzP_MF", "FzzI_MF", "W1", "W2", "W34", "W56"),
    *("W78", "cycle_time", "stride", "height", "duty_factor", "fir_ms"),
)

_PUBLISHED: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        name: MappingProxyType(dict(zip(_COLUMNS, row, strict=True)))
        for name, row in (
            (
                "fuzzy-pso-ps",
                (
                    *(5126.0, 4.4, 11682.0, 2227.0, 2176.0, 2.0, 1.0, 0.066, 0.996, 0.215, 0.385),
                    *(0.783, 1.740, 0.163, 0.0364, 0.564, 12.0),
                ),
            ),
            (
                "fuzzy-pso",
                (
                    *(6369.0, 1.465, 12103.0, 2620.0, 6362.0, 2.0, 2.0, 0.234, 0.281, 0.496, 0.258),
                    *(0.502, 1.733, 0.161, 0.0329, 0.544, 33.0),
                ),
            ),
        )
    }
)
"""Optima of table 3.5, each with the gait tuned together with it."""

DEFAULT_SETS: Final = MembershipSets.of({}, _CONVENTIONS)


def voltage_system(
    w1: float, w34: float, w56: float, shape: Shape, sets: MembershipSets = DEFAULT_SETS
) -> Mamdani:
    """FzzP of angle error and current: rules 1 and 3 to 6."""
    rules = (
        Rule({"error": "zero"}, "null", w1),
        Rule({"error": "positive"}, "positive", w34),
        Rule({"error": "negative"}, "negative", w34),
        Rule({"error": "positive", "current": "large"}, "negative", w56),
        Rule({"error": "negative", "current": "large"}, "positive", w56),
    )
    inputs = {"error": SIGNED, "current": sets.amount}
    return Mamdani(inputs, sets.output, rules, shape, sets.universe)


def integral_system(
    w1: float, w2: float, w78: float, shape: Shape, sets: MembershipSets = DEFAULT_SETS
) -> Mamdani:
    """FzzI of angle error, current and velocity error: rules 1, 2, 7 and 8."""
    rules = (
        Rule({"error": "zero"}, "null", w1),
        Rule({"velocity": "zero"}, "null", w2),
        Rule({"velocity": "positive", "current": "small"}, "positive", w78),
        Rule({"velocity": "negative", "current": "small"}, "negative", w78),
    )
    inputs = {"error": SIGNED, "current": sets.amount, "velocity": SIGNED}
    return Mamdani(inputs, sets.output, rules, shape, sets.universe)


@lru_cache(maxsize=192)
def _voltage_table(
    w1: float,
    w34: float,
    w56: float,
    shape: Shape,
    sets: MembershipSets,
    error: Axis,
    current: Axis,
) -> Quantised:
    system = voltage_system(w1, w34, w56, shape, sets)
    return quantised(system, {"error": error, "current": current})


@lru_cache(maxsize=192)
def _integral_table(
    w1: float, w2: float, w78: float, shape: Shape, sets: MembershipSets
) -> Quantised:
    return quantised(integral_system(w1, w2, w78, shape, sets), _INTEGRAL_AXES)


class FuzzyPi3:
    """The Fuzzy-PI of chapter 3."""

    name: Final = "fuzzy-pi-3"
    description: Final = (
        "Fuzzy-PI of chapter 3: voltage and integrated voltage by tables of angle error, motor"
        " current and velocity error; tuned together with the gait in the thesis."
    )
    variables: Final = (
        Variable(
            name="A_ERR", low=500, high=10000, unit="counts", description="Range of the angle error"
        ),
        Variable(name="I_MA", low=1.0, high=6.0, unit="A", description="Range of the current."),
        Variable(
            name="V_ERR",
            low=1000,
            high=30000,
            unit="counts/s",
            description="Range of the velocity error.",
        ),
        Variable(
            name="FzzP", low=200, high=5000, unit="PWM counts", description="Range of the voltage."
        ),
        Variable(
            name="FzzI",
            low=500,
            high=10000,
            unit="PWM counts/s",
            description="Range of the integrated voltage's rate.",
        ),
        Variable(
            name="FzzP_MF",
            low=1,
            high=2,
            kind="integer",
            description="Membership functions of the voltage: 1 triangle, 2 Gauss.",
        ),
        Variable(
            name="FzzI_MF",
            low=1,
            high=2,
            kind="integer",
            description="Membership functions of the integrated voltage: 1 triangle, 2 Gauss.",
        ),
        Variable(name="W1", low=0.0, high=1.0, description="Weight of rule 1: error zero -> null."),
        Variable(
            name="W2", low=0.0, high=1.0, description="Weight of rule 2: velocity zero -> null."
        ),
        Variable(
            name="W34", low=0.0, high=1.0, description="Weight of rules 3, 4: follow the error."
        ),
        Variable(name="W56", low=0.0, high=1.0, description="Weight of rules 5, 6: current large."),
        Variable(
            name="W78", low=0.0, high=1.0, description="Weight of rules 7, 8: follow the velocity."
        ),
    )
    conventions: Final = _CONVENTIONS
    published: Final[Mapping[str, Mapping[str, float]]] = _PUBLISHED

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        return self.compile_with(design, ERROR, CURRENT)

    def compile_with(self, design: Mapping[str, float], error: Axis, current: Axis) -> ControlLaw:
        """Compile with a table of the voltage of another resolution."""
        voltage, rate = _inferences(design, error, current)
        return ControlLaw(direct=voltage.table, integrated=rate.table)

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        return _inferences(design, ERROR, CURRENT)


def _inferences(
    design: Mapping[str, float], error_axis: Axis, current_axis: Axis
) -> tuple[Inference, Inference]:
    """Inferences of the voltage, with these axes, and of the integrated voltage's rate."""
    error_range = required(design, "A_ERR", low=64.0, high=65535.0)
    current_range = required(design, "I_MA", low=0.1, high=30.0)
    velocity_range = required(design, "V_ERR", low=100.0, high=1e7)
    weights = [required(design, w, low=0.0, high=1.0) for w in ("W1", "W2", "W34", "W56", "W78")]
    error = Universe("error", "counts", error_range)
    current = Universe("current", "A", current_range, counts=CURRENT_COUNTS)
    # The kernel's change of the error is over one tick.
    velocity = Universe("velocity", "counts/s", velocity_range, counts=CONTROL_PERIOD)
    return (
        _voltage(design, weights, error, current, {"error": error_axis, "current": current_axis}),
        _integral(design, weights, error, current, velocity),
    )


def _voltage(
    design: Mapping[str, float],
    weights: Sequence[float],
    error: Universe,
    current: Universe,
    axes: Mapping[str, Axis],
) -> Inference:
    """FzzP. weights: W1, W2, W34, W56, W78."""
    w1, _, w34, w56, _ = weights
    full_range = required(design, "FzzP", low=1.0, high=32767.0)
    shape = Shape(required_integer(design, "FzzP_MF", low=1, high=3))
    sets = MembershipSets.of(design, _CONVENTIONS)
    table = _voltage_table(w1, w34, w56, shape, sets, axes["error"], axes["current"])
    return Inference(
        output=Universe("FzzP", "PWM counts", full_range, counts=1 << FRACTION_BITS),
        inputs={"error": error, "current": current},
        system=voltage_system(w1, w34, w56, shape, sets),
        axes=axes,
        table=LookupTable(
            values=table.values[:, :, np.newaxis],
            output_gain=to_fixed(full_range * table.step, FRACTION_BITS),
            error_gain=axes["error"].gain(error.full_range),
            current_gain=axes["current"].gain(current.full_range * current.counts),
        ),
    )


def _integral(
    design: Mapping[str, float],
    weights: Sequence[float],
    error: Universe,
    current: Universe,
    velocity: Universe,
) -> Inference:
    """FzzI. weights: W1, W2, W34, W56, W78."""
    w1, w2, _, _, w78 = weights
    full_range = required(design, "FzzI", low=1.0, high=1e6)
    shape = Shape(required_integer(design, "FzzI_MF", low=1, high=3))
    sets = MembershipSets.of(design, _CONVENTIONS)
    table = _integral_table(w1, w2, w78, shape, sets)
    counts = CONTROL_PERIOD * (1 << INTEGRAL_BITS)
    return Inference(
        output=Universe("FzzI", "PWM counts/s", full_range, counts=counts),
        inputs={"error": error, "current": current, "velocity": velocity},
        system=integral_system(w1, w2, w78, shape, sets),
        axes=_INTEGRAL_AXES,
        table=LookupTable(
            values=table.values,
            output_gain=to_fixed(full_range * CONTROL_PERIOD * table.step, INTEGRAL_BITS),
            error_gain=COARSE_ERROR.gain(error.full_range),
            current_gain=COARSE_CURRENT.gain(current.full_range * current.counts),
            velocity_gain=VELOCITY.gain(velocity.full_range * velocity.counts),
        ),
    )
