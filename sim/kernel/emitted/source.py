"""A robot's kernel as C text, and the digest of all that this text depends on."""

from __future__ import annotations

import hashlib
import threading
from functools import lru_cache
from importlib import metadata, resources
from typing import TYPE_CHECKING, Final

from gaitswarm.sim.compiler.compilation import vector_header
from gaitswarm.sim.kernel.dynamics.kinds import limb_kinds
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.actuators import CONTROL_RATE
from gaitswarm.sim.robot.limbs import limbs_of

if TYPE_CHECKING:
    from gaitswarm.sim.kernel.walk import Precision

_MADE_BY: Final = ("gaitswarm.sim.kernel.dynamics", "gaitswarm.sim.kernel.emitted")
"""Rooms whose files, each of them, the source depends on, beside the layout of parameters."""

_deriving: Final = threading.Lock()
"""CasADi's symbols are made by one thread at a time."""


@lru_cache(maxsize=128)
def kernel_identity(robot: Robot, precision: Precision = "double") -> bytes:
    """All that a kernel's source depends on, without deriving it."""
    options = (
        precision,
        robot.n_joints,
        robot.description.contact_law,
        robot.has_backlash,
        robot.has_static_friction,
        robot.is_torque_controlled,
    )
    kinds = limb_kinds(limbs_of(robot))
    return hashlib.sha256(_generator() + repr((kinds, options)).encode()).digest()


def kernel_source(robot: Robot, precision: Precision = "double") -> str:
    """Derive a robot's physics and write it as C, some seconds of work."""
    # Imported only to compile: a worker with a warm cache needs neither CasADi nor Pinocchio.
    from gaitswarm.sim.kernel.emitted.pieces import kernel_pieces  # noqa: PLC0415

    layout = Layout(robot)
    with _deriving:
        pieces = kernel_pieces(robot)
    return "\n".join(
        [
            f"#define NJ {robot.n_joints}",
            f"#define NP {layout.size}",
            f"#define NI {internal_state_size(robot)}",
            f"#define BACKLASH {int(robot.has_backlash)}",
            f"#define TORQUE {int(robot.is_torque_controlled)}",
            f"#define TIMESTEP {layout.slices['timestep'].start}",
            f"#define PUSH {layout.slices['push'].start}",
            f"#define CONTROL_RATE {CONTROL_RATE}.0",
            *(["#define SINGLE"] if precision == "single" else []),
            vector_header(),
            pieces,
            _own_file("counts.h"),
            control_tick(),
            _own_file("sensors.c"),
            _own_file("control.c"),
            _own_file("pool.c"),
            *([_own_file("torque.c")] if robot.is_torque_controlled else []),
            _own_file("driver.c"),
        ]
    )


def control_tick() -> str:
    """The control tick in C, which says nothing of the arithmetic that it is computed in."""
    return _own_file("tick.c")


def _own_file(name: str) -> str:
    return (resources.files("gaitswarm.sim.kernel.emitted") / name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def _generator() -> bytes:
    """What the source of every robot's kernel depends on."""
    digest = hashlib.sha256(vector_header().encode())
    digest.update((resources.files("gaitswarm.sim.kernel") / "parameters.py").read_bytes())
    for room in _MADE_BY:
        for file in sorted(resources.files(room).iterdir(), key=lambda file: file.name):
            if file.name.endswith((".py", ".c", ".h")):
                digest.update(file.read_bytes())
    digest.update(f"{metadata.version('casadi')}".encode())
    return digest.digest()
