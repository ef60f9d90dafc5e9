"""The joint PD of torque-controlled actuators, in readable drivers: twin of torque.c."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import JointPd
from gaitswarm.sim.kernel.walk import Coding, WalkSetup
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.actuators import CONTROL_RATE

Floats = NDArray[np.float64]

_NONE: Final = JointPd()


class InnerLoop:
    """What a robot's actuators are given from inner tick to inner tick.

    A DC motor is given the voltage of the control tick.
    """

    def __init__(self, robot: Robot, setup: WalkSetup, coding: Coding) -> None:
        self._limit = robot.actuators().torque_limit if robot.is_torque_controlled else None
        self._setup, self._coding = setup, coding
        self._pd = setup.control_law.joint_pd or _NONE
        self._target: Floats = np.zeros(robot.n_joints)
        self._speed: Floats = self._target
        self._commanded: Floats = self._target

    def begin(self, tick: int, output: NDArray[np.int64]) -> None:
        """Begin a control tick.

        Args:
            output: Of the controllers, (J,) [counts].
        """
        self._commanded = output.astype(np.float64) * self._coding.duty_per_count
        if self._limit is None:
            return
        desired, carrying = self._setup.desired, self._setup.feed_forward
        later = min(tick + 1, len(desired) - 1)
        # The last target has no next one: the speed before it goes on.
        further = desired[later].astype(np.int64) - desired[max(later - 1, 0)]
        self._target = desired[tick] / self._coding.angle_counts
        self._speed = further / self._coding.angle_counts * float(CONTROL_RATE)
        if carrying is not None:
            share = self._pd.feed_forward * carrying[tick] / self._limit
            self._commanded = self._commanded + share

    def command(self, angles: Floats, rates: Floats) -> Floats:
        """What actuators are given, until the next inner tick.

        Args:
            angles: That their encoders see, (J,) [rad].
            rates: Likewise, (J,) [rad/s].

        Returns:
            Motor voltage per supply voltage, or torque per torque limit, (J,) [1].
        """
        if self._limit is None:
            return self._commanded
        torque = self._pd.stiffness * (self._target - angles)
        torque = torque + self._pd.damping * (self._speed - rates)
        share = self._commanded + torque * (1.0 / self._limit)
        # Of a NaN the lower bound, as in torque.c.
        command: Floats = np.fmin(np.fmax(share, -1.0), 1.0)
        return command
