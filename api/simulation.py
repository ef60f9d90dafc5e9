"""One design walking on request: what is asked, and how it is done. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from api.views import SimulationView
from api.walk_request import WalkRequest, resolved
from services.optimizer.preference import PREFERENCES, Preference, PreferenceName
from sim.scenario import SCENARIOS, Scenario, ScenarioName, find_scenario
from sim.simulate import Backend, simulate


class SimulationRequest(WalkRequest):
    """One design and the walks in which to try it."""

    scenarios: tuple[ScenarioName | Scenario, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Walks: names or numbers of presets (see /v1/scenarios), or your own.",
        examples=[["normal-fast", "2"]],
    )
    preference: PreferenceName | Preference = Field(
        default="A", description="How objectives are weighed: A, B, C of table 4.5, or your own."
    )
    log: bool = Field(
        default=False, description="Whether to return the 500 Hz log of every walk; it is large."
    )

    @field_validator("scenarios")
    @classmethod
    def _presets_exist(cls, entries: tuple[str | Scenario, ...]) -> tuple[str | Scenario, ...]:
        for entry in entries:
            if isinstance(entry, str):
                find_scenario(entry)
        return entries

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"scenarios: {name!r} is named twice")
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(map(resolved, self.scenarios))

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference


def run_simulation(request: SimulationRequest, *, backend: Backend = "auto") -> SimulationView:
    """Let the design walk in every scenario.

    Raises InvalidRequest that names the field for a design that cannot be compiled or a gait that
    leaves the legs' reach.
    """
    scenarios = request.resolved_scenarios()
    # All walks are checked before the first is run.
    request.check_design()
    for index, scenario in enumerate(scenarios):
        request.check_reach(scenario, field=f"scenarios.{index}")
    walks = [
        simulate(
            scenario,
            request.controller,
            tuple(request.design),
            np.array([tuple(request.design.values())], dtype=np.float64),
            robot=request.robot,
            log=request.log,
            backend=backend,
        )
        for scenario in scenarios
    ]
    return SimulationView.from_walks(
        robot=request.robot,
        controller=request.controller,
        design=request.design,
        preference=request.resolved_preference(),
        names=[scenario.name for scenario in scenarios],
        statuses=np.concatenate([walk.outcome.statuses for walk in walks]),
        objectives=np.concatenate([walk.outcome.objectives for walk in walks]),
        logs=[log for walk in walks for log in walk.logs],
    )
