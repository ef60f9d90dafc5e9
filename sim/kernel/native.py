"""The compiled kernel: emitted physics and the hand-written driver, loaded with ctypes."""

from __future__ import annotations

import ctypes
import dataclasses
import hashlib
import threading
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib import metadata, resources
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sim.compiler.compilation import load_library, vector_header
from sim.controllers.base import LookupTable, Response
from sim.errors import SimulationInputError
from sim.kernel.parameters import Layout, internal_state_size
from sim.kernel.walk import Coding, WalkResult, WalkSetup
from sim.outcome import Status
from sim.robot import Robot

Floats = NDArray[np.float64]

_GENERATOR: Final = (
    "articulated_body.py",
    "backlash.py",
    "contact.py",
    "driver.c",
    "emit_c.py",
    "inertia.py",
    "integration.py",
    "motor.py",
    "native.py",
    "parameters.py",
    "physics_step.py",
    "spatial.py",
)
"""Files of this package that determine the source."""

_pointer = ctypes.POINTER


class _Coding(ctypes.Structure):
    _fields_ = [
        ("angle_counts", ctypes.c_double),
        ("current_counts", ctypes.c_double),
        ("duty_per_count", ctypes.c_double),
        ("angle_step", ctypes.c_int64),
        ("current_step", ctypes.c_int64),
        ("pwm_step", ctypes.c_int64),
        ("pwm_counts", ctypes.c_int64),
        ("substeps", ctypes.c_int64),
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


class _Walker(ctypes.Structure):
    _fields_ = [
        ("q0", ctypes.c_void_p),
        ("internal_state", ctypes.c_void_p),
        ("parameters", ctypes.c_void_p),
        ("desired", ctypes.c_void_p),
        ("disturbance", ctypes.c_void_p),
        ("proportional_gain", ctypes.c_int64),
        ("integral_gain", ctypes.c_int64),
        ("derivative_gain", ctypes.c_int64),
        ("direct", _Table),
        ("integrated", _Table),
        ("ticks", ctypes.c_int64),
        ("fall_height", ctypes.c_double),
        ("fall_cosine", ctypes.c_double),
        ("sums", ctypes.c_void_p),
        ("end", ctypes.c_void_p),
        ("log", ctypes.c_void_p),
        ("status", ctypes.c_int64),
    ]


class _Addresses:
    """Addresses of arrays, which stay where they are as long as this object lives."""

    def __init__(self) -> None:
        self._kept: list[NDArray[Any]] = []

    def of(self, array: NDArray[Any], dtype: Any) -> int:
        contiguous = np.ascontiguousarray(array, dtype=dtype)
        self._kept.append(contiguous)
        return int(contiguous.ctypes.data)

    def table(self, table: Response | None) -> _Table:
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


class NativeKernel:
    """See `walk.Kernel`. The lock-step loop runs outside the interpreter's lock."""

    backend: Final = "native"

    def __init__(self, robot: Robot, library: ctypes.CDLL) -> None:
        self._library = library
        self.layout = Layout(robot)
        self.lanes = int(library.gaitswarm_lanes())
        self.internal_state_size = int(library.gaitswarm_internal_state_size())
        self._joints = int(library.gaitswarm_joints())
        self._parameters = int(library.gaitswarm_parameters())
        self._integrands = int(library.gaitswarm_integrands())
        self._log_width = int(library.gaitswarm_log_width())
        library.gaitswarm_walk.argtypes = [
            _pointer(_Walker),
            ctypes.c_int64,
            _pointer(_Coding),
        ]
        library.gaitswarm_walk.restype = None

    def walk(
        self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool
    ) -> tuple[WalkResult, ...]:
        """See `walk.Kernel.walk`."""
        for setup in setups:
            setup.check(
                joints=self._joints,
                internal_state=self.internal_state_size,
                parameters=self._parameters,
            )
        n = len(setups)
        sums, end = np.empty((n, self._integrands)), np.empty((n, 7 + self._joints))
        logs = [np.full((s.ticks, self._log_width), np.nan) if log else None for s in setups]
        walkers = (_Walker * n)()
        addresses = _Addresses()
        for k, (walker, setup) in enumerate(zip(walkers, setups, strict=True)):
            law, record = setup.control_law, logs[k]
            walker.q0 = addresses.of(setup.start, np.float64)
            walker.internal_state = addresses.of(setup.internal_state, np.float64)
            walker.parameters = addresses.of(setup.parameters, np.float64)
            walker.desired = addresses.of(setup.desired, np.int32)
            walker.disturbance = (
                None if setup.disturbance is None else addresses.of(setup.disturbance, np.float64)
            )
            walker.proportional_gain = law.proportional_gain
            walker.integral_gain = law.integral_gain
            walker.derivative_gain = law.derivative_gain
            walker.direct = addresses.table(law.direct)
            walker.integrated = addresses.table(law.integrated)
            walker.ticks = setup.ticks
            walker.fall_height = setup.fall_height
            walker.fall_cosine = setup.fall_cosine
            walker.sums = sums[k].ctypes.data
            walker.end = end[k].ctypes.data
            walker.log = None if record is None else record.ctypes.data
        packed = _Coding(*dataclasses.astuple(coding))
        self._library.gaitswarm_walk(walkers, n, ctypes.byref(packed))
        return tuple(
            WalkResult(Status(int(w.status)), sums[k], end[k], logs[k])
            for k, w in enumerate(walkers)
        )


_loaded: Final[dict[bytes, NativeKernel | None]] = {}
_loading: Final = threading.Lock()


def native_kernel(robot: Robot) -> NativeKernel | None:
    """The robot's kernel, compiled at first use; None on a machine without a C compiler.

    Robots that differ in run-time parameters only share one.
    """
    identity = _identity(robot)
    with _loading:
        if identity not in _loaded:
            name = f"kernel-{robot.description.name}"
            library = load_library(name, identity, _source_of(robot))
            _loaded[identity] = None if library is None else NativeKernel(robot, library)
        return _loaded[identity]


@lru_cache(maxsize=1)
def _generator() -> bytes:
    """What the source of every robot's kernel depends on."""
    digest = hashlib.sha256(vector_header().encode())
    folder = resources.files("sim.kernel")
    for name in _GENERATOR:
        digest.update((folder / name).read_bytes())
    digest.update(f"{metadata.version('casadi')} {metadata.version('pin')}".encode())
    return digest.digest()


def _identity(robot: Robot) -> bytes:
    """All that the source depends on; run-time parameters are left out, so they share a kernel."""
    digest = hashlib.sha256(_generator())
    digest.update(robot.urdf.text.encode())
    actuators = robot.actuators()
    for array in (actuators.torque, actuators.resistance, actuators.armature):
        digest.update(array.tobytes())
    if robot.has_backlash:
        digest.update(actuators.shaft_stiffness.tobytes() + actuators.shaft_damping.tobytes())
    legs = [(*leg.joints, leg.foot) for leg in robot.description.legs]
    digest.update(repr((legs, robot.description.contact_law, robot.has_backlash)).encode())
    return digest.digest()


def _source_of(robot: Robot) -> Callable[[], str]:
    def source() -> str:
        # Imported only to compile: a worker with a warm cache needs neither CasADi nor Pinocchio.
        from sim.kernel.emit_c import emit_c  # noqa: PLC0415
        from sim.kernel.physics_step import physics_model  # noqa: PLC0415

        model = physics_model(robot)
        folder = resources.files("sim.kernel")
        return "\n".join(
            [
                f"#define NJ {robot.n_joints}",
                f"#define NP {model.layout.size}",
                f"#define NI {internal_state_size(robot)}",
                f"#define ENCODER(q, internal) ({'internal' if robot.has_backlash else '(q) + 7'})",
                vector_header(),
                emit_c(model.step, "step"),
                (folder / "driver.c").read_text(encoding="utf-8"),
            ]
        )

    return source
