"""Control tick and inner loop of the Python drivers: twins of tick.c, control.c and inner.c."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats, Ints
from gaitswarm.sim.controllers.base import ControlLaw
from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, INTEGRAL_BITS, descale
from gaitswarm.sim.kernel.walk import CODE_LIMIT, Coding, WalkSetup, coarsen
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.description import CONTROL_RATE
from gaitswarm.sim.robot.limbs import rotated
from gaitswarm.sim.robot.robot import Robot


@dataclass(slots=True)
class Past:
    """State of the controllers between ticks, (J,) each."""

    integral: Ints  # integrators [counts, with `INTEGRAL_BITS` fraction bits]
    error: Ints | None = None  # of the previous tick [counts]; None before the first

    @classmethod
    def of(cls, n_joints: int) -> Past:
        return cls(np.zeros(n_joints, dtype=np.int64))


def low_pass(sensed: Floats, current: Floats, smoothing: float) -> Floats:
    """Advance the filtered absolute currents (J,) [A] by a step, by a share of the distance."""
    return current.copy() if smoothing >= 1.0 else sensed + smoothing * (current - sensed)


def coded(
    angles: Floats, current: Floats, desired: NDArray[np.int32], coding: Coding
) -> tuple[Ints, Ints]:
    """Return angle error and absolute current, (J,) [counts], of readings in [rad] and [A]."""
    error = desired.astype(np.int64) - coding.angle_codes(angles)
    return np.clip(error, -CODE_LIMIT, CODE_LIMIT), coding.current_codes(current)


def control(law: ControlLaw, coding: Coding, error: Ints, load: Ints, past: Past) -> Ints:
    """Run a tick of all controllers (thesis 5.3): error and load to PWM, (J,) [counts]."""
    change = np.zeros_like(error) if past.error is None else error - past.error
    direct = error * law.proportional_gain + change * law.derivative_gain
    grown = past.integral + error * law.integral_gain
    if law.direct is not None:
        direct = direct + law.direct.respond(error, load, change)
    if law.integrated is not None:
        grown = grown + law.integrated.respond(error, load, change)
    full, limit = coding.pwm_counts << INTEGRAL_BITS, coding.pwm_counts
    past.error, past.integral = error, np.clip(grown, -full, full)
    output = descale(direct, FRACTION_BITS) + descale(past.integral, INTEGRAL_BITS)
    coarse = coarsen(np.clip(output, -limit, limit), coding.pwm_step)
    pwm: Ints = np.clip(coarse, -limit, limit)
    return pwm


def status_of(
    q: Floats,
    v: Floats,
    internal_state: Floats,
    setup: WalkSetup,
    knees: Floats | None = None,
) -> Status:
    """Return the status at the end of a tick; `knees` (L, 3) [m] are required on uneven ground."""
    if not all(np.isfinite(array).all() for array in (q, v, internal_state)):
        return Status.DIVERGED
    upright = 1.0 - 2.0 * (q[3] * q[3] + q[4] * q[4])
    grid = setup.terrain
    height = q[2] if grid is None else q[2] - grid.height(*q[:2])
    if height < setup.fall_height or upright < setup.fall_cosine:
        return Status.FELL
    if grid is not None and knees is not None:
        x, y, z = np.concatenate([knees, q[:3] + rotated(q[3:7], setup.corners)]).T
        if (z < grid.height(x, y)).any():
            return Status.STRUCK
    return Status.OK


def padded_states(rows: Sequence[Floats], ticks: int) -> Floats:
    """Pad the logged states to all ticks, as in `WalkResult`."""
    states = np.full((ticks, len(rows[0])), np.nan)
    states[: len(rows)] = rows
    return states


class InnerLoop:
    """Commands to actuators from inner tick to inner tick; DC motors keep their voltage."""

    def __init__(self, robot: Robot, setup: WalkSetup, coding: Coding) -> None:
        self._limit = robot.actuators().torque_limit if robot.is_torque_controlled else None
        self._setup, self._coding = setup, coding
        self._servos, self._law = robot.servos, setup.control_law.inner
        self._target: Floats = np.zeros(robot.n_joints)
        self._speed: Floats = self._target
        self._commanded: Floats = self._target

    def begin(self, tick: int, output: NDArray[np.int64]) -> None:
        """Begin a control tick with the controllers' output (J,) [counts]."""
        self._commanded = output.astype(np.float64) * self._coding.duty_per_count
        desired, carrying = self._setup.desired, self._setup.feed_forward
        if self._servos is not None:
            codes = desired[tick].astype(np.int64)
            self._target = coarsen(codes, self._coding.angle_step).astype(np.float64)
        if self._limit is None:
            return
        later = min(tick + 1, len(desired) - 1)
        # The last target has no successor: the speed before it continues.
        further = desired[later].astype(np.int64) - desired[max(later - 1, 0)]
        self._target = desired[tick] / self._coding.angle_counts
        self._speed = further / self._coding.angle_counts * float(CONTROL_RATE)
        if carrying is not None:
            share = self._law[2] * carrying[tick] / self._limit
            self._commanded = self._commanded + share

    def command(self, angles: Floats, rates: Floats) -> Floats:
        """Return the duty (J,) for angles [rad] and rates [rad/s] that the encoders see."""
        stiffness, damping, _ = self._law
        if self._servos is not None:
            tunable, fixed, dead_band, limit = self._servos
            error = self._target - self._coding.angle_codes(angles)
            error = np.where(np.abs(error) > dead_band, error, 0.0)
            share = self._commanded + error * (stiffness * tunable + damping * fixed)
            duty: Floats = np.fmin(np.fmax(share, -limit), limit)
            return duty
        if self._limit is None:
            return self._commanded
        torque = stiffness * (self._target - angles)
        torque = torque + damping * (self._speed - rates)
        share = self._commanded + torque * (1.0 / self._limit)
        # A NaN becomes the lower bound, as in inner.c.
        command: Floats = np.fmin(np.fmax(share, -1.0), 1.0)
        return command
