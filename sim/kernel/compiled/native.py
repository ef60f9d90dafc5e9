"""The compiled kernel: emitted physics and the hand-written driver, loaded with ctypes."""

from __future__ import annotations

import ctypes
import dataclasses
import struct
import threading
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from gaitswarm.sim.compiler.compilation import load_library
from gaitswarm.sim.compiler.target import Target
from gaitswarm.sim.errors import KernelBuildError
from gaitswarm.sim.kernel.compiled.derivation import derived_source
from gaitswarm.sim.kernel.compiled.lanes import plan_lanes
from gaitswarm.sim.kernel.compiled.sharing import SHARED_STRUCTURES, Pool
from gaitswarm.sim.kernel.compiled.structures import (
    STRUCTURES,
    Addresses,
    CodingStructure,
    SensorErrorsStructure,
    Walker,
)
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.kernel.gains import check_gains
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.kernel.walk import (
    Coding,
    LaneUse,
    Precision,
    WalkResult,
    WalkResults,
    WalkSetup,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import Robot

_CODED: Final = tuple(field.name for field in dataclasses.fields(Coding))


class NativeKernel:
    """A robot's physics and control, compiled. Its loop runs outside the interpreter's lock."""

    backend: Final = "native"

    def __init__(self, robot: Robot, library: ctypes.CDLL) -> None:
        self._library = library
        self.layout = Layout(robot)
        self._constants = robot_constants(robot)
        self.lanes = int(library.gaitswarm_lanes())
        self.precision: Precision = "single" if library.gaitswarm_single() else "double"
        self.internal_state_size = internal_state_size(robot)
        self._joints, self._torque = robot.n_joints, robot.is_torque_controlled
        self._integrands = int(library.gaitswarm_integrands())
        self._log_width = 13 + 4 * self._joints + self.internal_state_size
        self._check(robot.description.name)
        library.gaitswarm_walk.restype = library.gaitswarm_left.restype = ctypes.c_int64
        self._pools: dict[Coding, Pool] = {}

    def _check(self, robot: str) -> None:
        """What is passed across the border must mean the same on both sides."""
        structures = STRUCTURES | SHARED_STRUCTURES
        sizes = {f"size_of_{name}": ctypes.sizeof(kind) for name, kind in structures.items()}
        sizes |= {
            "joints": self._joints,
            "parameters": self.layout.size,
            "constants": len(self._constants),
            "internal_state_size": self.internal_state_size,
            "log_width": self._log_width,
        }
        for name, size in sizes.items():
            found = int(getattr(self._library, f"gaitswarm_{name}")())
            if found != size:
                raise KernelBuildError(
                    f"the library loaded for {robot} is not this program's kernel of it: its"
                    f" {name} is {found}, not {size}; remove kernel-* from the directory of"
                    " compiled kernels, and it will be built again"
                )

    @property
    def code_size(self) -> int | None:
        """Machine code of the library [B]; None where libraries are not in the ELF format."""
        return text_size(Path(self._library._name).read_bytes())  # noqa: SLF001 - documented

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """All walks, `lanes` at a time: where one ends, the next one of `plan_lanes` begins.

        Concurrent calls without logs share their walks: what a thread's lanes have room for at the
        end, it takes over from another call, and waits for what others have taken over from it.
        """
        for law in {id(s.control_law): s.control_law for s in setups}.values():
            check_gains(law, torque=self._torque)
        for setup in setups:
            setup.check(
                joints=self._joints,
                internal_state=self.internal_state_size,
                parameters=self.layout.size,
            )
        n = len(setups)
        sums, end = np.empty((n, self._integrands)), np.empty((n, 7 + self._joints))
        logs = [np.full((s.ticks, self._log_width), np.nan) if log else None for s in setups]
        walkers = (Walker * n)()
        addresses = Addresses()
        sums_at, end_at = int(sums.ctypes.data), int(end.ctypes.data)
        order = _order(tuple(setup.ticks for setup in setups), self.lanes)
        for walker, k in zip(walkers, order, strict=True):
            setup, record = setups[k], logs[k]
            walker.q0 = addresses.of(setup.start, np.float64)
            walker.internal_state = addresses.of(setup.internal_state, np.float64)
            walker.parameters = addresses.of(setup.parameters, np.float64)
            walker.desired = addresses.of(setup.desired, np.int32)
            walker.disturbance = addresses.if_any(setup.disturbance)
            walker.feed_forward = addresses.if_any(setup.feed_forward)
            errors = setup.sensors
            walker.sensors = SensorErrorsStructure(errors.scales, errors.delays, errors.seed)
            walker.shove[:] = setup.shove_ticks
            walker.law = addresses.law(setup.control_law)
            walker.ticks = setup.ticks
            walker.fall_height = setup.fall_height
            walker.fall_cosine = setup.fall_cosine
            walker.smoothing[:] = setup.smoothing(1), setup.smoothing(coding.refinement)
            walker.sums = sums_at + k * sums.strides[0]
            walker.end = end_at + k * end.strides[0]
            walker.log = None if record is None else record.ctypes.data
        coded = (getattr(coding, name) for name in _CODED)
        packed = CodingStructure(*coded, self._constants.ctypes.data)
        # Somebody waits for a log, as a rule: it is not held up by other walks.
        pool = Pool(self._library) if log else self._pools.setdefault(coding, Pool(self._library))
        use, waited = pool.walk(walkers, packed, (addresses, sums, end, logs))
        ended = sorted(zip(order, walkers, strict=True), key=lambda pair: pair[0])
        return WalkResults(
            tuple(
                WalkResult(Status(int(w.status)), sums[k], end[k], float(w.peak_current), logs[k])
                for k, w in ended
            ),
            LaneUse(use.walked, use.computed, use.timed, use.control),
            waited,
        )


@lru_cache(maxsize=64)
def _order(ticks: tuple[int, ...], lanes: int) -> tuple[int, ...]:
    """Planned once: the tasks of one iteration have walks as long as those of the next."""
    return plan_lanes(ticks, lanes).order


def text_size(library: bytes) -> int | None:
    """Size of the section `.text` of a 64-bit little-endian ELF file.

    Returns:
        [B]; None for another format.
    """
    if library[:6] != b"\x7fELF\x02\x01":
        return None
    (table,) = struct.unpack_from("<Q", library, 0x28)
    size, count, names = struct.unpack_from("<HHH", library, 0x3A)
    headers = [struct.unpack_from("<IIQQQQ", library, table + size * k) for k in range(count)]
    for name, _, _, _, _, length in headers:
        if library.startswith(b".text\0", headers[names][4] + name):
            return int(length)
    return None


_libraries: Final[dict[bytes, ctypes.CDLL | None]] = {}
_kernels: Final[dict[tuple[bytes, bytes], NativeKernel]] = {}
"""By library and constants, those used last at the end."""
_KEPT: Final = 64
_loading: Final[dict[bytes, threading.Lock]] = {}
_registering: Final = threading.Lock()


def native_kernel(robot: Robot, precision: Precision = "double") -> NativeKernel | None:
    """The robot's kernel, compiled at first use and loaded once a process.

    Robots that differ in run-time parameters only share one. While one kernel is compiled, others
    can be loaded.
    """
    identity = kernel_identity(robot, precision)
    with _registering:
        loading = _loading.setdefault(identity, threading.Lock())
    with loading:
        if identity not in _libraries:
            _libraries[identity] = _load(robot, precision, None, ())
        library = _libraries[identity]
    if library is None:
        return None
    key = identity, robot_constants(robot).tobytes()
    with _registering:
        kernel = _kernels.pop(key, None) or NativeKernel(robot, library)
        # Kernels are small, but a calibration may have one for every design.
        _kernels[key] = kernel
        if len(_kernels) > _KEPT:
            del _kernels[next(iter(_kernels))]
    return kernel


def load_kernel(
    robot: Robot,
    precision: Precision = "double",
    *,
    wanted: Target | None = None,
    extra_flags: Sequence[str] = (),
) -> NativeKernel | None:
    """A kernel that `native_kernel` does not keep, to compare ways of compiling."""
    library = _load(robot, precision, wanted, extra_flags)
    return None if library is None else NativeKernel(robot, library)


def _load(
    robot: Robot, precision: Precision, wanted: Target | None, extra_flags: Sequence[str]
) -> ctypes.CDLL | None:
    return load_library(
        "kernel" if precision == "double" else "kernel-single",
        kernel_identity(robot, precision),
        lambda: derived_source(robot, precision),
        wanted=wanted,
        extra_flags=extra_flags,
    )
