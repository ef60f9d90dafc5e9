"""What a job is asked to do. The same object is request body, stored JSON and argument."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, field_validator, model_validator

from services.optimizer.design_space import DesignSpace
from services.optimizer.optimizers.pso import PsoSettings
from services.optimizer.preference import PREFERENCES, Preference, PreferenceName
from sim.controllers import CONTROLLERS, ControllerName
from sim.robot import RobotSource
from sim.scenario import GAIT_VARIABLES, SCENARIOS, Scenario, ScenarioName, find_scenario
from sim.variables import Variable, VariableName


class JobSpec(BaseModel):
    """An optimization: which variables to tune, in which scenarios, by which measure, how long."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
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

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    name: str = Field(default="", max_length=200, description="For people; need not be unique.")
    robot: RobotSource = Field(
        default="szabadka2",
        description="Robot to simulate, by name, or a variant with another law of friction or with"
        " gearlash, or the text of the files of your own.",
    )
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller to be tuned; see /v1/controllers."
    )
    scenarios: tuple[ScenarioName | Scenario, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Walks in which every design is judged: names or numbers of presets (see"
        " /v1/scenarios), or scenarios of your own.",
    )
    variables: tuple[VariableName | Variable, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=64,
        description="What the optimizer may choose: names (with the catalogue's bounds) or"
        " variables with bounds of your own. Default: all of the controller's, less `fixed`.",
    )
    fixed: dict[VariableName, FiniteFloat] = Field(
        default_factory=dict,
        description="Variables held at one value, by name; controller or gait variables.",
    )
    preference: PreferenceName | Preference = Field(
        default="A", description="How objectives are weighed: A, B, C of table 4.5, or your own."
    )
    optimizer: PsoSettings = Field(
        default_factory=PsoSettings, description="Search algorithm and its settings."
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = Field(
        default=25, description="Budget: iterations to run (generations of the swarm)."
    )
    seed: int = Field(
        default=1, ge=0, lt=2**63, description="Source of all randomness; same seed, same bits."
    )

    @field_validator("scenarios")
    @classmethod
    def _presets_exist(cls, entries: tuple[str | Scenario, ...]) -> tuple[str | Scenario, ...]:
        for entry in entries:
            if isinstance(entry, str):
                find_scenario(entry)
        return entries

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
        """The optimizer's variables and the fixed ones, checked against the catalogue."""
        controller = CONTROLLERS[self.controller]
        return DesignSpace.build(
            required=controller.variables,
            optional=GAIT_VARIABLES,
            chosen=self.variables,
            fixed=self.fixed,
        )

    def resolved(self) -> JobSpec:
        """The same job with every preset written out, so that it stays what it was when stored."""
        space = self.design_space()
        return self.model_copy(
            update={
                "scenarios": self.resolved_scenarios(),
                "preference": self.resolved_preference(),
                "variables": space.variables,
                "fixed": dict(space.fixed),
            }
        )
