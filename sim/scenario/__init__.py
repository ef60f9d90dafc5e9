"""Walking scenarios (thesis table 4.2): what they are, and those that have a name."""

from __future__ import annotations

from gaitswarm.sim.scenario.description import (
    BY_LEG_GROUP,
    GAIT_NAMES,
    GaitName,
    Scenario,
    ScenarioName,
)
from gaitswarm.sim.scenario.presets import (
    HELD_OUT,
    PRESETS,
    SCENARIOS,
    ScenarioChoice,
    find_scenario,
)

__all__ = [
    "BY_LEG_GROUP",
    "GAIT_NAMES",
    "HELD_OUT",
    "PRESETS",
    "SCENARIOS",
    "GaitName",
    "Scenario",
    "ScenarioChoice",
    "ScenarioName",
    "find_scenario",
]
