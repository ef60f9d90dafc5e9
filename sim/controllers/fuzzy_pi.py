"""Fuzzy-PI of chapter 4: a Mamdani fuzzy-P as a quantised table, plus an integrator.

The inputs of the proportional part are the angle error and the absolute motor current; a high
current reverses the motor, which protects motor and battery (thesis table 4.3). Simulations use the
table of the robot: 10 bit x 6 bit with 8-bit outputs (section 5.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from gaitswarm.sim.controllers.base import ControlLaw, Inference, LookupTable, Universe
from gaitswarm.sim.controllers.fixed_point import (
    FRACTION_BITS,
    INTEGRATOR_UNIT,
    integral_gain,
    required,
    required_integer,
    to_fixed,
)
from gaitswarm.sim.controllers.fuzzy_sets import (
    EXTREME_PEAK,
    LARGE_BEGINS,
    POSITIVE_PEAK,
    SIGNED,
    SMALL_ENDS,
    UNIVERSE,
    MembershipSets,
)
from gaitswarm.sim.controllers.mamdani import Mamdani, Rule, Shape
from gaitswarm.sim.controllers.quantisation import Axis, ExactInference, Quantised, quantised
from gaitswarm.sim.variables import Variable

ERROR: Final = Axis(bits=10, centred=True)
CURRENT: Final = Axis(bits=6, centred=False)

_CONVENTIONS: Final = (
    INTEGRATOR_UNIT,
    LARGE_BEGINS,
    SMALL_ENDS,
    POSITIVE_PEAK,
    EXTREME_PEAK,
    UNIVERSE,
)

_COLUMNS: Final = ("I", "FI1R", "FI2R", "FOR", "FOMF", "FW1", "FW23", "FW4", "FW56")

_PUBLISHED: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        name: MappingProxyType(dict(zip(_COLUMNS, row, strict=True)))
        for name, row in (
            ("A", (0.171, 5837.0, 20111.0, 781.0, 2.0, 0.187, 0.961, 0.789, 0.927)),
            ("B", (0.160, 5400.0, 18693.0, 500.0, 3.0, 0.347, 0.972, 0.592, 0.814)),
            ("C", (0.607, 5629.0, 18242.0, 527.0, 3.0, 0.581, 0.889, 0.702, 0.188)),
        )
    }
)
"""Optima of table 4.6, by preference."""

DEFAULT_SETS: Final = MembershipSets.of({}, _CONVENTIONS)


def inference_system(
    fw1: float,
    fw23: float,
    fw4: float,
    fw56: float,
    shape: Shape,
    sets: MembershipSets = DEFAULT_SETS,
) -> Mamdani:
    """The rules of table 4.3, over normalised error, current and output."""
    rules = (
        Rule({"error": "zero"}, "null", fw1),
        Rule({"error": "positive"}, "positive", fw23),
        Rule({"error": "negative"}, "negative", fw23),
        Rule({"error": "zero", "current": "small"}, "null", fw4),
        Rule({"error": "negative", "current": "large"}, "positive-extreme", fw56),
        Rule({"error": "positive", "current": "large"}, "negative-extreme", fw56),
    )
    inputs = {"error": SIGNED, "current": sets.amount}
    return Mamdani(inputs, sets.output, rules, shape, sets.universe)


@lru_cache(maxsize=192)
def quantised_table(
    fw1: float,
    fw23: float,
    fw4: float,
    fw56: float,
    shape: Shape,
    sets: MembershipSets = DEFAULT_SETS,
    error: Axis = ERROR,
    current: Axis = CURRENT,
) -> Quantised:
    """Return the inference of `inference_system` as (n_error, n_current) 8-bit values."""
    system = inference_system(fw1, fw23, fw4, fw56, shape, sets)
    return quantised(system, {"error": error, "current": current})


class FuzzyPi:
    """The Fuzzy-PI of chapter 4."""

    name: Final = "fuzzy-pi"
    description: Final = (
        "Fuzzy-PI of chapter 4: fuzzy-P of angle error and motor current as a 10x6x8 bit table,"
        " plus an integrator."
    )
    variables: Final = (
        Variable(
            name="I",
            low=0.1,
            high=1.0,
            unit="PWM counts/(count s)",
            description="Gain of the integrator.",
        ),
        Variable(
            name="FI1R", low=1500, high=6000, unit="counts", description="Range of the angle error."
        ),
        Variable(
            name="FI2R", low=6000, high=24000, unit="counts", description="Range of the current."
        ),
        Variable(
            name="FOR", low=500, high=2000, unit="PWM counts", description="Range of the output."
        ),
        Variable(
            name="FOMF",
            low=1,
            high=3,
            unit="1",
            kind="integer",
            description="Output membership functions: 1 triangle, 2 Gauss, 3 pi.",
        ),
        Variable(name="FW1", low=0.1, high=1.0, description="Weight of rule 1: zero -> null."),
        Variable(
            name="FW23", low=0.1, high=1.0, description="Weight of rules 2, 3: follow the error."
        ),
        Variable(
            name="FW4",
            low=0.1,
            high=1.0,
            description="Weight of rule 4: zero, current small -> null.",
        ),
        Variable(
            name="FW56",
            low=0.1,
            high=1.0,
            description="Weight of rules 5, 6: current large -> reverse.",
        ),
    )
    conventions: Final = _CONVENTIONS
    published: Final[Mapping[str, Mapping[str, float]]] = _PUBLISHED

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        return self.compile_with(design, ERROR, CURRENT)

    def compile_with(self, design: Mapping[str, float], error: Axis, current: Axis) -> ControlLaw:
        """Compile the controller with a table of another resolution.

        Args:
            design: Value of every variable, by name.
            error: Axis of the error.
            current: Axis of the current.
        """
        p = _Parameters.of(design)
        return ControlLaw(integral_gain=p.integral, direct=p.table(error, current))

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        p = _Parameters.of(design)
        fuzzy_p = Inference(
            output=Universe("FO", "PWM counts", p.output_range, counts=1 << FRACTION_BITS),
            inputs={
                "error": Universe("error", "counts", p.error_range),
                "current": Universe("current", "counts", p.current_range),
            },
            system=inference_system(*p.weights, p.shape, p.sets),
            axes={"error": ERROR, "current": CURRENT},
            table=p.table(ERROR, CURRENT),
        )
        return (fuzzy_p,)

    def without_table(self, design: Mapping[str, float]) -> ControlLaw:
        """Compile the controller with full inference, for the reference kernel only.

        Args:
            design: Value of every variable, by name.
        """
        p = _Parameters.of(design)
        system = inference_system(*p.weights, p.shape, p.sets)
        exact = ExactInference(system, p.error_range, p.current_range, p.output_range)
        return ControlLaw(integral_gain=p.integral, direct=exact)


@dataclass(frozen=True, slots=True)
class _Parameters:
    """A design's checked values. weights: FW1, FW23, FW4, FW56."""

    integral: int
    error_range: float
    current_range: float
    output_range: float
    weights: tuple[float, float, float, float]
    shape: Shape
    sets: MembershipSets

    @classmethod
    def of(cls, design: Mapping[str, float]) -> _Parameters:
        fw1, fw23, fw4, fw56 = (
            required(design, name, low=0.0, high=1.0) for name in ("FW1", "FW23", "FW4", "FW56")
        )
        return cls(
            integral=integral_gain(design),
            error_range=required(design, "FI1R", low=64.0, high=65535.0),
            current_range=required(design, "FI2R", low=64.0, high=65535.0),
            output_range=required(design, "FOR", low=1.0, high=32767.0),
            weights=(fw1, fw23, fw4, fw56),
            shape=Shape(required_integer(design, "FOMF", low=1, high=3)),
            sets=MembershipSets.of(design, _CONVENTIONS),
        )

    def table(self, error: Axis, current: Axis) -> LookupTable:
        table = quantised_table(*self.weights, self.shape, self.sets, error, current)
        return LookupTable(
            values=table.values[:, :, np.newaxis],
            output_gain=to_fixed(self.output_range * table.step, FRACTION_BITS),
            error_gain=error.gain(self.error_range),
            current_gain=current.gain(self.current_range),
        )
