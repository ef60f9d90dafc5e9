"""Walks over CasADi's interpreter: the oracle of the compiled kernel, and its fallback."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel.control_tick import PythonKernel
from gaitswarm.sim.kernel.dynamics.physics_step import PhysicsModel, physics_model
from gaitswarm.sim.kernel.walk import INTEGRANDS, PEAKS, Coding, WalkSetup
from gaitswarm.sim.robot.robot import Robot


class ReferenceKernel(PythonKernel):
    """A robot's physics as CasADi interprets it."""

    backend: Final = "reference"

    def __init__(self, robot: Robot, model: PhysicsModel) -> None:
        super().__init__(robot)
        self._model, self.layout = model, model.layout

    def _physics(self, setup: WalkSetup, coding: Coding) -> Stepper:
        return Stepper(self._model, setup, coding, loose=self._robot.has_backlash)


class Stepper:
    """CasADi's kick and drift on fixed buffers: several times faster than calling the functions."""

    diverged = False

    def __init__(
        self, model: PhysicsModel, setup: WalkSetup, coding: Coding, *, loose: bool
    ) -> None:
        n_joints = setup.desired.shape[1]
        self._setup, self._coding, self._loose = setup, coding, loose
        self.q, self.v = setup.start.copy(), np.zeros(6 + n_joints)
        self._internal, self._parameters = setup.internal_state.copy(), setup.parameters.copy()
        self._duty, self._disturbance, self._current = np.zeros((3, n_joints))
        self._integrands, self.peaks = np.zeros(len(INTEGRANDS)), np.zeros(len(PEAKS))
        self.heights, self._landing = np.zeros(model.kick.numel_out(5)), np.zeros(1)
        self._timestep, self._push = (
            self._parameters[model.layout.slices[name]] for name in ("timestep", "push")
        )
        self._full_timestep, self._full_push = self._timestep.copy(), self._push.copy()
        self._time, self._refinement, self._left = np.zeros(1), 1, 0
        kicked = [np.zeros_like(array) for array in (self.v, self._internal)]
        drifted = [np.zeros_like(array) for array in (self.q, self._internal)]
        state = [self.q, self.v, self._internal]
        self._places = model.places
        self._placed = np.zeros((len(self.heights), 6))  # at the last step
        self._patches = np.zeros((len(self.heights), 3))
        patches = [] if setup.terrain is None else [self._patches.ravel()]
        self._kick = _buffered(
            model.kick,
            [*state, self._duty, self._disturbance, self._parameters, *patches],
            [*kicked, self._current, self._integrands, self.peaks, self.heights, self._landing],
        )
        self._drift = _buffered(model.drift, [*state, self._time], drifted)
        self._kicked = list(zip((self.v, self._internal), kicked, strict=True))
        self._drifted = list(zip((self.q, self._internal), drifted, strict=True))

    def state(self) -> tuple[Floats, Floats, Floats]:
        return self.q, self.v, self._internal

    def knees(self) -> Floats:
        return self._placed[:, 3:]

    def motors(self) -> tuple[Floats, Floats]:
        n = len(self._duty)
        angles, rates = self.q[7:], self.v[6:]
        if self._loose:
            angles, rates = self._internal[:n], self._internal[n : 2 * n]
        if self._left:
            # Between steps, positions are those of the next one's middle.
            angles = angles - 0.5 * self._timestep * rates
        return angles, rates

    def begin(self, tick: int) -> tuple[int, float]:
        setup, coding = self._setup, self._coding
        if setup.disturbance is not None:
            self._disturbance[:] = setup.disturbance[tick]
        begin, end = setup.shove_ticks
        self._push[:] = self._full_push * (begin <= tick < end)
        self._refinement = coding.refinement if self._landing[0] > 0.0 else 1
        self._timestep[:] = self._full_timestep / self._refinement
        self._left = self._refinement * coding.substeps
        self.drift(0.5)
        return self._left, setup.smoothing(self._refinement)

    def step(self, duty: Floats) -> tuple[Floats, Floats]:
        self._duty[:] = duty
        self.kick()
        self._left -= 1
        # A round of shorter steps ends, as a control tick, with half a drift.
        whole = self._left % self._coding.substeps
        for steps in (1.0,) if whole else (0.5, 0.5) if self._left else (0.5,):
            self.drift(steps)
        return self._integrands / self._refinement, np.abs(self._current)

    def kick(self) -> None:
        """Advance the velocities by a step in place; measurements are those of its middle."""
        if self._setup.terrain is not None:
            self._placed = np.asarray(self._places(self.q)).reshape(-1, 6)
            x, y, *_ = self._placed.T
            self._patches[:] = np.stack(self._setup.terrain.under(x, y), axis=1)
        self._kick[1]()
        for array, after in self._kicked:
            array[:] = after

    def drift(self, steps: float) -> None:
        """Advance the positions at these velocities in place."""
        self._time[:] = steps * self._timestep
        self._drift[1]()
        for array, after in self._drifted:
            array[:] = after


def _buffered(function: Any, inputs: Sequence[Floats], outputs: Sequence[Floats]) -> Any:
    """Bind a CasADi function to arrays; return its buffer, to be kept alive, and its evaluator."""
    buffer, evaluate = function.buffer()
    for k, array in enumerate(inputs):
        buffer.set_arg(k, array.data)
    for k, array in enumerate(outputs):
        buffer.set_res(k, array.data)
    return buffer, evaluate


@lru_cache(maxsize=8)
def reference_kernel(robot: Robot, *, uneven: bool = False) -> ReferenceKernel:
    return ReferenceKernel(robot, physics_model(robot, uneven=uneven))
