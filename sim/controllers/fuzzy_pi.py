"""Fuzzy-PI of chapter 4: a Mamdani fuzzy-P as a quantised table, plus an integrator.

The inputs of the proportional part are the angle error and the absolute motor current; a high
current reverses the motor, which protects motor and battery (thesis table 4.3). Simulations use the
table of the robot: 10 bit x 6 bit with 8-bit outputs (section 5.3).

The thesis draws but does not list the membership functions. Choices that the drawings leave open
are conventions, which a design may set. With the default sets, table 4.3's own weights and the
published optima A and B reverse the drive at extreme current, as in 4.3.2 and fig. 4.5; see
docs/model.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import Final, NamedTuple

from gaitswarm.sim.controllers.base import (
    ControlLaw,
    Inference,
    LookupTable,
    Universe,
    published_designs,
)
from gaitswarm.sim.controllers.fixed_point import (
    CONVENTIONS,
    FRACTION_BITS,
    integral_gain,
    required,
    required_integer,
    to_fixed,
)
from gaitswarm.sim.controllers.mamdani import FuzzySet, Mamdani, Rule, Shape
from gaitswarm.sim.controllers.quantisation import Axis, ExactInference, Quantised, quantised
from gaitswarm.sim.variables import Variable, listed_limits, listed_variables

ERROR: Final = Axis(bits=10, centred=True)
CURRENT: Final = Axis(bits=6, centred=False)

SIGNED: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {"negative": FuzzySet(-1.0, 1.0), "zero": FuzzySet(0.0, 1.0), "positive": FuzzySet(1.0, 1.0)}
)
"""Sets of an angle or velocity error."""

_LIMITS: Final = listed_limits("convention")


class MembershipSets(NamedTuple):
    """Sets of a current's absolute value and of an output, by the conventions of the same names."""

    large_begins: float
    small_ends: float
    positive_peak: float
    universe: float
    extreme_peak: float | None = None  # None for an output without extremes

    @classmethod
    def of(cls, design: Mapping[str, float], conventions: Collection[Variable]) -> MembershipSets:
        values = {v.name: v.default for v in conventions if v.default is not None} | dict(design)
        return cls(
            **{
                v.name: required(values, v.name, low=_LIMITS[v.name][0], high=_LIMITS[v.name][1])
                for v in conventions
                if v.name in _LIMITS
            }
        )

    @property
    def amount(self) -> dict[str, FuzzySet]:
        """Sets of a current's absolute value."""
        return {
            "small": FuzzySet(0.0, self.small_ends),
            "large": FuzzySet(1.0, 1.0 - self.large_begins),
        }

    @property
    def output(self) -> dict[str, FuzzySet]:
        """Sets of the output."""
        peaks = {"null": 0.0, "positive": self.positive_peak, "negative": -self.positive_peak}
        if self.extreme_peak is not None:
            peaks["positive-extreme"] = self.extreme_peak
            peaks["negative-extreme"] = -self.extreme_peak
        return {name: FuzzySet(peak, self.positive_peak) for name, peak in peaks.items()}


System = Callable[..., Mamdani]
"""Returns an inference for the weights of its rules, the outputs' shape, and sets."""


@lru_cache(maxsize=384)
def _table(
    system: System,
    weights: tuple[float, ...],
    shape: Shape,
    sets: MembershipSets,
    axes: tuple[tuple[str, Axis], ...],
) -> Quantised:
    return quantised(system(*weights, shape, sets), dict(axes))


def tabulated(
    system: System,
    weights: Sequence[float],
    shape: Shape,
    sets: MembershipSets,
    inputs: Mapping[str, Universe],
    axes: Mapping[str, Axis],
    output: Universe,
) -> Inference:
    """Return an inference with its table; `counts` of the output are fixed-point ones."""
    table = _table(system, tuple(weights), shape, sets, tuple(axes.items()))
    gains = {
        f"{name}_gain": axes[name].gain(universe.full_range * universe.counts)
        for name, universe in inputs.items()
    }
    return Inference(
        output=output,
        inputs=inputs,
        system=system(*weights, shape, sets),
        axes=axes,
        table=LookupTable(
            values=table.values.reshape((*table.values.shape, 1)[:3]),
            output_gain=to_fixed(output.full_range * output.counts * table.step, 0),
            **gains,
        ),
    )


DEFAULT_SETS: Final = MembershipSets.of({}, CONVENTIONS.values())


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


class FuzzyPi:
    """The Fuzzy-PI of chapter 4."""

    name: Final = "fuzzy-pi"
    description: Final = (
        "Fuzzy-PI of chapter 4: fuzzy-P of angle error and motor current as a 10x6x8 bit table,"
        " plus an integrator."
    )
    variables: Final = listed_variables("fuzzy-pi")
    conventions: Final = tuple(CONVENTIONS.values())
    published: Final = published_designs("fuzzy-pi")

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        return self.compile_with(design, ERROR, CURRENT)

    def compile_with(self, design: Mapping[str, float], error: Axis, current: Axis) -> ControlLaw:
        """Compile the controller with a table of another resolution.

        Args:
            design: Value of every variable, by name.
            error: Axis of the error.
            current: Axis of the current.
        """
        table = self._inference(design, error, current).table
        return ControlLaw(integral_gain=integral_gain(design), direct=table)

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        return (self._inference(design, ERROR, CURRENT),)

    def without_table(self, design: Mapping[str, float]) -> ControlLaw:
        """Compile the controller with full inference, for the reference kernel only.

        Args:
            design: Value of every variable, by name.
        """
        fuzzy = self._inference(design, ERROR, CURRENT)
        error, current = (fuzzy.inputs[name].full_range for name in ("error", "current"))
        exact = ExactInference(fuzzy.system, error, current, fuzzy.output.full_range)
        return ControlLaw(integral_gain=integral_gain(design), direct=exact)

    def _inference(self, design: Mapping[str, float], error: Axis, current: Axis) -> Inference:
        names = ("FW1", "FW23", "FW4", "FW56")
        weights = [required(design, name, low=0.0, high=1.0) for name in names]
        ranges = {
            name: Universe(name, "counts", required(design, variable, low=64.0, high=65535.0))
            for name, variable in (("error", "FI1R"), ("current", "FI2R"))
        }
        full_range = required(design, "FOR", low=1.0, high=32767.0)
        return tabulated(
            inference_system,
            weights,
            Shape(required_integer(design, "FOMF", low=1, high=3)),
            MembershipSets.of(design, self.conventions),
            ranges,
            {"error": error, "current": current},
            Universe("FO", "PWM counts", full_range, counts=1 << FRACTION_BITS),
        )
