"""P, PI and PID controllers in coded units (thesis 2.2.2, 3.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, Inference
from gaitswarm.sim.controllers.fixed_point import (
    CONTROL_PERIOD,
    FRACTION_BITS,
    INTEGRATOR_UNIT,
    integral_gain,
    required,
    to_fixed,
)
from gaitswarm.sim.variables import Variable

_P: Final = Variable(
    name="P", low=0.05, high=1.0, unit="PWM counts/count", description="Proportional gain."
)
_I: Final = Variable(
    name="I", low=0.0, high=1.0, unit="PWM counts/(count s)", description="Integral gain."
)
_D: Final = Variable(
    name="D", low=0.0, high=0.02, unit="PWM counts s/count", description="Derivative gain."
)


@dataclass(frozen=True, slots=True)
class LinearController:
    """PWM = P error + I integral of error dt + D derivative of error; missing terms are zero."""

    name: str
    description: str
    variables: tuple[Variable, ...]
    conventions: tuple[Variable, ...]  # the unit of the integrator, if it has one
    published: Mapping[str, Mapping[str, float]]  # designs from the literature, by study

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        gains = {v.name: required(design, v.name, low=0.0, high=100.0) for v in self.variables}
        return ControlLaw(
            proportional_gain=to_fixed(gains["P"], FRACTION_BITS),
            integral_gain=integral_gain(design) if "I" in gains else 0,
            derivative_gain=to_fixed(gains.get("D", 0.0) / CONTROL_PERIOD, FRACTION_BITS),
        )

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        del design
        return ()


P: Final = LinearController(
    "p",
    "P on the angle error, in coded units (thesis 2.2.2); the robot's drive of 2011.",
    (_P,),
    (),
    MappingProxyType({"2011": MappingProxyType({"P": 0.25})}),
)
_GAIT: Final = ("P", "I", "cycle_time", "stride", "height", "duty_factor", "fir_ms")

# Optima of table 3.5, each with the gait tuned together with it.
_TUNED: Final = {
    "pi-pso-ps": (0.454, 0.147, 1.808, 0.168, 0.0397, 0.574, 93.0),
    "pi-pso": (0.340, 0.534, 1.696, 0.142, 0.0366, 0.577, 9.0),
}

PI: Final = LinearController(
    "pi",
    "PI on the angle error, in coded units (thesis 2.2.2, 3.4).",
    (_P, _I),
    (INTEGRATOR_UNIT,),
    MappingProxyType(
        {
            **{k: MappingProxyType(dict(zip(_GAIT, v, strict=True))) for k, v in _TUNED.items()},
            "validation": MappingProxyType({"P": 0.25, "I": 0.0}),
        }
    ),
)
PID: Final = LinearController(
    "pid",
    "PID on the angle error, in coded units (thesis 2.2.2, 3.4).",
    (_P, _I, _D),
    (INTEGRATOR_UNIT,),
    MappingProxyType({}),
)
