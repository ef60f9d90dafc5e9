"""Proposals that are checked to walk, made in a limited process for untrusted URDFs."""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

from gaitswarm.sim.errors import ProcessEnded, RobotFileError, SimulationInputError
from gaitswarm.sim.limited_process import Document, LimitedProcesses, serve
from gaitswarm.sim.proposal.document import Proposal, propose_robot
from gaitswarm.sim.proposal.drive import ActuatorChoice
from gaitswarm.sim.proposal.feet import MeshBounds, no_meshes
from gaitswarm.sim.proposal.frame import AS_IT_IS, Frame
from gaitswarm.sim.proposal.gait import walk_within_reach
from gaitswarm.sim.robot import bounds
from gaitswarm.sim.robot.elements import by_line
from gaitswarm.sim.robot.robot import parse_robot

SECONDS: Final = 40.0
"""Time limit of a proposal [s]; one takes tenths of a second, the first a second more."""

CPU_SECONDS: Final = 20

MEMORY: Final = 2 << 30
"""Address space of a proposing process [B], of which it needs a tenth."""

PROCESSES: Final = LimitedProcesses(
    "gaitswarm.sim.proposal.apart", count=1, seconds=SECONDS, cpu_seconds=CPU_SECONDS, memory=MEMORY
)


def walking_proposal(
    urdf: str,
    name: str,
    actuator: ActuatorChoice = "auto",
    frame: Frame = AS_IT_IS,
    bounds: MeshBounds = no_meshes,
) -> Proposal:
    """Propose a robot, and check that it can be used and that its legs reach."""
    proposal = propose_robot(urdf, name, actuator, frame, bounds)
    robot = parse_robot(proposal.toml, proposal.urdf)
    with by_line(urdf):
        fitted = [walk_within_reach(robot, walk) for walk in proposal.job["scenarios"]]
    return proposal.with_guesses(
        [note for _, note in fitted if note],
        job={**proposal.job, "scenarios": [walk for walk, _ in fitted]},
    )


def propose_apart(
    urdf: str, name: str, actuator: ActuatorChoice = "auto", frame: Frame = AS_IT_IS
) -> Proposal:
    """Propose a robot in another process with limits of time, processor and memory."""
    bounds.check_urdf(urdf)
    try:
        made = PROCESSES.ask(
            {"urdf": urdf, "name": name, "actuator": actuator, "frame": asdict(frame)}
        )
    except ProcessEnded as error:
        raise RobotFileError(
            f"robot.urdf: cannot propose a robot.toml: this {error}; write one by hand, as"
            " docs/robots.md explains"
        ) from error
    except SimulationInputError as error:
        raise RobotFileError(str(error)) from error
    return Proposal(
        made["toml"], made["urdf"], made["job"], tuple(made["guesses"]), tuple(made["problems"])
    )


def _answer(request: Document) -> Document:
    made = walking_proposal(
        request["urdf"], request["name"], request["actuator"], Frame(**request["frame"])
    )
    return asdict(made)


if __name__ == "__main__":
    serve(_answer)
