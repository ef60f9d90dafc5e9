"""The readable driver: the same walk over CasADi's interpreter.

The oracle of driver.c, and the fallback where there is no C compiler. Function by function the
twin of driver.c; the physics agrees to rounding, the integer arithmetic exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sim.controllers.base import TABLE_SHAPE, Drive
from sim.controllers.fixed_point import FRACTION_BITS, INTEGRAL_BITS
from sim.kernel.physics_step import TERMS, PhysicsModel, physics_model
from sim.kernel.walk import CODE_LIMIT, Coding, WalkResult, WalkSetup
from sim.outcome import Status
from sim.robot import Robot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class ReferenceKernel:
    """See `walk.Kernel`. Some hundred times slower than the compiled one."""

    backend: Final = "reference"
    lanes: Final = 1

    def __init__(self, model: PhysicsModel) -> None:
        self._model = model
        self.layout = model.layout
        self.body = model.body
        self.total_mass = model.total_mass

    def walk(
        self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool
    ) -> tuple[WalkResult, ...]:
        """See `walk.Kernel.walk`."""
        return tuple(self._walk(setup, coding, log=log) for setup in setups)

    def _walk(self, setup: WalkSetup, coding: Coding, *, log: bool) -> WalkResult:
        n_joints = setup.desired.shape[1]
        step = Stepper(self._model.step, len(setup.start), n_joints, setup.parameters)
        step.q[:] = setup.start
        integral = np.zeros(n_joints, dtype=np.int64)
        sums = np.zeros(len(TERMS))
        rows: list[Floats] = []
        status = Status.OK
        for desired in setup.desired:
            error, load = _read_sensors(step.q[7:], step.current, desired, coding)
            output = _control(setup.drive, coding, error, load, integral)
            step.duty[:] = output * coding.duty_per_count
            if log:
                rows.append(np.concatenate([step.q, step.v, step.duty]))
            for _ in range(coding.substeps):
                step.advance()
                sums += step.terms
            status = _status_of(step.q, step.v, setup)
            if status is not Status.OK:
                break
        return WalkResult(status, sums, step.q.copy(), _padded(rows, setup.ticks) if log else None)


class Stepper:
    """CasADi's step on fixed buffers: several times cheaper than calling the function."""

    def __init__(self, function: Any, n_q: int, n_joints: int, parameters: Floats) -> None:
        self.q, self.v = np.zeros(n_q), np.zeros(n_q - 1)
        self.duty, self.parameters = np.zeros(n_joints), np.ascontiguousarray(parameters)
        self.current, self.terms = np.zeros(n_joints), np.zeros(len(TERMS))
        self._next_q, self._next_v = np.zeros(n_q), np.zeros(n_q - 1)
        self._buffer, self._evaluate = function.buffer()
        for k, array in enumerate((self.q, self.v, self.duty, self.parameters)):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate((self._next_q, self._next_v, self.current, self.terms)):
            self._buffer.set_res(k, array.data)

    def advance(self) -> None:
        """One physics step, in place."""
        self._evaluate()
        self.q[:] = self._next_q
        self.v[:] = self._next_v


def _read_sensors(
    angles: Floats, current: Floats, desired: NDArray[np.int32], coding: Coding
) -> tuple[Ints, Ints]:
    """Coded angle error and absolute current, (J,)."""
    code = _to_code(angles * coding.angle_counts, -4 * CODE_LIMIT, 4 * CODE_LIMIT)
    error = desired.astype(np.int64) - _coarsen(code, coding.angle_step)
    amperes = _to_code(np.abs(current) * coding.current_counts, 0, CODE_LIMIT)
    return np.clip(error, -CODE_LIMIT, CODE_LIMIT), _coarsen(amperes, coding.current_step)


def _control(drive: Drive, coding: Coding, error: Ints, load: Ints, integral: Ints) -> Ints:
    """PWM counts (J,); the integral is updated in place (thesis 5.3)."""
    if drive.table is None:
        output = _descale(error * drive.proportional_gain, FRACTION_BITS)
    else:
        rows, columns = TABLE_SHAPE
        row = _descale(error * drive.error_gain, FRACTION_BITS) + rows // 2
        column = _descale(load * drive.current_gain, FRACTION_BITS)
        entry = drive.table[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
        output = _descale(entry.astype(np.int64) * drive.output_gain, FRACTION_BITS)
    full = coding.pwm_counts << INTEGRAL_BITS
    integral[:] = np.clip(integral + error * drive.integral_gain, -full, full)
    limit = coding.pwm_counts
    output = np.clip(output + _descale(integral, INTEGRAL_BITS), -limit, limit)
    pwm: Ints = np.clip(_coarsen(output, coding.pwm_step), -limit, limit)
    return pwm


def _status_of(q: Floats, v: Floats, setup: WalkSetup) -> Status:
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return Status.DIVERGED
    upright = 1.0 - 2.0 * (q[3] * q[3] + q[4] * q[4])
    if q[2] < setup.fall_height or upright < setup.fall_cosine:
        return Status.FELL
    return Status.OK


def _to_code(value: Floats, low: int, high: int) -> Ints:
    with np.errstate(invalid="ignore"):
        code: Ints = np.clip(np.nan_to_num(np.rint(value)), low, high).astype(np.int64)
    return code


def _coarsen(code: Ints, step: int) -> Ints:
    """Nearest multiple of step."""
    coarse: Ints = (code + step // 2) // step * step
    return coarse


def _descale(value: Ints, bits: int) -> Ints:
    """Fixed point to integer, halves up."""
    integer: Ints = (value + (1 << (bits - 1))) >> bits
    return integer


def _padded(rows: list[Floats], ticks: int) -> Floats:
    log = np.full((ticks, len(rows[0])), np.nan)
    log[: len(rows)] = rows
    return log


@lru_cache(maxsize=8)
def reference_kernel(robot: Robot) -> ReferenceKernel:
    """The robot's interpreter kernel."""
    return ReferenceKernel(physics_model(robot))
