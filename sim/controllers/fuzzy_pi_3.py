"""Fuzzy-PI of chapter 3: from error, current and velocity error to voltage and its integral.

Rule 1 has both outputs. The voltage FzzP does not depend on the velocity error, so its table has
two inputs; the integrated FzzI has three (thesis 3.3.2, fig. 3.5, table 3.4).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, Inference, Universe, published_designs
from gaitswarm.sim.controllers.fixed_point import (
    CONTROL_PERIOD,
    CONVENTIONS,
    CURRENT_COUNTS,
    FRACTION_BITS,
    INTEGRAL_BITS,
    required,
    required_integer,
)
from gaitswarm.sim.controllers.fuzzy_pi import CURRENT, ERROR, SIGNED, MembershipSets, tabulated
from gaitswarm.sim.controllers.mamdani import Mamdani, Rule, Shape
from gaitswarm.sim.controllers.quantisation import Axis
from gaitswarm.sim.variables import listed_variables

_INTEGRAL_AXES: Final = {
    "error": Axis(bits=6, centred=True),
    "current": Axis(bits=4, centred=False),
    # A range of 30 000 counts/s is 60 counts per tick: 6 bits resolve every measurable value.
    "velocity": Axis(bits=6, centred=True),
}

_CONVENTIONS: Final = (
    *(CONVENTIONS[name] for name in ("large_begins", "small_ends", "positive_peak")),
    # Without extreme outputs, this universe contains all sets entirely.
    CONVENTIONS["universe"].model_copy(update={"default": 2.0}),
)

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


class FuzzyPi3:
    """The Fuzzy-PI of chapter 3."""

    name: Final = "fuzzy-pi-3"
    description: Final = (
        "Fuzzy-PI of chapter 3: voltage and integrated voltage by tables of angle error, motor"
        " current and velocity error; tuned together with the gait in the thesis."
    )
    variables: Final = listed_variables("fuzzy-pi-3")
    conventions: Final = _CONVENTIONS
    published: Final = published_designs("fuzzy-pi-3")

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
    w1, w2, w34, w56, w78 = weights
    sets = MembershipSets.of(design, _CONVENTIONS)
    inputs = {
        "error": Universe("error", "counts", error_range),
        "current": Universe("current", "A", current_range, counts=CURRENT_COUNTS),
    }
    voltage_range = required(design, "FzzP", low=1.0, high=32767.0)
    voltage = tabulated(
        voltage_system,
        (w1, w34, w56),
        Shape(required_integer(design, "FzzP_MF", low=1, high=3)),
        sets,
        inputs,
        {"error": error_axis, "current": current_axis},
        Universe("FzzP", "PWM counts", voltage_range, counts=1 << FRACTION_BITS),
    )
    rate_range = required(design, "FzzI", low=1.0, high=1e6)
    # The kernel's change of the error is over one tick.
    velocity = Universe("velocity", "counts/s", velocity_range, counts=CONTROL_PERIOD)
    rate = tabulated(
        integral_system,
        (w1, w2, w78),
        Shape(required_integer(design, "FzzI_MF", low=1, high=3)),
        sets,
        inputs | {"velocity": velocity},
        _INTEGRAL_AXES,
        Universe("FzzI", "PWM counts/s", rate_range, counts=CONTROL_PERIOD * (1 << INTEGRAL_BITS)),
    )
    return voltage, rate
