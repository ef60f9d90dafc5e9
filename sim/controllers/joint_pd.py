"""Joint PD with feed-forward, run by torque-controlled actuators."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from gaitswarm.sim.controllers.base import ControlLaw, Inference, JointPd
from gaitswarm.sim.controllers.fixed_point import required
from gaitswarm.sim.variables import Variable

LARGEST_GAIN: Final = 1e5
"""Largest gain that can be simulated [N m/rad], [N m s/rad]."""


class JointPdController:
    """tau = K_p (q_d - q) + K_d (dq_d - dq) + share of the torque that carries the robot.

    The law of the low-level interfaces of the MIT Mini Cheetah (Katz, Di Carlo, Kim 2019), Solo
    (Grimminger et al. 2020) and commercial quadrupeds.
    """

    name: Final = "joint-pd"
    description: Final = (
        "PD on joint angle and speed with feed-forward of the weight, in the torque-controlled"
        " actuators at their own rate; needs such actuators."
    )
    variables: Final = (
        Variable(
            name="Kp", low=1.0, high=200.0, unit="N m/rad", description="Stiffness of every joint."
        ),
        Variable(
            name="Kd",
            low=0.02,
            high=5.0,
            unit="N m s/rad",
            description="Damping of every joint, against the speed of its desired angle.",
        ),
        Variable(
            name="feed_forward",
            low=0.0,
            high=1.0,
            unit="1",
            description="Share of the torque with which the legs on the ground carry the robot.",
        ),
    )
    conventions: Final[tuple[Variable, ...]] = ()
    published: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType({})

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        stiffness, damping = (required(design, k, low=0.0, high=LARGEST_GAIN) for k in ("Kp", "Kd"))
        share = required(design, "feed_forward", low=-10.0, high=10.0)
        return ControlLaw(joint_pd=JointPd(stiffness, damping, share))

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        del design
        return ()
