"""The Python driver of a walk over any physics: twin of driver.c, tick.c, control.c and inner.c."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats, Ints
from gaitswarm.sim.controllers.base import ControlLaw
from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, INTEGRAL_BITS, descale
from gaitswarm.sim.kernel.sensors import Sensors
from gaitswarm.sim.kernel.walk import (
    CODE_LIMIT,
    INTEGRANDS,
    PEAKS,
    Coding,
    LaneUse,
    WalkResult,
    WalkResults,
    WalkSetup,
    check_setups,
    coarsen,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.description import CONTROL_RATE
from gaitswarm.sim.robot.limbs import rotated
from gaitswarm.sim.robot.robot import Robot


class Physics(Protocol):
    """State of one walk, stepped in place."""

    peaks: Floats  # `PEAKS` of the last step
    heights: Floats  # of the soles above the ground at the last step (L,) [m]
    diverged: bool  # whether the last step left the engine's range

    def state(self) -> tuple[Floats, Floats, Floats]:
        """Return q, v and internal state, as in `WalkResult.states`."""

    def knees(self) -> Floats:
        """Return the places of the tibias' joints in the world (L, 3) [m], on uneven ground."""

    def motors(self) -> tuple[Floats, Floats]:
        """Return angles (J,) [rad] and rates (J,) [rad/s] that the encoders see."""

    def begin(self, tick: int) -> tuple[int, float]:
        """Begin a control tick; return its number of steps and the current's low-pass in each."""

    def step(self, duty: Floats) -> tuple[Floats, Floats]:
        """Return `INTEGRANDS`, by the step's share of a usual one, and absolute currents (J,)."""


class PythonKernel(ABC):
    """Walks one after the other, some hundred times slower than the compiled kernel."""

    lanes: Final = 1

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    @abstractmethod
    def _physics(self, setup: WalkSetup, coding: Coding) -> Physics:
        """Return the physics of a walk at its start."""

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """Compute the walks one after the other."""
        check_setups(self._robot, setups)
        walks = [self._walk(setup, coding, log=log) for setup in setups]
        rounds = sum(walked for _, walked in walks)
        return WalkResults(tuple(result for result, _ in walks), LaneUse(rounds, rounds))

    def _walk(self, setup: WalkSetup, coding: Coding, *, log: bool) -> tuple[WalkResult, int]:
        """Return the result of a walk and its number of rounds of physics steps."""
        n_joints = self._robot.n_joints
        physics, sensors = self._physics(setup, coding), Sensors(setup.sensors)
        controllers = Controllers(setup.control_law, coding, n_joints)
        inner, sensed = InnerLoop(self._robot, setup, coding), np.zeros(n_joints)
        sums, peaks = np.zeros(len(INTEGRANDS)), np.zeros(len(PEAKS))
        lifted, clearance = np.zeros(len(self._robot.legs)), math.inf
        width = 13 + 4 * n_joints + len(setup.internal_state)
        states = np.full((setup.ticks, width), np.nan) if log else None
        status, rounds = Status.OK, 0
        for tick, desired in enumerate(setup.desired):
            angles, rates = physics.motors()
            inner.begin(tick, controllers.output(*sensors.read(angles, sensed), desired))
            duty = inner.command(angles, rates)
            if states is not None:
                states[tick] = np.concatenate([*physics.state(), sensed, duty])
            steps, smoothing = physics.begin(tick)
            rounds += steps // coding.substeps
            for walked in range(steps):
                if walked and walked % (steps // coding.inner_ticks) == 0:
                    duty = inner.command(*physics.motors())
                integrands, current = physics.step(duty)
                sensed = current if smoothing >= 1.0 else sensed + smoothing * (current - sensed)
                sums += integrands
                peaks, lifted = (
                    np.maximum(peaks, physics.peaks),
                    np.maximum(lifted, physics.heights),
                )
                if physics.diverged:
                    break
            if not physics.diverged and (tick + 1) % setup.cycle == 0:
                clearance, lifted = min(clearance, float(lifted.min())), np.zeros_like(lifted)
            status = _status(physics, setup)
            if status is not Status.OK:
                break
        end = physics.state()[0].copy()
        return WalkResult(status, sums, end, peaks, clearance, states), rounds


def _status(physics: Physics, setup: WalkSetup) -> Status:
    """Return the status at the end of a tick."""
    (q, *rest), grid = physics.state(), setup.terrain
    if physics.diverged or not all(np.isfinite(array).all() for array in (q, *rest)):
        return Status.DIVERGED
    upright = 1.0 - 2.0 * (q[3] * q[3] + q[4] * q[4])
    height = q[2] if grid is None else q[2] - grid.height(*q[:2])
    if height < setup.fall_height or upright < setup.fall_cosine:
        return Status.FELL
    if grid is not None:
        x, y, z = np.concatenate([physics.knees(), q[:3] + rotated(q[3:7], setup.corners)]).T
        if (z < grid.height(x, y)).any():
            return Status.STRUCK
    return Status.OK


class Controllers:
    """The control law of every joint from tick to tick (thesis 5.3)."""

    def __init__(self, law: ControlLaw, coding: Coding, n_joints: int) -> None:
        self._law, self._coding = law, coding
        # Integrators [counts, with `INTEGRAL_BITS` fraction bits].
        self._integral: Ints = np.zeros(n_joints, dtype=np.int64)
        self._error: Ints | None = None  # of the previous tick [counts]

    def output(self, angles: Floats, current: Floats, desired: NDArray[np.int32]) -> Ints:
        """Return the PWM (J,) [counts] for readings (J,) in [rad] and [A]."""
        law, coding = self._law, self._coding
        load = coding.current_codes(current)
        error = desired.astype(np.int64) - coding.angle_codes(angles)
        error = np.clip(error, -CODE_LIMIT, CODE_LIMIT)
        change = np.zeros_like(error) if self._error is None else error - self._error
        direct = error * law.proportional_gain + change * law.derivative_gain
        grown = self._integral + error * law.integral_gain
        if law.direct is not None:
            direct = direct + law.direct.respond(error, load, change)
        if law.integrated is not None:
            grown = grown + law.integrated.respond(error, load, change)
        full, limit = coding.pwm_counts << INTEGRAL_BITS, coding.pwm_counts
        self._error, self._integral = error, np.clip(grown, -full, full)
        output = descale(direct, FRACTION_BITS) + descale(self._integral, INTEGRAL_BITS)
        coarse = coarsen(np.clip(output, -limit, limit), coding.pwm_step)
        pwm: Ints = np.clip(coarse, -limit, limit)
        return pwm


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
