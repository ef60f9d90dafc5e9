"""A robot's kernel as C text, and the digest of all that this text depends on."""

from __future__ import annotations

import hashlib
import threading
from functools import lru_cache
from importlib import metadata, resources
from typing import TYPE_CHECKING, Final

from sim.compiler.compilation import vector_header
from sim.kernel.parameters import internal_state_size
from sim.robot import Robot

if TYPE_CHECKING:
    from sim.kernel.walk import Precision

_NOT_IN_THE_SOURCE: Final = ("native.py", "observation.py", "reference.py", "walk.py")
"""Files of this package that the source does not depend on; a new one counts until it is here."""

_deriving: Final = threading.Lock()
"""CasADi's symbols are made by one thread at a time."""


def kernel_identity(robot: Robot, precision: Precision = "double") -> bytes:
    """All that a kernel's source depends on, without deriving it.

    Args:
        robot: As for `native_kernel`; its run-time parameters are left out, so that robots share
            a kernel.
        precision: Of the physics.

    Returns:
        A digest of 32 bytes.
    """
    digest = hashlib.sha256(_generator())
    digest.update(precision.encode())
    digest.update(robot.urdf.text.encode())
    actuators = robot.actuators()
    for array in (actuators.torque, actuators.resistance, actuators.armature):
        digest.update(array.tobytes())
    if robot.has_backlash:
        digest.update(actuators.shaft_stiffness.tobytes() + actuators.shaft_damping.tobytes())
    legs = [(*leg.joints, leg.foot) for leg in robot.description.legs]
    kind = (robot.description.contact_law, robot.has_backlash, robot.has_static_friction)
    digest.update(repr((legs, *kind)).encode())
    return digest.digest()


def kernel_source(robot: Robot, precision: Precision = "double") -> str:
    """Derive a robot's physics and write it as C, some seconds of work.

    Args:
        robot: As for `native_kernel`.
        precision: Of the physics.

    Returns:
        C text that lacks the definition of DOUBLES only.
    """
    # Imported only to compile: a worker with a warm cache needs neither CasADi nor Pinocchio.
    from sim.kernel.emit_c import emit_c  # noqa: PLC0415
    from sim.kernel.physics_step import physics_model  # noqa: PLC0415

    with _deriving:
        model = physics_model(robot)
        step = emit_c(model.step, "step")
    return "\n".join(
        [
            f"#define NJ {robot.n_joints}",
            f"#define NP {model.layout.size}",
            f"#define NI {internal_state_size(robot)}",
            f"#define BACKLASH {int(robot.has_backlash)}",
            f"#define TIMESTEP {model.layout.slices['timestep'].start}",
            *(["#define SINGLE"] if precision == "single" else []),
            vector_header(),
            step,
            *(
                (resources.files("sim.kernel") / name).read_text(encoding="utf-8")
                for name in ("control.c", "driver.c")
            ),
        ]
    )


@lru_cache(maxsize=1)
def _generator() -> bytes:
    """What the source of every robot's kernel depends on."""
    digest = hashlib.sha256(vector_header().encode())
    files = {
        file.name: file
        for file in resources.files("sim.kernel").iterdir()
        if file.name.endswith((".py", ".c")) and file.name not in _NOT_IN_THE_SOURCE
    }
    for name in sorted(files):
        digest.update(files[name].read_bytes())
    digest.update(f"{metadata.version('casadi')} {metadata.version('pin')}".encode())
    return digest.digest()
