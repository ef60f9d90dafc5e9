"""Named gaits as planned for a robot's legs, without simulation."""

from __future__ import annotations

from contextlib import suppress
from typing import Final

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest, simulation_errors
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.errors import BeyondJointLimit, UnreachablePose
from gaitswarm.sim.gait.gaits import GAITS, find_gait, leg_gaits, suits, supporting
from gaitswarm.sim.gait.stability import static_stability
from gaitswarm.sim.robot import RobotChoice, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import GaitName, Scenario
from gaitswarm.simulation import PlannedGaitView

COLUMNS: Final = 40
"""Moments of a cycle that a diagram shows."""

_MOST_DUTY: Final = 0.95

_OWN: Final = "of the scenario and the robot's description"


class GaitView(View):
    """A gait as planned for the robot in the scenario."""

    name: GaitName = Field(description="Name, as scenarios have it.", examples=["crawl"])
    description: str = Field(description="What it is, with its source.")
    legs: list[int] = Field(examples=[[4]])
    """Numbers of legs that it is defined for; any if empty."""
    suits: bool = Field(description="Whether it is defined for the robot's legs.")
    lags: dict[str, float] = Field(
        default_factory=dict,
        description="By leg the share of the cycle by which its foot comes down after the first"
        " one's [1]; empty if the gait is not defined for the robot.",
        examples=[{"left_rear": 0.0, "left_front": 0.25}],
    )
    planned: PlannedGaitView | None = None
    """Duty factor and static stability in the scenario; null for a gait that is not defined for the
    robot, or out of its legs' reach."""
    support: dict[str, str] = Field(default_factory=dict)
    """Footfall diagram: by leg one cycle in 40 columns, # where the foot stands and . where it
    swings."""


class GaitsView(View):
    """Gaits for a robot."""

    robot: str = Field(description="Name of the robot.", examples=["quadruped"])
    scenario: str = Field(examples=["crawl"])
    """Scenario that provides posture, stride and sway."""
    items: list[GaitView] = Field(description="The robot's own gait first.")


def planned_gaits(
    source: RobotChoice,
    scenario: Scenario,
    *,
    name: str | None = None,
    duty_factor: float | None = None,
) -> GaitsView:
    """Plan all gaits of a robot."""
    with simulation_errors("robot"):
        robot = load_robot(source)
    if name not in (None, "own"):
        with simulation_errors("gait"):
            find_gait(str(name))
    if duty_factor is not None and not 0.1 <= duty_factor <= _MOST_DUTY:
        raise InvalidRequest(f"{duty_factor:g} is not 0.1 to {_MOST_DUTY}", field="duty-factor")
    names: tuple[GaitName, ...] = ("own", *GAITS)
    items = [
        _view(robot, scenario, gait, duty_factor) for gait in names if name is None or gait == name
    ]
    return GaitsView(robot=robot.description.name, scenario=scenario.name, items=items)


def _view(robot: Robot, scenario: Scenario, name: GaitName, duty: float | None) -> GaitView:
    """Plan a gait; a named one has only the scenario's posture, stride and sway."""
    known = GAITS.get(name)
    view = GaitView(
        name=name,
        description=_OWN if known is None else known.description,
        legs=[] if known is None else list(known.legs),
        suits=known is None or suits(known, robot.legs),
    )
    if not view.suits:
        return view
    changes: dict[str, object] = {}
    if known is not None:
        duty = duty or min(_MOST_DUTY, known.duty_factor(len(robot.legs)))
        changes = {"gait": name, "phases": None, "start_phase": 0.0, "by_group": None}
    if duty is not None:
        changes |= {"duty_factor": duty, "duty_phase": "support"}
    walked, planned = scenario.model_copy(update=changes), None
    with simulation_errors("scenario"):
        of_legs = leg_gaits(robot, walked)
        with suppress(UnreachablePose, BeyondJointLimit):
            planned = PlannedGaitView.model_validate(static_stability(robot, walked))
    stands = supporting(of_legs, (np.arange(COLUMNS) + 0.5) / COLUMNS)
    legs = [leg.name for leg in robot.legs]
    return view.model_copy(
        update={
            "lags": {
                leg: round(-gait.phase % 1.0, 6) % 1.0
                for leg, gait in zip(legs, of_legs, strict=True)
            },
            "planned": planned,
            "support": {
                leg: "".join("#" if stood else "." for stood in stands[:, k])
                for k, leg in enumerate(legs)
            },
        }
    )
