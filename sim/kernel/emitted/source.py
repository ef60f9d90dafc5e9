"""A robot's kernel as C source, and the digest of everything that the source depends on.

Robots that do not ship are derived in a process with limits.
"""

from __future__ import annotations

import hashlib
import threading
from functools import lru_cache
from importlib import metadata, resources
from typing import TYPE_CHECKING, Final

from gaitswarm.sim.compiler.compilation import vector_header
from gaitswarm.sim.errors import KernelBuildError, ProcessEnded
from gaitswarm.sim.kernel.dynamics.kinds import limb_kinds
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.limited_process import Document, LimitedProcesses, serve
from gaitswarm.sim.robot.description import CONTROL_RATE, RobotDescription
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import Robot, assembled

if TYPE_CHECKING:
    from gaitswarm.sim.kernel import Precision

# A derivation takes one or two seconds after one of start-up, and a tenth of the memory. Processes
# are not kept: CasADi's symbols hold memory, and robots with a new kernel are rare.
PROCESSES: Final = LimitedProcesses(
    "gaitswarm.sim.kernel.emitted.source",
    count=2,
    seconds=120.0,
    cpu_seconds=60,
    memory=4 << 30,
    kept=False,
)

_deriving: Final = threading.Lock()
"""CasADi's symbols must be created by one thread at a time."""


@lru_cache(maxsize=128)
def kernel_identity(
    robot: Robot, precision: Precision = "double", *, uneven: bool = False
) -> bytes:
    """Digest of everything that a kernel's source depends on, without deriving it."""
    options = (
        precision,
        robot.n_joints,
        robot.description.contact_law,
        robot.has_backlash,
        robot.has_dry_friction,
        robot.has_directional_friction,
        robot.is_torque_controlled,
        robot.servos is not None,
        uneven,
    )
    kinds = limb_kinds(limbs_of(robot))
    return hashlib.sha256(_generator() + repr((kinds, options)).encode()).digest()


def kernel_source(robot: Robot, precision: Precision = "double", *, uneven: bool = False) -> str:
    """Derive a robot's physics and write it as C; takes some seconds."""
    # Imported only to compile: a worker with a warm cache needs neither CasADi nor Pinocchio.
    from gaitswarm.sim.kernel.emitted.pieces import kernel_pieces  # noqa: PLC0415

    layout = Layout(robot)
    with _deriving:
        pieces = kernel_pieces(robot, uneven=uneven)
    return "\n".join(
        [
            f"#define NJ {robot.n_joints}",
            f"#define NL {len(robot.legs)}",
            f"#define NP {layout.size}",
            f"#define NI {internal_state_size(robot)}",
            f"#define BACKLASH {int(robot.has_backlash)}",
            f"#define INNER {int(robot.has_inner_loop)}",
            f"#define SERVO {int(robot.servos is not None)}",
            f"#define UNEVEN {int(uneven)}",
            f"#define TIMESTEP {layout.slices['timestep'].start}",
            f"#define PUSH {layout.slices['push'].start}",
            f"#define CONTROL_RATE {CONTROL_RATE}.0",
            *(["#define SINGLE"] if precision == "single" else []),
            vector_header(),
            pieces,
            _file("counts.h"),
            control_tick(),
            _file("sensors.c"),
            _file("control.c"),
            _file("terrain.c"),
            _file("pool.c"),
            *([_file("inner.c")] if robot.has_inner_loop else []),
            _file("driver.c"),
        ]
    )


def control_tick() -> str:
    """C source of the control tick, independent of its arithmetic (counts.h)."""
    return _file("tick.c")


def _file(name: str) -> str:
    return (resources.files("gaitswarm.sim.kernel.emitted") / name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def _generator() -> bytes:
    """Digest of what the source of every robot's kernel depends on."""
    kernel = resources.files("gaitswarm.sim.kernel")
    digest = hashlib.sha256(vector_header().encode())
    digest.update((kernel / "parameters.py").read_bytes())
    for package in ("dynamics", "emitted"):
        for file in sorted((kernel / package).iterdir(), key=lambda file: file.name):
            if file.name.endswith((".py", ".c", ".h")):
                digest.update(file.read_bytes())
    digest.update(metadata.version("casadi").encode())
    return digest.digest()


def derived_source(robot: Robot, precision: Precision = "double", *, uneven: bool = False) -> str:
    """Derive a kernel's C source; in a process with limits for a robot that does not ship."""
    if robot.ships:
        return kernel_source(robot, precision, uneven=uneven)
    request = {
        "description": robot.description.model_dump(mode="json"),
        "urdf": robot.urdf.text,
        "precision": precision,
        "uneven": uneven,
    }
    try:
        return str(PROCESSES.ask(request)["source"])
    except ProcessEnded as error:
        raise KernelBuildError(
            f"no kernel for {robot.description.name!r}: its derivation {error}"
        ) from error


def _answer(request: Document) -> Document:
    description = RobotDescription.model_validate(request["description"])
    robot = assembled(description, request["urdf"])
    return {"source": kernel_source(robot, request["precision"], uneven=request["uneven"])}


if __name__ == "__main__":
    serve(_answer)
