"""Proportional-integral controller in coded units (thesis 2.2.2, 3.4)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from sim.controllers.base import Drive
from sim.controllers.fixed_point import FRACTION_BITS, integral_gain, required, to_fixed
from sim.variables import Variable


class Pi:
    """PWM = P * error + I * integral of error dt."""

    name: Final = "pi"
    description: Final = "PI on the angle error, in coded units (thesis 2.2.2, 3.4)."
    variables: Final = (
        Variable(
            name="P", low=0.05, high=1.0, unit="PWM counts/count", description="Proportional gain."
        ),
        Variable(
            name="I", low=0.0, high=1.0, unit="PWM counts/(count s)", description="Integral gain."
        ),
    )
    published: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
        {"validation": MappingProxyType({"P": 0.25, "I": 0.0})}
    )

    def compile(self, design: Mapping[str, float]) -> Drive:
        """See `Controller.compile`."""
        p = required(design, "P", low=0.0, high=100.0)
        i = required(design, "I", low=0.0, high=100.0)
        return Drive(proportional_gain=to_fixed(p, FRACTION_BITS), integral_gain=integral_gain(i))
