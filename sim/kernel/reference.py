"""The Python driver, over CasADi's interpreter: the oracle of driver.c, and its fallback"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel.control_tick import (
    InnerLoop,
    Past,
    coded,
    control,
    low_pass,
    padded_states,
    status_of,
)
from gaitswarm.sim.kernel.dynamics.physics_step import PhysicsModel, physics_model
from gaitswarm.sim.kernel.sensors import Sensors
from gaitswarm.sim.kernel.walk import (
    INTEGRANDS,
    PEAKS,
    Coding,
    LaneUse,
    WalkResult,
    WalkResults,
    WalkSetup,
    check_gains,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.robot import Robot


class ReferenceKernel:
    """Walks over CasADi's interpreter, some hundred times slower than the compiled kernel."""

    backend: Final = "reference"
    lanes: Final = 1

    def __init__(self, robot: Robot, model: PhysicsModel) -> None:
        self._model, self._robot = model, robot
        self.layout = model.layout
        self.internal_state_size = model.kick.numel_in(2)

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """Compute the walks one after the other."""
        for setup in setups:
            check_gains(
                setup.control_law,
                torque=self._robot.is_torque_controlled,
                servo=self._robot.servos is not None,
            )
            setup.check(
                joints=self._model.kick.numel_in(3),
                internal_state=self.internal_state_size,
                parameters=self.layout.size,
            )
        walks = [self._walk(setup, coding, log=log) for setup in setups]
        rounds = sum(walked for _, walked in walks)
        return WalkResults(tuple(result for result, _ in walks), LaneUse(rounds, rounds))

    def _walk(self, setup: WalkSetup, coding: Coding, *, log: bool) -> tuple[WalkResult, int]:
        """Return the result of a walk and its number of rounds of physics steps."""
        step = Stepper(self._model, setup)
        past, sensors = Past.of(setup.desired.shape[1]), Sensors(setup.sensors)
        sensed = np.zeros(setup.desired.shape[1])
        inner = InnerLoop(self._robot, setup, coding)
        sums, peaks = np.zeros(len(INTEGRANDS)), np.zeros(len(PEAKS))
        lifted, clearance = np.zeros(len(self._robot.legs)), math.inf
        rows: list[Floats] = []
        status, rounds = Status.OK, 0
        for tick, desired in enumerate(setup.desired):
            encoder, turning = step.motors(loose=self._robot.has_backlash)
            readings = sensors.read(encoder, np.abs(sensed))
            error, load = coded(*readings, desired, coding)
            output = control(setup.control_law, coding, error, load, past)
            inner.begin(tick, output)
            step.duty[:] = inner.command(encoder, turning)
            if setup.disturbance is not None:
                step.disturbance[:] = setup.disturbance[tick]
            if log:
                seen = np.abs(sensed)
                rows.append(np.concatenate([step.q, step.v, step.internal_state, seen, step.duty]))
            refinement = coding.refinement if step.landing[0] > 0.0 else 1
            step.refine(refinement)
            step.push(tick)
            rounds += refinement
            period = refinement * coding.substeps // coding.inner_ticks
            for lap in range(refinement):
                step.drift(0.5)
                for left in reversed(range(coding.substeps)):
                    walked = (lap + 1) * coding.substeps - left - 1
                    if walked and walked % period == 0:
                        # Positions are those of the step's middle.
                        seen, turning = step.motors(loose=self._robot.has_backlash)
                        ago = 0.5 * step.timestep
                        step.duty[:] = inner.command(seen - ago * turning, turning)
                    step.kick()
                    step.drift(1.0 if left else 0.5)
                    current = np.abs(step.current)
                    sensed = low_pass(sensed, current, setup.smoothing(refinement))
                    sums += step.integrands / refinement
                    peaks, lifted = np.maximum(peaks, step.peaks), np.maximum(lifted, step.heights)
            if (tick + 1) % setup.cycle == 0:
                clearance, lifted = min(clearance, float(lifted.min())), np.zeros_like(lifted)
            status = status_of(step.q, step.v, step.internal_state, setup, step.knees())
            if status is not Status.OK:
                break
        states = padded_states(rows, setup.ticks) if log else None
        return WalkResult(status, sums, step.q.copy(), peaks, clearance, states), rounds


