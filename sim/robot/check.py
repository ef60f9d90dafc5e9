"""Checks of untrusted robots in a limited process."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from gaitswarm.sim.errors import ProcessEnded, RobotFileError, SimulationInputError
from gaitswarm.sim.limited_process import Document, LimitedProcesses, serve
from gaitswarm.sim.robot import bounds
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import parse_robot
from gaitswarm.sim.robot.shapes import visible_links
from gaitswarm.sim.robot.variant import checks_of, digest_of

MOST_ROBOTS: Final = 16
"""Robots given by files in one document, at most."""

Location = tuple[str | int, ...]

PROCESSES: Final = LimitedProcesses(
    "gaitswarm.sim.robot.check",
    count=2,
    seconds=20.0,  # a check takes hundredths of a second, the first one a second
    cpu_seconds=10,
    memory=2 << 30,  # of which it needs a tenth
)


def check_files(toml: str, urdf: str) -> None:
    """Check a robot's files in another process; files that passed are remembered."""
    bounds.check_toml(toml)
    bounds.check_urdf(urdf)
    checks = checks_of(digest_of(toml, urdf))
    if "passed" in checks:
        return
    try:
        PROCESSES.ask({"toml": toml, "urdf": urdf})
    except ProcessEnded as error:
        raise RobotFileError(f"the robot cannot be used: checking it {error}") from error
    except SimulationInputError as error:
        raise RobotFileError(str(error)) from error
    checks.add("passed")


def objects_in(document: Any) -> Iterator[tuple[Location, dict[str, Any]]]:
    waiting: list[tuple[Location, Any]] = [((), document)]
    while waiting:
        where, value = waiting.pop()
        if isinstance(value, dict):
            yield where, value
            waiting += [((*where, key), part) for key, part in value.items()]
        elif isinstance(value, list):
            waiting += [((*where, index), part) for index, part in enumerate(value)]


def files_of(part: dict[str, Any]) -> tuple[str, str] | None:
    toml, urdf = part.get("toml"), part.get("urdf")
    return (toml, urdf) if isinstance(toml, str) and isinstance(urdf, str) else None


def _answer(request: Document) -> Document:
    """Build everything from a robot's files except its kernel."""
    # Imported at the first request.
    import pinocchio as pin  # noqa: PLC0415

    robot = parse_robot(request["toml"], request["urdf"])
    limbs_of(robot)
    visible_links(robot)
    try:
        pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        raise RobotFileError(f"robot.urdf: Pinocchio cannot read it: {error}"[:500]) from error
    return {}


if __name__ == "__main__":
    serve(_answer)
