"""P of position-controlled servos, run by their firmware."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, Inference
from gaitswarm.sim.controllers.fixed_point import required
from gaitswarm.sim.variables import Variable

LARGEST_P: Final = 32767
"""Largest P that can be simulated [units of a register of 16 bits]."""


class ServoController:
    """The host sends the gait's joint angles; servos follow with P, a dead band and a PWM limit.

    Robots have P in units of their servos' register, and bounds for it in job.json.
    """

    name: Final = "servo"
    description: Final = (
        "Joint angles for position-controlled servos, whose firmware multiplies the error by P;"
        " needs such servos."
    )
    variables: Final = (
        Variable(
            name="P",
            low=4.0,
            high=128.0,
            unit="register",
            description="P gain of every servo whose gain can be set.",
        ),
    )
    conventions: Final[tuple[Variable, ...]] = ()
    published: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType({})

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        return ControlLaw(servo=required(design, "P", low=0.0, high=LARGEST_P))

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        del design
        return ()