class Stepper:
    """CasADi's kick and drift on fixed buffers: several times faster than calling the functions."""

    def __init__(self, model: PhysicsModel, setup: WalkSetup) -> None:
        n_joints = setup.desired.shape[1]
        self.q, self.v = setup.start.copy(), np.zeros(6 + n_joints)
        self.internal_state, self.parameters = (
            setup.internal_state.copy(),
            np.array(setup.parameters),
        )
        self.duty, self.disturbance, self.current = (np.zeros(n_joints) for _ in range(3))
        self.integrands, self.peaks = np.zeros(len(INTEGRANDS)), np.zeros(len(PEAKS))
        self.heights, self.landing = np.zeros(model.kick.numel_out(5)), np.zeros(1)
        self._at = model.layout.slices["timestep"]
        self._timestep = float(setup.parameters[self._at][0])
        self._push_at, self._shove_ticks = model.layout.slices["push"], setup.shove_ticks
        self._push = setup.parameters[self._push_at]
        self._time = np.zeros(1)
        kicked = [np.zeros_like(array) for array in (self.v, self.internal_state)]
        drifted = [np.zeros_like(array) for array in (self.q, self.internal_state)]
        state = [self.q, self.v, self.internal_state]
        self._terrain, self._places = setup.terrain, model.places
        self._placed = np.zeros((model.kick.numel_out(5), 6))  # at the last step
        self._patches = np.zeros((model.kick.numel_out(5), 3))
        patches = [] if self._terrain is None else [self._patches.ravel()]
        self._kick = _buffered(
            model.kick,
            [*state, self.duty, self.disturbance, self.parameters, *patches],
            [*kicked, self.current, self.integrands, self.peaks, self.heights, self.landing],
        )
        self._drift = _buffered(model.drift, [*state, self._time], drifted)
        self._kicked = list(zip((self.v, self.internal_state), kicked, strict=True))
        self._drifted = list(zip((self.q, self.internal_state), drifted, strict=True))

    @property
    def timestep(self) -> float:
        """Length of the following steps [s]."""
        return float(self.parameters[self._at][0])

    def motors(self, *, loose: bool) -> tuple[Floats, Floats]:
        """Return views of the angles (J,) [rad] and rates (J,) [rad/s] that the encoders see."""
        n = len(self.duty)
        if loose:
            return self.internal_state[:n], self.internal_state[n : 2 * n]
        return self.q[7:], self.v[6:]

    def knees(self) -> Floats | None:
        """Return the places of the knees (L, 3) [m] in the world, on uneven ground."""
        return None if self._terrain is None else self._placed[:, 3:]

    def push(self, tick: int) -> None:
        """Apply the shove's force during its ticks."""
        begin, end = self._shove_ticks
        self.parameters[self._push_at] = self._push * (begin <= tick < end)

    def refine(self, refinement: int) -> None:
        """Set the length of the following steps."""
        self.parameters[self._at] = self._timestep / refinement

    def kick(self) -> None:
        """Advance the velocities by a step in place; measurements are those of its middle."""
        if self._terrain is not None:
            self._placed = np.asarray(self._places(self.q)).reshape(-1, 6)
            x, y, *_ = self._placed.T
            self._patches[:] = np.stack(self._terrain.under(x, y), axis=1)
        self._kick[1]()
        for array, after in self._kicked:
            array[:] = after

    def drift(self, steps: float) -> None:
        """Advance the positions at these velocities in place."""
        self._time[:] = steps * self.parameters[self._at]
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
