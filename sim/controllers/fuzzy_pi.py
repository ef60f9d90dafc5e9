"""Fuzzy-PI of chapter 4: a Mamdani fuzzy-P as a quantised table, plus an integrator.

The proportional part answers to the angle error and the absolute motor current; high current
reverses the drive, which protects motor and battery (thesis table 4.3). What is simulated is what
is shipped: a 10 bit x 6 bit table of 8-bit outputs (section 5.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.controllers.base import Drive, LookupTable
from sim.controllers.fixed_point import (
    FRACTION_BITS,
    integral_gain,
    required,
    required_integer,
    to_fixed,
)
from sim.controllers.mamdani import FuzzySet, Mamdani, Rule, Shape
from sim.controllers.quantisation import OUTPUT_SCALE, Axis, quantised
from sim.variables import Variable

ERROR: Final = Axis(bits=10, centred=True)
CURRENT: Final = Axis(bits=6, centred=False)

_ERROR_SETS: Final = {
    "negative": FuzzySet(-1.0, 1.0),
    "zero": FuzzySet(0.0, 1.0),
    "positive": FuzzySet(1.0, 1.0),
}
_CURRENT_SETS: Final = {"small": FuzzySet(0.0, 1.0), "large": FuzzySet(1.0, 1.0)}
_OUTPUT_SETS: Final = {
    "null": FuzzySet(0.0, 0.5),
    "positive": FuzzySet(0.5, 0.5),
    "negative": FuzzySet(-0.5, 0.5),
    "positive-extreme": FuzzySet(1.0, 0.5),
    "negative-extreme": FuzzySet(-1.0, 0.5),
}


def inference_system(fw1: float, fw23: float, fw4: float, fw56: float, shape: Shape) -> Mamdani:
    """The rules of table 4.3 with their weights, over normalised error, current and output."""
    rules = (
        Rule({"error": "zero"}, "null", fw1),
        Rule({"error": "positive"}, "positive", fw23),
        Rule({"error": "negative"}, "negative", fw23),
        Rule({"error": "zero", "current": "small"}, "null", fw4),
        Rule({"error": "negative", "current": "large"}, "positive-extreme", fw56),
        Rule({"error": "positive", "current": "large"}, "negative-extreme", fw56),
    )
    inputs = {"error": _ERROR_SETS, "current": _CURRENT_SETS}
    return Mamdani(inputs, _OUTPUT_SETS, rules, shape)


@lru_cache(maxsize=256)
def quantised_table(
    fw1: float, fw23: float, fw4: float, fw56: float, shape: Shape
) -> NDArray[np.int8]:
    """The inference on the axes' grid in 1/127ths of the output range, (1024, 64), read-only."""
    system = inference_system(fw1, fw23, fw4, fw56, shape)
    return quantised(system, {"error": ERROR, "current": CURRENT})


class FuzzyPi:
    """See the module."""

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
            name="FI1R",
            low=1500,
            high=6000,
            unit="counts",
            description="Range of the angle error.",
        ),
        Variable(
            name="FI2R",
            low=6000,
            high=24000,
            unit="counts",
            description="Range of the current.",
        ),
        Variable(
            name="FOR",
            low=500,
            high=2000,
            unit="PWM counts",
            description="Range of the output.",
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
            name="FW23",
            low=0.1,
            high=1.0,
            description="Weight of rules 2, 3: follow the error.",
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
    published: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
        {
            "A": MappingProxyType(
                {
                    "I": 0.171,
                    "FI1R": 5837.0,
                    "FI2R": 20111.0,
                    "FOR": 781.0,
                    "FOMF": 2.0,
                    "FW1": 0.187,
                    "FW23": 0.961,
                    "FW4": 0.789,
                    "FW56": 0.927,
                }
            )
        }
    )

    def compile(self, design: Mapping[str, float]) -> Drive:
        """See `Controller.compile`."""
        error_range = required(design, "FI1R", low=64.0, high=65535.0)
        current_range = required(design, "FI2R", low=64.0, high=65535.0)
        output_range = required(design, "FOR", low=1.0, high=32767.0)
        weights = [required(design, w, low=0.0, high=1.0) for w in ("FW1", "FW23", "FW4", "FW56")]
        shape = Shape(required_integer(design, "FOMF", low=1, high=3))
        fw1, fw23, fw4, fw56 = weights
        return Drive(
            integral_gain=integral_gain(required(design, "I", low=0.0, high=100.0)),
            direct=LookupTable(
                values=quantised_table(fw1, fw23, fw4, fw56, shape)[:, :, np.newaxis],
                output_gain=to_fixed(output_range / OUTPUT_SCALE, FRACTION_BITS),
                error_gain=ERROR.gain(error_range),
                current_gain=CURRENT.gain(current_range),
            ),
        )
