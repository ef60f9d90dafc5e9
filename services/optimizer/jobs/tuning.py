"""Jobs that tune a drive. The same object is request body, stored JSON and argument."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from services.optimizer.jobs.design_space import DesignSpace
from services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice, judge
from services.optimizer.jobs.spec import Judgement, Spec
from sim.case import Case, Walk
from sim.controllers import CONTROLLERS, ControllerName
from sim.identification.recorded_walk import Recordings
from sim.outcome import OBJECTIVES, Objective
from sim.scenario import GAIT_VARIABLES, SCENARIOS, Scenario, ScenarioChoice, find_scenario

Floats = NDArray[np.float64]


class JobSpec(Spec):
    """Tuning of a drive: which variables, in which scenarios, by which measure, how long."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "chapter 4, preference A",
                    "controller": "fuzzy-pi",
                    "scenarios": [scenario.name for scenario in SCENARIOS],
                    "preference": "A",
                    "optimizer": {"name": "pso", "particles": 25},
                    "iterations": 25,
                    "seed": 1,
                }
            ]
        },
    )

    kind: Literal["tuning"] = Field(default="tuning", description="Tune a drive to walk well.")
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller to be tuned; see /v1/controllers."
    )
    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Walks in which every design is judged: names or numbers of presets (see"
        " /v1/scenarios), or scenarios of your own.",
    )
    preference: PreferenceChoice = Field(
        default="A", description="How objectives are weighed: A, B, C of table 4.5, or your own."
    )

    @model_validator(mode="after")
    def _can_be_run(self) -> JobSpec:
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"scenarios: {name!r} is named twice")
        self.design_space()
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(
            find_scenario(entry) if isinstance(entry, str) else entry for entry in self.scenarios
        )

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference

    def design_space(self) -> DesignSpace:
        """See `Spec.design_space`: the controller's variables, and any of the gait's."""
        controller = CONTROLLERS[self.controller]
        return DesignSpace.build(
            required=controller.variables,
            optional=GAIT_VARIABLES,
            chosen=self.variables,
            fixed=self.fixed,
        )

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """See `Spec.objectives`: f1..f6 of table 4.1."""
        return OBJECTIVES

    @property
    def case_names(self) -> tuple[str, ...]:
        """See `Spec.case_names`: the scenarios."""
        return tuple(scenario.name for scenario in self.resolved_scenarios())

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        """See `Spec.cases`: one walk in each scenario."""
        names = self.design_space().names
        return tuple(
            Walk(self.robot, self.controller, scenario, names)
            for scenario in self.resolved_scenarios()
        )

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """See `Spec.judge`: by the preference."""
        return judge(objectives, failed, self.resolved_preference())

    def resolved(self) -> JobSpec:
        """See `Spec.resolved`."""
        space = self.design_space()
        return self.model_copy(
            update={
                "scenarios": self.resolved_scenarios(),
                "preference": self.resolved_preference(),
                "variables": space.variables,
                "fixed": dict(space.fixed),
            }
        )
