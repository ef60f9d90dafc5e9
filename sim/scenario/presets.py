"""Scenarios that have a name: the six of the thesis (table 4.2), and others to judge designs by."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import AfterValidator, BeforeValidator, Tag

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input.choice import NAME, OWN, alternatives
from gaitswarm.sim.input.near_names import instead_of
from gaitswarm.sim.scenario.description import Scenario, ScenarioName

SCENARIOS: Final[tuple[Scenario, ...]] = (
    Scenario(name="normal-fast", cycle_time=1.5, radius=0.16, hip_height=0.15),
    Scenario(name="normal-slow", cycle_time=2.2, radius=0.16, hip_height=0.15),
    Scenario(name="loaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=2.0),
    Scenario(name="loaded-slow", cycle_time=2.2, radius=0.145, hip_height=0.20, load=2.0),
    Scenario(name="slope-fast", cycle_time=1.5, radius=0.20, hip_height=0.14, slope=10.0),
    Scenario(name="turn-right-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, turn=0.5),
)
"""The six scenarios of table 4.2, in its order: those that a job has unless it names others."""

_BACKWARD: Final = Scenario(
    name="backward", cycle_time=1.5, radius=0.16, hip_height=0.15, direction="backward"
)

HELD_OUT: Final[tuple[Scenario, ...]] = (
    Scenario(name="turn-left-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, turn=-0.5),
    Scenario(name="half-loaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=1.0),
    Scenario(name="overloaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=3.0),
    Scenario(name="downhill-fast", cycle_time=1.5, radius=0.20, hip_height=0.14, slope=-10.0),
    Scenario(
        name="slope-left-fast",
        cycle_time=1.5,
        radius=0.20,
        hip_height=0.14,
        slope=10.0,
        slope_direction=90.0,
    ),
    Scenario(
        name="slope-right-fast",
        cycle_time=1.5,
        radius=0.20,
        hip_height=0.14,
        slope=10.0,
        slope_direction=-90.0,
    ),
    _BACKWARD,
    Scenario(name="shove-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, shove=6.0),
)
"""Walks beside those of table 4.2, for which no design of the thesis was optimized: what a design
is worth in them shows whether it was made for its scenarios alone."""

PRESETS: Final[tuple[Scenario, ...]] = (
    *SCENARIOS,
    Scenario(name="straight", cycle_time=1.5, radius=0.16, hip_height=0.15),
    _BACKWARD,
    Scenario(name="drop", cycle_time=1.5, radius=0.16, hip_height=0.15, drop=0.03),
    Scenario(
        name="stuck-leg", cycle_time=1.5, radius=0.16, hip_height=0.15, stuck_leg="right_middle"
    ),
    *(scenario for scenario in HELD_OUT if scenario is not _BACKWARD),
)
"""All scenarios that have a name and, by their order, a number from 1 on.

`straight` is the walk of chapter 3 (section 3.1), whose designs bring a gait of their own, and
`backward` that of figs. 2.7 and 2.8; `drop` and `stuck-leg` are the protection's cases (4.3.2).
"""


def find_scenario(name: str) -> Scenario:
    """A preset."""
    for number, scenario in enumerate(PRESETS, start=1):
        if name in (scenario.name, str(number)):
            return scenario
    names = [scenario.name for scenario in PRESETS]
    listed = (f"{k} {known}" for k, known in enumerate(names, start=1))
    raise SimulationInputError(f"unknown scenario {name!r}; {instead_of(name, names, listed)}")


def _preset_exists(name: str) -> str:
    find_scenario(name)
    return name


def _number_as_name(value: object) -> object:
    """1 as "1", which `find_scenario` knows."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


ScenarioChoice = Annotated[
    Annotated[ScenarioName, AfterValidator(_preset_exists), Tag(NAME)]
    | Annotated[Scenario, Tag(OWN)],
    alternatives("must be the name or number of a preset, or an object: a scenario of your own"),
    BeforeValidator(_number_as_name),
]
"""How jobs and requests choose a walk."""
