"""The compiled kernel, loaded with ctypes: generated physics and the hand-written driver."""

from __future__ import annotations

import ctypes
import dataclasses
import threading
import time
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.compiler.compilation import Target, load_library
from gaitswarm.sim.controllers.base import ControlLaw, LookupTable, Response
from gaitswarm.sim.errors import KernelBuildError, SimulationInputError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.emitted.source import derived_source, kernel_identity
from gaitswarm.sim.kernel.lanes import plan_lanes
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.kernel.walk import (
    PEAKS,
    Coding,
    LaneUse,
    WalkResult,
    WalkResults,
    WalkSetup,
    check_setups,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.terrain import HeightGrid


def _fields(kind: Any, *names: str) -> list[tuple[str, Any]]:
    return [(name, kind) for name in names]


class CodingStructure(ctypes.Structure):
    """Sensors, PWM and rates of all walks of a call, and the robot's constants."""

    _fields_ = [
        *_fields(ctypes.c_double, "angle_counts", "current_counts", "duty_per_count"),
        *_fields(ctypes.c_int64, "angle_step", "current_step", "pwm_step", "pwm_counts"),
        *_fields(ctypes.c_int64, "substeps", "refinement", "inner_ticks"),
        ("robot", ctypes.c_void_p),
    ]


class _Table(ctypes.Structure):
    _fields_ = [
        ("values", ctypes.c_void_p),
        *_fields(ctypes.c_int64, "n_error", "n_current", "n_velocity"),
        *_fields(ctypes.c_int64, "error_gain", "current_gain", "velocity_gain", "output_gain"),
    ]


class _Law(ctypes.Structure):
    _fields_ = [
        *_fields(ctypes.c_int64, "proportional_gain", "integral_gain", "derivative_gain"),
        *_fields(_Table, "direct", "integrated"),
        *_fields(ctypes.c_double, "stiffness", "damping", "feed_forward"),
    ]


class SensorErrorsStructure(ctypes.Structure):
    """Noise and delay of angles and currents, and the seed of the noise."""

    _fields_ = [
        ("noise", 2 * ctypes.c_double),
        ("delay", 2 * ctypes.c_int64),
        ("seed", ctypes.c_uint64),
    ]


class _Terrain(ctypes.Structure):
    _fields_ = [
        ("heights", ctypes.c_void_p),
        ("cells", 2 * ctypes.c_int64),
        *_fields(2 * ctypes.c_double, "origin", "repeats"),
        *_fields(ctypes.c_double, "per_metre", "scale", "top"),
        ("corners", 12 * ctypes.c_double),
    ]


class Walker(ctypes.Structure):
    """A walk: input arrays, addresses of its results, and scalar results."""

    _fields_ = [
        *_fields(ctypes.c_void_p, "q0", "internal_state", "parameters", "desired"),
        *_fields(ctypes.c_void_p, "disturbance", "feed_forward"),
        ("terrain", _Terrain),
        ("sensors", SensorErrorsStructure),
        ("shove", 2 * ctypes.c_int64),
        ("law", _Law),
        *_fields(ctypes.c_int64, "ticks", "cycle"),
        *_fields(ctypes.c_double, "fall_height", "fall_cosine"),
        ("smoothing", 2 * ctypes.c_double),
        *_fields(ctypes.c_void_p, "sums", "end", "log"),
        ("peaks", len(PEAKS) * ctypes.c_double),
        ("clearance", ctypes.c_double),
        ("status", ctypes.c_int64),
    ]


class _Call(ctypes.Structure):
    _fields_ = [
        ("walkers", ctypes.c_void_p),
        *_fields(ctypes.c_int64, "n", "begun", "left", "number"),
        ("following", ctypes.c_void_p),
    ]


class _Pool(ctypes.Structure):
    _fields_ = [*_fields(ctypes.c_int64, "busy", "calls"), ("first", ctypes.c_void_p)]


class LaneCounts(ctypes.Structure):
    """`gaitswarm.sim.kernel.walk.LaneUse` of the lanes of one thread."""

    _fields_ = _fields(ctypes.c_int64, "walked", "computed", "timed", "control")


STRUCTURES: Final = {
    "coding": CodingStructure,
    "table": _Table,
    "walker": Walker,
    "call": _Call,
    "pool": _Pool,
    "lane_use": LaneCounts,
}
"""By their names in the library's `size_of_` functions."""


class Addresses:
    """Addresses of contiguous arrays, which stay valid while this object lives."""

    def __init__(self) -> None:
        self._arrays: dict[int, tuple[int, NDArray[Any], NDArray[Any]]] = {}
        self._laws: dict[int, tuple[_Law, ControlLaw]] = {}

    def of(self, array: NDArray[Any] | None, dtype: Any = np.float64) -> int | None:
        if array is None:
            return None
        cached = self._arrays.get(id(array))
        if cached is None:
            contiguous = np.ascontiguousarray(array, dtype=dtype)
            cached = int(contiguous.ctypes.data), contiguous, array
            self._arrays[id(array)] = cached
        return cached[0]

    def law(self, law: ControlLaw) -> _Law:
        cached = self._laws.get(id(law))
        if cached is None:
            packed = _Law(
                law.proportional_gain,
                law.integral_gain,
                law.derivative_gain,
                self._table(law.direct),
                self._table(law.integrated),
                *law.inner,
            )
            cached = self._laws[id(law)] = packed, law
        return cached[0]

    def terrain(self, grid: HeightGrid, corners: Floats) -> _Terrain:
        return _Terrain(
            self.of(grid.heights),
            grid.cells,
            grid.origin,
            grid.repeated,
            grid.per_metre,
            grid.scale,
            grid.top,
            tuple(corners.ravel().tolist()),
        )

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


class Pool:
    """Concurrent calls of one kernel and coding, which take each other's walks into free lanes."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self._shared = _Pool()
        self._walked = threading.Condition()
        self._pending: list[tuple[_Call, object]] = []

    def walk(
        self, walkers: ctypes.Array[Any], coding: ctypes.Structure, memory: object
    ) -> tuple[LaneCounts, float]:
        """Compute the walks, maybe also some of other calls; return lane use and wait time [s]."""
        call = _Call(walkers=ctypes.addressof(walkers), n=len(walkers), left=len(walkers))
        use = LaneCounts()
        with self._walked:
            self._pending.append((call, (walkers, memory)))
        self._library.gaitswarm_walk(
            ctypes.byref(self._shared), ctypes.byref(call), ctypes.byref(coding), ctypes.byref(use)
        )
        walked = time.perf_counter()
        with self._walked:
            self._walked.notify_all()
            self._walked.wait_for(lambda: not self._left(call))
            self._pending = [pending for pending in self._pending if self._left(pending[0])]
        return use, time.perf_counter() - walked

    def _left(self, call: _Call) -> int:
        return int(self._library.gaitswarm_left(ctypes.byref(call)))


_CODED: Final = tuple(field.name for field in dataclasses.fields(Coding))


class NativeKernel:
    """A robot's compiled physics and control. Its loop releases the interpreter's lock."""

    backend: Final = "native"

    def __init__(self, robot: Robot, library: ctypes.CDLL) -> None:
        self._library = library
        self.layout = Layout(robot)
        self._constants = robot_constants(robot)
        self.lanes = int(library.gaitswarm_lanes())
        self.precision: Precision = "single" if library.gaitswarm_single() else "double"
        self.internal_state_size = internal_state_size(robot)
        self._robot, self._joints = robot, robot.n_joints
        self._integrands = int(library.gaitswarm_integrands())
        self._log_width = 13 + 4 * self._joints + self.internal_state_size
        self._check(robot.description.name)
        library.gaitswarm_walk.restype = library.gaitswarm_left.restype = ctypes.c_int64
        self._pools: dict[Coding, Pool] = {}

    def _check(self, robot: str) -> None:
        """Check that structures and array sizes agree with the library's."""
        sizes = {f"size_of_{name}": ctypes.sizeof(kind) for name, kind in STRUCTURES.items()}
        sizes |= {
            "joints": self._joints,
            "parameters": self.layout.size,
            "constants": len(self._constants),
            "internal_state_size": self.internal_state_size,
            "log_width": self._log_width,
        }
        for name, size in sizes.items():
            compiled = int(getattr(self._library, f"gaitswarm_{name}")())
            if compiled != size:
                raise KernelBuildError(
                    f"the library loaded for {robot} does not match this program: its {name} is"
                    f" {compiled}, not {size}; remove kernel-* from the kernel cache directory"
                )

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """Compute all walks, `lanes` at a time, in the order of `plan_lanes`; calls share walks."""
        check_setups(self._robot, setups)
        n = len(setups)
        sums, end = np.empty((n, self._integrands)), np.empty((n, 7 + self._joints))
        logs = [np.full((s.ticks, self._log_width), np.nan) if log else None for s in setups]
        walkers = (Walker * n)()
        addresses = Addresses()
        sums_at, end_at = int(sums.ctypes.data), int(end.ctypes.data)
        order = _order(tuple(setup.ticks for setup in setups), self.lanes)
        for walker, k in zip(walkers, order, strict=True):
            setup, record = setups[k], logs[k]
            walker.q0 = addresses.of(setup.start)
            walker.internal_state = addresses.of(setup.internal_state)
            walker.parameters = addresses.of(setup.parameters)
            walker.desired = addresses.of(setup.desired, np.int32)
            walker.disturbance = addresses.of(setup.disturbance)
            walker.feed_forward = addresses.of(setup.feed_forward)
            if setup.terrain is not None:
                walker.terrain = addresses.terrain(setup.terrain, setup.corners)
            errors = setup.sensors
            walker.sensors = SensorErrorsStructure(errors.scales, errors.delays, errors.seed)
            walker.shove[:] = setup.shove_ticks
            walker.law = addresses.law(setup.control_law)
            walker.ticks, walker.cycle = setup.ticks, setup.cycle
            walker.fall_height = setup.fall_height
            walker.fall_cosine = setup.fall_cosine
            walker.smoothing[:] = setup.smoothing(1), setup.smoothing(coding.refinement)
            walker.sums = sums_at + k * sums.strides[0]
            walker.end = end_at + k * end.strides[0]
            walker.log = None if record is None else record.ctypes.data
        coded = (getattr(coding, name) for name in _CODED)
        packed = CodingStructure(*coded, self._constants.ctypes.data)
        # A log is usually waited for: do not delay it by other walks.
        pool = Pool(self._library) if log else self._pools.setdefault(coding, Pool(self._library))
        use, waited = pool.walk(walkers, packed, (addresses, sums, end, logs))
        ended = sorted(zip(order, walkers, strict=True), key=lambda pair: pair[0])
        return WalkResults(
            tuple(
                WalkResult(
                    Status(int(w.status)),
                    sums[k],
                    end[k],
                    np.array(w.peaks),
                    float(w.clearance),
                    logs[k],
                )
                for k, w in ended
            ),
            LaneUse(use.walked, use.computed, use.timed, use.control),
            waited,
        )


# Cached: tasks of successive iterations have walks of the same lengths.
@lru_cache(maxsize=64)
def _order(ticks: tuple[int, ...], lanes: int) -> tuple[int, ...]:
    return plan_lanes(ticks, lanes).order


_libraries: Final[dict[bytes, ctypes.CDLL | None]] = {}
_kernels: Final[dict[tuple[bytes, bytes], NativeKernel]] = {}
"""By library and constants, the most recently used last."""
_MAX_KERNELS: Final = 64
_loading: Final[dict[bytes, threading.Lock]] = {}
_registering: Final = threading.Lock()


def native_kernel(
    robot: Robot, precision: Precision = "double", *, uneven: bool = False
) -> NativeKernel | None:
    """Return the robot's kernel, loaded once per process; robots may share a library."""
    identity = kernel_identity(robot, precision, uneven=uneven)
    with _registering:
        loading = _loading.setdefault(identity, threading.Lock())
    with loading:
        if identity not in _libraries:
            _libraries[identity] = _load(robot, precision, uneven=uneven)
        library = _libraries[identity]
    if library is None:
        return None
    key = identity, robot_constants(robot).tobytes()
    with _registering:
        kernel = _kernels.pop(key, None) or NativeKernel(robot, library)
        # Kernels are small, but a calibration may use one for every design.
        _kernels[key] = kernel
        if len(_kernels) > _MAX_KERNELS:
            del _kernels[next(iter(_kernels))]
    return kernel


def load_kernel(
    robot: Robot, precision: Precision = "double", **options: Any
) -> NativeKernel | None:
    """Load a kernel without caching it in this process, to compare ways of compiling."""
    library = _load(robot, precision, **options)
    return None if library is None else NativeKernel(robot, library)


def _load(
    robot: Robot,
    precision: Precision,
    *,
    uneven: bool = False,
    compile_for: Target | None = None,
    extra_flags: Sequence[str] = (),
) -> ctypes.CDLL | None:
    return load_library(
        "kernel" if precision == "double" else "kernel-single",
        kernel_identity(robot, precision, uneven=uneven),
        lambda: derived_source(robot, precision, uneven=uneven),
        compile_for=compile_for,
        extra_flags=extra_flags,
    )
