"""Scenarios held out from tuning, for certificates"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice, load_robot
from gaitswarm.sim.scenario import HELD_OUT, SCENARIOS, Scenario
from gaitswarm.sim.simulate import check_reach

CASES: Final = 8
"""Default number of scenarios of a certificate."""

LEAST: Final = 2
"""Minimum number of held-out ones among them."""

TURN: Final = 0.5
"""Of turning scenarios, as in table 4.2 [1]."""

SLOPE: Final = 5.0
"""Of slopes up and down [deg]: half of table 4.2's, as other robots are not built for one."""

LOAD_SHARE: Final = 0.25
"""Load as a share of the robot's mass, as in table 4.2 [1]."""

PACE: Final = 0.8
"""Cycle time of a faster scenario as a share of the tuned one; a slower one is divided by it."""

_MIRRORED: Final = ("turn-left-fast", "downhill-fast")
"""Presets that come first: the turn and the slope of table 4.2, in the other direction."""

_LONGEST_NAME: Final = 60


def certificate_scenarios(
    tuned: Sequence[Scenario] = SCENARIOS,
    robot: RobotChoice = DEFAULT_ROBOT,
    design: Mapping[str, float] | None = None,
) -> tuple[Scenario, ...]:
    """Return the scenarios a design was tuned in, then held-out ones."""
    count = max(LEAST, CASES - len(tuned))
    if load_robot(robot).ships:
        names = {scenario.name for scenario in tuned}
        others = [scenario for scenario in HELD_OUT if scenario.name not in names]
        others.sort(key=lambda scenario: scenario.name not in _MIRRORED)
    else:
        others = _derived(tuned, robot, design or {})
    return (*tuned, *others[:count])


def certificate_walks(
    tuned: Sequence[Scenario], robot: RobotChoice, design: Mapping[str, float]
) -> dict[str, Any]:
    """Return the fields of a certificate's spec that determine the scenarios."""
    scenarios = certificate_scenarios(tuned, robot, design)
    if load_robot(robot).ships:
        return {"scenarios": scenarios}
    held_out = tuple(scenario.name for scenario in scenarios[len(tuned) :])
    return {"scenarios": scenarios, "held_out": held_out}


def _derived(
    tuned: Sequence[Scenario], robot: RobotChoice, design: Mapping[str, float]
) -> list[Scenario]:
    """Return reachable, distinct variations of the fastest tuned scenario."""
    fastest = max(tuned, key=lambda scenario: scenario.stride / scenario.cycle_time)
    gait = {name: value for name, value in design.items() if name in GAIT_CATALOGUE}
    names = {scenario.name for scenario in tuned}
    walked = [_unnamed(with_gait(scenario, gait)) for scenario in tuned]
    derived = []
    for suffix, changes in _changes(fastest, load_robot(robot).mass):
        name = f"{fastest.name[: _LONGEST_NAME - len(suffix) - 1]}-{suffix}"
        try:
            scenario = Scenario.model_validate(fastest.model_dump() | changes | {"name": name})
            check_reach(scenario, tuple(design), tuple(design.values()), robot=robot)
        except (ValueError, SimulationInputError):
            # Out of a scenario's bounds, or of the legs' reach.
            continue
        other = _unnamed(with_gait(scenario, gait))
        if name not in names and other not in walked:
            walked.append(other)
            derived.append(scenario)
    return derived


def _changes(base: Scenario, mass: float) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield name suffixes and changed fields, the most different ones first."""
    yield "turn-left", {"turn": -TURN}
    yield "downhill", {"slope": -SLOPE, "slope_direction": 0.0}
    yield "loaded", {"load": round(base.load + LOAD_SHARE * mass, 3)}
    yield "faster", {"cycle_time": round(base.cycle_time * PACE, 4)}
    yield "uphill", {"slope": SLOPE, "slope_direction": 0.0}
    yield "slower", {"cycle_time": round(base.cycle_time / PACE, 4)}
    yield "turn-right", {"turn": TURN}


def _unnamed(scenario: Scenario) -> Scenario:
    return scenario.model_copy(update={"name": ""})
