"""Controllers without tables: P, PI and PID, joint PD, and P of servos."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, Inference, JointPd, published_designs
from gaitswarm.sim.controllers.fixed_point import (
    CONTROL_PERIOD,
    FRACTION_BITS,
    INTEGRATOR_UNIT,
    integral_gain,
    required,
    to_fixed,
)
from gaitswarm.sim.variables import Variable, listed_variables

LARGEST_GAIN: Final = 1e5
"""Largest gain of a joint PD that can be simulated [N m/rad], [N m s/rad]."""

LARGEST_P: Final = 32767
"""Largest P of servos that can be simulated [units of a register of 16 bits]."""


@dataclass(frozen=True, slots=True)
class LinearController:
    """A controller whose output is linear in the error, its integral and its derivative."""

    name: str
    description: str
    law: Callable[[Mapping[str, float]], ControlLaw]
    conventions: tuple[Variable, ...] = ()  # the unit of the integrator, if it has one

    @property
    def variables(self) -> tuple[Variable, ...]:
        return listed_variables(self.name)

    @property
    def published(self) -> Mapping[str, Mapping[str, float]]:
        return published_designs(self.name)

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        return self.law(design)

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        del design
        return ()


def _pid(terms: str) -> Callable[[Mapping[str, float]], ControlLaw]:
    """PWM = P error + I integral of error dt + D derivative of error; missing terms are zero."""

    def law(design: Mapping[str, float]) -> ControlLaw:
        gains = {name: required(design, name, low=0.0, high=100.0) for name in terms}
        return ControlLaw(
            proportional_gain=to_fixed(gains["P"], FRACTION_BITS),
            integral_gain=integral_gain(design) if "I" in gains else 0,
            derivative_gain=to_fixed(gains.get("D", 0.0) / CONTROL_PERIOD, FRACTION_BITS),
        )

    return law


def _joint_pd(design: Mapping[str, float]) -> ControlLaw:
    """tau = K_p (q_d - q) + K_d (dq_d - dq) + share of the torque that carries the robot.

    The law of the low-level interfaces of the MIT Mini Cheetah (Katz, Di Carlo, Kim 2019), Solo
    (Grimminger et al. 2020) and commercial quadrupeds.
    """
    stiffness, damping = (required(design, k, low=0.0, high=LARGEST_GAIN) for k in ("Kp", "Kd"))
    share = required(design, "feed_forward", low=-10.0, high=10.0)
    return ControlLaw(joint_pd=JointPd(stiffness, damping, share))


def _servo(design: Mapping[str, float]) -> ControlLaw:
    """Servos follow the gait's joint angles with P, a dead band and a PWM limit.

    Robots have P in units of their servos' register, and bounds for it in job.json.
    """
    return ControlLaw(servo=required(design, "P", low=0.0, high=LARGEST_P))


LINEAR_CONTROLLERS: Final = (
    LinearController(
        "p",
        "P on the angle error, in coded units (thesis 2.2.2); the robot's drive of 2011.",
        _pid("P"),
    ),
    LinearController(
        "pi",
        "PI on the angle error, in coded units (thesis 2.2.2, 3.4).",
        _pid("PI"),
        (INTEGRATOR_UNIT,),
    ),
    LinearController(
        "pid",
        "PID on the angle error, in coded units (thesis 2.2.2, 3.4).",
        _pid("PID"),
        (INTEGRATOR_UNIT,),
    ),
    LinearController(
        "joint-pd",
        "PD on joint angle and speed with feed-forward of the weight, in the torque-controlled"
        " actuators at their own rate; needs such actuators.",
        _joint_pd,
    ),
    LinearController(
        "servo",
        "Joint angles for position-controlled servos, whose firmware multiplies the error by P;"
        " needs such servos.",
        _servo,
    ),
)
