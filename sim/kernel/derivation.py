"""Derivation of a kernel's C source; in a process with limits for robots that do not ship."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from gaitswarm.sim.errors import KernelBuildError, ProcessEnded
from gaitswarm.sim.kernel.emitted.source import kernel_source
from gaitswarm.sim.limited_process import Document, LimitedProcesses, serve
from gaitswarm.sim.robot.description import RobotDescription
from gaitswarm.sim.robot.robot import Robot, assembled

if TYPE_CHECKING:
    from gaitswarm.sim.kernel import Precision

SECONDS: Final = 120.0
"""Time limit of a derivation, which takes one or two seconds after a second of start-up."""

CPU_SECONDS: Final = 60

MEMORY: Final = 4 << 30
"""Address space of the process [B]; a derivation needs a tenth of it."""

# Not kept: CasADi's symbols hold memory, and robots with a new kernel are rare.
PROCESSES: Final = LimitedProcesses(
    "gaitswarm.sim.kernel.derivation",
    count=2,
    seconds=SECONDS,
    cpu_seconds=CPU_SECONDS,
    memory=MEMORY,
    kept=False,
)


def derived_source(robot: Robot, precision: Precision = "double", *, uneven: bool = False) -> str:
    """Derive a kernel's C source."""
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
