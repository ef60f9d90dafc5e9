"""The compiled kernel: emitted physics and the hand-written driver, loaded with ctypes."""

from __future__ import annotations

import ctypes
import dataclasses
import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib import metadata, resources
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sim.kernel.parameters import BodyInertia, Layout
from sim.kernel.walk import Coding, WalkResult, WalkSetup
from sim.native.compilation import load_library, vector_header
from sim.outcome import Status
from sim.robot import Robot

Floats = NDArray[np.float64]

_N_TERMS: Final = 5
_GENERATOR: Final = (
    "articulated_body.py",
    "contact.py",
    "drive.py",
    "driver.c",
    "emit_c.py",
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


class _Walker(ctypes.Structure):
    _fields_ = [
        ("q0", ctypes.c_void_p),
        ("parameters", ctypes.c_void_p),
        ("desired", ctypes.c_void_p),
        ("table", ctypes.c_void_p),
        ("proportional_gain", ctypes.c_int64),
        ("integral_gain", ctypes.c_int64),
        ("error_gain", ctypes.c_int64),
        ("current_gain", ctypes.c_int64),
        ("output_gain", ctypes.c_int64),
        ("ticks", ctypes.c_int64),
        ("fall_height", ctypes.c_double),
        ("fall_cosine", ctypes.c_double),
        ("sums", ctypes.c_void_p),
        ("end", ctypes.c_void_p),
        ("log", ctypes.c_void_p),
        ("status", ctypes.c_int64),
    ]


class NativeKernel:
    """See `walk.Kernel`. The lock-step loop runs outside the interpreter's lock."""

    backend: Final = "native"

    def __init__(self, robot: Robot, library: ctypes.CDLL) -> None:
        self._library = library
        self.layout = Layout(robot.n_joints, len(robot.legs))
        self._n_q = 7 + robot.n_joints
        self.lanes = int(library.gaitswarm_lanes())
        self._log_width = int(library.gaitswarm_log_width())
        exported = np.array((ctypes.c_double * 14).in_dll(library, "gaitswarm_body"))
        self.total_mass = float(exported[13])
        self.body = BodyInertia(float(exported[0]), exported[1:4], exported[4:13].reshape(3, 3))
        library.gaitswarm_walk.argtypes = [_pointer(_Walker), ctypes.c_int64, _pointer(_Coding)]
        library.gaitswarm_walk.restype = None

    def walk(
        self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool
    ) -> tuple[WalkResult, ...]:
        """See `walk.Kernel.walk`."""
        n = len(setups)
        sums, end = np.empty((n, _N_TERMS)), np.empty((n, self._n_q))
        logs = [np.full((s.ticks, self._log_width), np.nan) if log else None for s in setups]
        walkers = (_Walker * n)()
        kept: list[NDArray[Any]] = []

        def address(array: NDArray[Any], dtype: Any) -> int:
            contiguous = np.ascontiguousarray(array, dtype=dtype)
            kept.append(contiguous)
            return int(contiguous.ctypes.data)

        for k, (walker, setup) in enumerate(zip(walkers, setups, strict=True)):
            drive, record = setup.drive, logs[k]
            walker.q0 = address(setup.start, np.float64)
            walker.parameters = address(setup.parameters, np.float64)
            walker.desired = address(setup.desired, np.int32)
            walker.table = None if drive.table is None else address(drive.table, np.int8)
            walker.proportional_gain = drive.proportional_gain
            walker.integral_gain = drive.integral_gain
            walker.error_gain = drive.error_gain
            walker.current_gain = drive.current_gain
            walker.output_gain = drive.output_gain
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

    def step(
        self, q: Floats, v: Floats, duty: Floats, p: Floats
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """The bare physics step of one walker: q', v', current, terms; for tests and benchmarks."""
        outputs = (np.empty(len(q)), np.empty(len(v)), np.empty(len(duty)), np.empty(_N_TERMS))
        inputs = [np.ascontiguousarray(x, dtype=np.float64) for x in (q, v, duty, p)]
        self._library.gaitswarm_step(
            *(x.ctypes.data_as(ctypes.c_void_p) for x in (*inputs, *outputs))
        )
        return outputs


@lru_cache(maxsize=8)
def native_kernel(robot: Robot) -> NativeKernel | None:
    """The robot's kernel, compiled at first use; None on a machine without a C compiler."""
    library = load_library(f"kernel-{robot.description.name}", _identity(robot), _source_of(robot))
    return None if library is None else NativeKernel(robot, library)


def _identity(robot: Robot) -> bytes:
    digest = hashlib.sha256(vector_header().encode())
    folder = resources.files("sim.kernel")
    for name in _GENERATOR:
        digest.update((folder / name).read_bytes())
    digest.update(robot.urdf.encode())
    digest.update(robot.description.model_dump_json().encode())
    digest.update(f"{metadata.version('casadi')} {metadata.version('pin')}".encode())
    return digest.digest()


def _source_of(robot: Robot) -> Callable[[], str]:
    def source() -> str:
        # Imported only to compile: a worker with a warm cache needs neither CasADi nor Pinocchio.
        from sim.kernel.emit_c import emit_c  # noqa: PLC0415
        from sim.kernel.physics_step import physics_model  # noqa: PLC0415

        model = physics_model(robot)
        folder = resources.files("sim.kernel")
        body = [
            model.body.mass,
            *model.body.centre,
            *model.body.rotational.reshape(-1),
            model.total_mass,
        ]
        numbers = ", ".join(float(x).hex() for x in body)
        return "\n".join(
            [
                f"#define NJ {robot.n_joints}",
                f"#define NP {model.layout.size}",
                vector_header(),
                f"const double gaitswarm_body[14] = {{{numbers}}};",
                emit_c(model.step, "step"),
                (folder / "driver.c").read_text(encoding="utf-8"),
            ]
        )

    return source
