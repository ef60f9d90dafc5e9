"""Jobs that tune a drive. The same object is request body, stored JSON and argument."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Annotated, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.judgement import Judgement
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.kinds.walks import WalksSpec
from gaitswarm.services.optimizer.jobs.preference import PreferenceChoice, objective_vectors
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.sim.case import Case, Walk
from gaitswarm.sim.case_registry import CASES, CaseFamily, CaseSettings, create_case
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import BeyondJointLimit, SimulationInputError, UnreachablePose
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, GAIT_VARIABLES, orders_searched, with_gait
from gaitswarm.sim.identification.recorded_walk import Recordings
from gaitswarm.sim.plugins import PluginSettings
from gaitswarm.sim.scenario import SCENARIOS, ScenarioChoice
from gaitswarm.sim.simulate import check_reach
from gaitswarm.sim.variables import Variable, split_name
from gaitswarm.sim.worlds import check_worlds
from gaitswarm.sim.worlds.walks import PerturbedWalk


def _case_settings(choice: object) -> object:
    """Settings of a name, and a refusal of one that is none."""
    if isinstance(choice, str):
        choice = {"name": choice}
    if isinstance(choice, Mapping):
        name = choice.get("name")
        if isinstance(name, str) and name not in CASES:
            raise ValueError(CASES.unknown(name))
    elif choice is not None and not isinstance(choice, CaseSettings):
        raise ValueError("must be a name or an object: settings of a plug-in's case")
    return choice


def _model(family: CaseFamily) -> type[CaseSettings]:
    return family.settings


class _OrName:
    """A case's name in place of its settings, in schemas."""

    @staticmethod
    def __get_pydantic_json_schema__(
        schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        found, names = handler(schema), list(CASES)
        if not names:
            return found
        return {"anyOf": [{"type": "string", "enum": names}, *found["anyOf"]]}


if TYPE_CHECKING:
    CaseChoice: TypeAlias = CaseSettings | None
else:
    CaseChoice = Annotated[
        None, PluginSettings(CASES, _model, "/v1/cases"), BeforeValidator(_case_settings), _OrName()
    ]
"""What a job may say; once it is read, a name has become settings."""

Floats = NDArray[np.float64]

GAIT_OF_CHAPTER_3: Final = ("cycle_time", "stride", "height", "duty_factor", "fir_ms")
"""The gait variables that chapter 3 optimizes together with a controller's (table 3.2)."""


_POSTURE: Final = ("hip_height", "radius")
"""Gait variables of which no end of the bounds is easier to reach than the other."""


class JobSpec(WalksSpec):
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

    has_objective_vectors = True

    unwalked = WalksSpec.unwalked | {"preference"}

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
        default="A",
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own.",
    )
    case: CaseChoice = Field(
        default=None,
        description="What evaluates designs in each scenario: a plug-in's case by name, or its"
        " settings (see /v1/cases); null walks in gaitswarm's simulator.",
    )
    worlds: TuningWorlds | None = Field(
        default=None,
        description="Worlds that differ from the model, in each of which every design walks through"
        " every scenario, so that the search pays for robustness; null judges by the model alone.",
        examples=[None, {"count": 8, "aggregate": "cvar"}],
    )

    @model_validator(mode="after")
    def _can_be_run(self) -> JobSpec:
        if self.case is not None and self.worlds is not None:
            raise ValueError(f"worlds: {self.case.name} evaluates designs in the model alone")
        if self.case is not None and self.precision != "double":
            raise ValueError(f"precision: {self.case.name} has one of its own; leave it out")
        self.design_space()
        return self

    def design_space(self) -> DesignSpace:
        """The controller's variables, and any of its conventions and of the gait's."""
        controller = CONTROLLERS[self.controller]
        return DesignSpace.build(
            required=controller.variables,
            optional=(*controller.conventions, *GAIT_VARIABLES),
            chosen=self.variables,
            fixed=self.fixed,
        )

    def with_gait_searched(self) -> JobSpec:
        """The same job that searches the gait of chapter 3, too, but what it holds fixed of it."""
        space = self.design_space()
        added = tuple(name for name in GAIT_OF_CHAPTER_3 if name not in space.names)
        document = self.model_dump() | {"variables": (*space.variables, *added)}
        return JobSpec.model_validate(document)

    def check_can_be_simulated(self) -> None:
        """Check that the controller can be compiled and that the legs reach their feet's paths.

        A gait that is itself searched may leave the legs' reach at some points of the box: there a
        status says so. Only a scenario whose gentlest gait is beyond reach is refused.

        Raises:
            InvalidRequest: bounds or values that nothing can run with, or a scenario out of reach;
                names the field.
        """
        self.check_optimizer()
        self.check_precision()
        space, scenarios = self.design_space(), self.resolved_scenarios()
        for design in space.corners():
            try:
                law = CONTROLLERS[self.controller].compile(design)
                with_gait(scenarios[0], _gait_of(design))
            except SimulationInputError as error:
                raise space.refusal(error) from error
            self.check_drives(law)
        self._check_worlds()
        searches_posture = any(split_name(v.name)[0] in _POSTURE for v in space.variables)
        gentlest = _gait_of(dict(space.fixed)) | _gentlest_gait(space.variables)
        orders = orders_searched(space.variables)
        for (index, scenario), order in product(enumerate(scenarios), orders):
            gait = gentlest | order
            try:
                check_reach(scenario, tuple(gait), tuple(gait.values()), robot=self.robot)
            except SimulationInputError as error:
                if str(error).partition(":")[0] in space.names:
                    raise space.refusal(error) from error
                if isinstance(error, UnreachablePose | BeyondJointLimit) and searches_posture:
                    continue
                raise InvalidRequest(str(error), field=f"scenarios.{index}") from error
        try:
            self.cases({})
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field="case") from error

    def _check_worlds(self) -> None:
        """Raises InvalidRequest for a range that cannot be simulated."""
        variables = () if self.worlds is None else self.worlds.variables()
        ends = np.array([[v.low for v in variables], [v.high for v in variables]])
        try:
            check_worlds(tuple(v.name for v in variables), ends)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field="worlds.ranges") from error

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the scenarios, in order; with that of the world where there are worlds."""
        names = super().case_names
        if self.worlds is None:
            return names
        return tuple(f"{name}.world-{k}" for name in names for k in range(self.worlds.count))

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        """One walk in each scenario, or in each world of it; or what the job has in its place.

        Args:
            recordings: none are needed.

        Returns:
            The walks, in the order of `case_names`.

        Raises:
            SimulationInputError: A plug-in's case cannot be made here.
        """
        names = self.design_space().names
        if self.worlds is not None:
            pairs = product(self.resolved_scenarios(), self.worlds.drawn())
            return tuple(
                PerturbedWalk(
                    name, self.robot, self.controller, scenario, world, names, self.precision
                )
                for name, (scenario, world) in zip(self.case_names, pairs, strict=True)
            )
        walks = tuple(
            Walk(self.robot, self.controller, scenario, names, self.precision)
            for scenario in self.resolved_scenarios()
        )
        if self.case is None:
            return walks
        return tuple(create_case(self.case, walk) for walk in walks)

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Of plug-ins: what brings its controller, and what its case computes with."""
        case = () if self.case is None else CASES[self.case.name].libraries
        return (*CONTROLLERS.distribution(self.controller), *case)

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the preference (eq. 3.8, 4.1, 4.2).

        Args:
            objectives: (n, K, 6) raw objectives, in their units.
            failed: (n, K), true for a walk without a result.

        Returns:
            Fitness and utilities of the n designs.
        """
        judged = super().judge(objectives, failed)
        return judged if self.worlds is None else self.worlds.judged(judged.log_utilities)

    def told(self, objectives: Floats, failed: NDArray[np.bool_], fitness: Floats) -> Floats:
        """What the search is told: fitness, or to a multi-objective method what it trades.

        Args:
            objectives: As for `Spec.told`.
            failed: As for `Spec.told`.
            fitness: As for `Spec.told`.

        Returns:
            As of `Spec.told`.
        """
        if METHODS[self.search.name].multi_objective:
            return self.objective_vectors(objectives, failed)
        return fitness

    def objective_vectors(self, objectives: Floats, failed: NDArray[np.bool_]) -> Floats:
        """What designs come to in f1 to f5, over all scenarios, without any bias.

        They depend on no preference: a multi-objective search goes the same way whatever preference
        its designs are judged by.

        Args:
            objectives: (n, K, 6) raw objectives, in their units.
            failed: (n, K), true for a walk without a result.

        Returns:
            (n, 5) geometric means over the scenarios, of the aggregates where there are worlds; a
            row is +inf throughout where they cannot be given.
        """
        if self.worlds is None:
            return objective_vectors(objectives, failed)
        return self.worlds.objective_vectors(objectives, failed)

    def resolved(self) -> JobSpec:
        """The same job with scenarios, preference, variables and optimizer written out."""
        space = self.design_space()
        return self.model_copy(
            update={
                "scenarios": self.resolved_scenarios(),
                "preference": self.resolved_preference(),
                "variables": space.variables,
                "fixed": space.shown_fixed,
                "optimizer": self.search,
                "worlds": self.worlds
                and self.worlds.model_copy(update={"ranges": self.worlds.variables()}),
            }
        )


def _gait_of(design: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in design.items() if name in GAIT_CATALOGUE}


def _gentlest_gait(searched: Sequence[Variable]) -> dict[str, float]:
    """Of the gaits that may be searched, the one whose feet stray least: short, flat, smooth."""
    least = {v.name: v.low for v in searched if split_name(v.name)[0] in ("stride", "height")}
    # Any value tells whether the robot has such a group of legs.
    least |= {
        v.name: 0.5 * (v.low + v.high)
        for v in searched
        if v.name in _POSTURE or (split_name(v.name)[1] and v.name not in least)
    }
    return least | {v.name: v.high for v in searched if v.name == "fir_ms"}
