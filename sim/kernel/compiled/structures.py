"""What the compiled kernel reads, as C lays it out: structures, and addresses of arrays."""

from __future__ import annotations

import ctypes
import dataclasses
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import ControlLaw, JointPd, LookupTable, Response
from gaitswarm.sim.errors import SimulationInputError

Floats = NDArray[np.float64]


class CodingStructure(ctypes.Structure):
    """Sensors, PWM and rates of all walks of a call, with the robot's constants."""

    _fields_ = [
        ("angle_counts", ctypes.c_double),
        ("current_counts", ctypes.c_double),
        ("duty_per_count", ctypes.c_double),
        ("angle_step", ctypes.c_int64),
        ("current_step", ctypes.c_int64),
        ("pwm_step", ctypes.c_int64),
        ("pwm_counts", ctypes.c_int64),
        ("substeps", ctypes.c_int64),
        ("refinement", ctypes.c_int64),
        ("inner_ticks", ctypes.c_int64),
        ("robot", ctypes.c_void_p),
    ]


class _Table(ctypes.Structure):
    _fields_ = [
        ("values", ctypes.c_void_p),
        ("n_error", ctypes.c_int64),
        ("n_current", ctypes.c_int64),
        ("n_velocity", ctypes.c_int64),
        ("error_gain", ctypes.c_int64),
        ("current_gain", ctypes.c_int64),
        ("velocity_gain", ctypes.c_int64),
        ("output_gain", ctypes.c_int64),
    ]


class _Law(ctypes.Structure):
    _fields_ = [
        ("proportional_gain", ctypes.c_int64),
        ("integral_gain", ctypes.c_int64),
        ("derivative_gain", ctypes.c_int64),
        ("direct", _Table),
        ("integrated", _Table),
        ("stiffness", ctypes.c_double),
        ("damping", ctypes.c_double),
        ("feed_forward", ctypes.c_double),
    ]


class SensorErrorsStructure(ctypes.Structure):
    """Noise and delay of angles and currents, and the seed of the noise."""

    _fields_ = [
        ("noise", 2 * ctypes.c_double),
        ("delay", 2 * ctypes.c_int64),
        ("seed", ctypes.c_uint64),
    ]


class Walker(ctypes.Structure):
    """A walk as the kernel reads it, with where its results go and what they are."""

    _fields_ = [
        ("q0", ctypes.c_void_p),
        ("internal_state", ctypes.c_void_p),
        ("parameters", ctypes.c_void_p),
        ("desired", ctypes.c_void_p),
        ("disturbance", ctypes.c_void_p),
        ("feed_forward", ctypes.c_void_p),
        ("sensors", SensorErrorsStructure),
        ("shove", 2 * ctypes.c_int64),
        ("law", _Law),
        ("ticks", ctypes.c_int64),
        ("fall_height", ctypes.c_double),
        ("fall_cosine", ctypes.c_double),
        ("smoothing", 2 * ctypes.c_double),
        ("sums", ctypes.c_void_p),
        ("end", ctypes.c_void_p),
        ("log", ctypes.c_void_p),
        ("peak_current", ctypes.c_double),
        ("status", ctypes.c_int64),
    ]


STRUCTURES: Final = {"coding": CodingStructure, "table": _Table, "walker": Walker}
"""By their names in the library's functions that tell their sizes."""


class Addresses:
    """Addresses of arrays, which stay where they are as long as this object lives.

    Walks share most of them: those of a scenario all but the law, those of a design the law.
    """

    def __init__(self) -> None:
        self._arrays: dict[int, tuple[int, NDArray[Any], NDArray[Any]]] = {}
        self._laws: dict[int, tuple[_Law, ControlLaw]] = {}

    def of(self, array: NDArray[Any], dtype: Any) -> int:
        """Where an array's numbers are."""
        known = self._arrays.get(id(array))
        if known is None:
            contiguous = np.ascontiguousarray(array, dtype=dtype)
            known = int(contiguous.ctypes.data), contiguous, array
            self._arrays[id(array)] = known
        return known[0]

    def if_any(self, array: Floats | None) -> int | None:
        """As `of`, for doubles."""
        return None if array is None else self.of(array, np.float64)

    def law(self, law: ControlLaw) -> _Law:
        """A control law as the kernel reads it."""
        known = self._laws.get(id(law))
        if known is None:
            packed = _Law(
                law.proportional_gain,
                law.integral_gain,
                law.derivative_gain,
                self._table(law.direct),
                self._table(law.integrated),
                *dataclasses.astuple(law.joint_pd or JointPd()),
            )
            known = self._laws[id(law)] = packed, law
        return known[0]

    def _table(self, table: Response | None) -> _Table:
        if table is None:
            return _Table()
        if not isinstance(table, LookupTable):
            raise SimulationInputError(
                "the native kernel runs tables only; an inference needs backend='reference'"
            )
        return _Table(
            self.of(table.values, np.int8),
            *table.values.shape,
            table.error_gain,
            table.current_gain,
            table.velocity_gain,
            table.output_gain,
        )
