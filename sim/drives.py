"""Named drives side by side on the same walks (the form of thesis table 5.1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.quadratic_spline import driven_as_in_2011
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate


def _in_the_scenarios_own_gait(scenario: Scenario) -> Scenario:
    return scenario


@dataclass(frozen=True, slots=True)
class NamedDrive:
    """A controller with its design, and what it changes of a scenario's trajectory.

    Attributes:
        name: of the drive.
        description: with its source.
        controller: name of the motor controller.
        design: by variable, controller and gait alike.
        driven: from a scenario to the same one with the drive's own trajectory.
    """

    name: str
    description: str
    controller: ControllerName
    design: Mapping[str, float]
    driven: Callable[[Scenario], Scenario] = _in_the_scenarios_own_gait


@dataclass(frozen=True, slots=True)
class WalkFigures:
    """One drive in one scenario; figures are None if it failed.

    Attributes:
        drive: its name.
        scenario: its name.
        status: how the walk ended.
        speed: [m/s].
        power: [W].
        effectivity: [m/J].
        objectives: f1 to f6 by name.
    """

    drive: str
    scenario: str
    status: Status
    speed: float | None
    power: float | None
    effectivity: float | None
    objectives: Mapping[str, float | None]


def _published(controller: ControllerName, study: str) -> Mapping[str, float]:
    """Without its gait: drives are compared in the scenario's, or in one that they name."""
    design = CONTROLLERS[controller].published[study]
    return {name: value for name, value in design.items() if name not in GAIT_CATALOGUE}


DRIVES: Final[Mapping[str, NamedDrive]] = MappingProxyType(
    {
        drive.name: drive
        for drive in (
            NamedDrive(
                "2011",
                "P = 0.25, spline trajectory in 42 steps a cycle, no filter (appendix .2.1)",
                "p",
                _published("p", "2011"),
                driven_as_in_2011,
            ),
            NamedDrive(
                "2016",
                "published Fuzzy-PI A, trajectory at 500 Hz (section 5.4)",
                "fuzzy-pi",
                _published("fuzzy-pi", "A"),
            ),
            NamedDrive("pi", "PI in the thesis's optimized range", "pi", {"P": 0.45, "I": 0.1}),
            NamedDrive(
                "fuzzy-pi-3",
                "published Fuzzy-PI of chapter 3, in the scenario's own gait",
                "fuzzy-pi-3",
                _published("fuzzy-pi-3", "fuzzy-pso-ps"),
            ),
        )
    }
)
"""Drives that the thesis compares."""


def find_drive(name: str) -> NamedDrive:
    """A drive that the thesis compares."""
    if name not in DRIVES:
        raise SimulationInputError(f"drive: unknown {name!r}; {instead_of(name, DRIVES)}")
    return DRIVES[name]


def compare(
    drives: Sequence[NamedDrive],
    scenarios: Sequence[Scenario],
    *,
    robot: RobotChoice = DEFAULT_ROBOT,
) -> tuple[WalkFigures, ...]:
    """Every drive in every scenario."""
    return tuple(
        walk_figures(drive, scenario, robot=robot) for scenario in scenarios for drive in drives
    )


def walk_figures(
    drive: NamedDrive, scenario: Scenario, *, robot: RobotChoice = DEFAULT_ROBOT
) -> WalkFigures:
    """Let one drive walk. Power is energy per metre times speed."""
    gait = {name: v for name, v in drive.design.items() if name in GAIT_CATALOGUE}
    walked = drive.driven(with_gait(scenario, gait))
    names = list(drive.design)
    outcome = simulate(
        walked, drive.controller, names, np.array([list(drive.design.values())]), robot=robot
    ).outcome
    f1, f2, f3, f4, f5, f6 = (
        float(value) if np.isfinite(value) else None for value in outcome.objectives[0]
    )
    return WalkFigures(
        drive=drive.name,
        scenario=scenario.name,
        status=Status(int(outcome.statuses[0])),
        speed=None if f5 is None else 1.0 / f5,
        power=None if f4 is None or f5 is None else f4 / f5,
        effectivity=None if f4 is None else 1.0 / f4,
        objectives={
            "torque": f1,
            "acceleration": f2,
            "angular_acceleration": f3,
            "energy": f4,
            "reciprocal_speed": f5,
            "height_loss": f6,
        },
    )


def drive_of_design(
    name: str, controller: ControllerName, design: Mapping[str, float]
) -> NamedDrive:
    """A drive from a design file or a job's best."""
    own = {k: v for k, v in design.items() if k not in GAIT_CATALOGUE}
    CONTROLLERS[controller].compile(own)
    return NamedDrive(name, f"{controller} as designed", controller, design)
