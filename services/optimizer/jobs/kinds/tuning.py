"""Tuning jobs, and the designs that theirs are compared with

One model serves as request body, stored JSON and argument.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaitswarm.services.optimizer.errors import InvalidRequest, simulation_errors
from gaitswarm.services.optimizer.jobs.constraints import (
    Cases,
    Constraints,
    Limit,
    feasible_first,
    violations,
)
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import (
    Aggregation,
    ScenarioAggregate,
    ScenarioWeights,
    TuningWorlds,
)
from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    Judgement,
    Preference,
    PreferenceChoice,
    figure_of_merit,
    judge,
    log_utilities,
    objective_vectors,
)
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case_registry import CASES, CaseSettings, create_case
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, GAIT_VARIABLES, orders_searched, with_gait
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import BeyondJointLimit, SimulationInputError, UnreachablePose
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import N_OBJECTIVES, OBJECTIVES, RESULTS, Objective
from gaitswarm.sim.plugins import PluginSettings
from gaitswarm.sim.robot.variant import RobotFiles
from gaitswarm.sim.scenario import SCENARIOS, ScenarioChoice, Scenarios
from gaitswarm.sim.variables import Variable, split_name

if TYPE_CHECKING:
    from gaitswarm.sim.case import Case
    from gaitswarm.sim.identification import Recordings


class WalksSpec(Scenarios, Spec):
    """A job with scenarios and a preference; each kind declares these fields with its defaults."""

    if TYPE_CHECKING:
        preference: PreferenceChoice

    def resolved_preference(self) -> Preference:
        """Return the preference with a preset resolved."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Raw objectives of a walk: f1..f6 of table 4.1."""
        return OBJECTIVES

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the scenarios, in order."""
        return tuple(scenario.name for scenario in self.resolved_scenarios())

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the preference (eq. 3.8, 4.1, 4.2)."""
        return judge(objectives, failed, self.resolved_preference())

    def figure_of_merit(self, fitness: float) -> float | None:
        """Return F of eq. 3.1, maximized; None unless the preference is that of chapter 3."""
        return figure_of_merit(fitness, self.resolved_preference())


def _case_settings(choice: object) -> object:
    """Convert a name to settings. Raises ValueError for an unknown one."""
    if isinstance(choice, str):
        choice = {"name": choice}
    if isinstance(choice, Mapping):
        name = choice.get("name")
        if isinstance(name, str) and name not in CASES:
            raise ValueError(CASES.unknown(name))
    elif choice is not None and not isinstance(choice, CaseSettings):
        raise ValueError("must be a name or an object with settings of a plug-in's case")
    return choice


class _OrName:
    """Allows a case's name in place of its settings, in schemas."""

    @staticmethod
    def __get_pydantic_json_schema__(
        schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        settings, names = handler(schema), list(CASES)
        if not names:
            return settings
        return {"anyOf": [{"type": "string", "enum": names}, *settings["anyOf"]]}


if TYPE_CHECKING:
    CaseChoice: TypeAlias = CaseSettings | None
else:
    CaseChoice = Annotated[
        None,
        PluginSettings(CASES, attrgetter("settings"), "/v1/cases"),
        BeforeValidator(_case_settings),
        _OrName(),
    ]
"""Choice of a case; validation replaces a name by settings."""

GAIT_OF_CHAPTER_3: Final = ("cycle_time", "stride", "height", "duty_factor", "fir_ms")
"""Gait variables that chapter 3 optimizes together with a controller's (table 3.2)."""

_POSTURE: Final = ("hip_height", "radius")
"""Gait variables for which neither end of the bounds is easier to reach."""


class JobSpec(WalksSpec):
    """A tuning job: controller, scenarios, preference and the search."""

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

    outcome_independent_fields = WalksSpec.outcome_independent_fields | {
        "preference",
        "scenario_weights",
        "scenario_aggregate",
        "constraints",
    }

    kind: Literal["tuning"] = Field(default="tuning", description="Tune a motor controller.")
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller to be tuned; see /v1/controllers."
    )
    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Scenarios in which every design is simulated: names or numbers of presets"
        " (see /v1/scenarios), or custom scenarios.",
    )
    preference: PreferenceChoice = Field(
        default="A",
        description="Weights of the objectives: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " a custom preference.",
    )
    constraints: Constraints = ()
    case: CaseChoice = Field(
        default=None,
        description="Evaluator of designs in each scenario: a plug-in's case, by name or with"
        " settings (see /v1/cases); null: gaitswarm's simulator.",
    )
    worlds: TuningWorlds | None = Field(
        default=None,
        description="Perturbed models in which every design is simulated in every scenario, so"
        " that the search favors robust designs; null: the nominal model alone.",
        examples=[None, {"count": 8, "aggregate": "cvar"}],
    )

    scenario_weights: ScenarioWeights = Field(default_factory=dict)
    scenario_aggregate: ScenarioAggregate = "mean"

    @model_validator(mode="after")
    def _can_be_run(self) -> JobSpec:
        if self.scenario_weights and self.scenario_aggregate == "worst":
            raise ValueError("scenario_weights: the worst scenario has no weight; omit them")
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in self.scenario_weights:
            if name not in names:
                raise ValueError(
                    f"scenario_weights: the job has no scenario {name!r}; {instead_of(name, names)}"
                )
        if self.case is not None and self.worlds is not None:
            raise ValueError(f"worlds: {self.case.name} supports the nominal model alone; omit it")
        if self.case is not None and self.precision != "double":
            raise ValueError(f"precision: {self.case.name} has its own precision; omit it")
        self.design_space()
        self.limits(known=False)
        return self

    def limits(self, *, known: bool = True) -> list[Limit]:
        """Return the limits of the constraints by case and quantity.

        Args:
            known: Whether the values of all references are; they are looked up at submission. If
                false, limits without them are left out.

        Raises:
            ValueError: A constraint names an unknown quantity or scenario, contradicts another, or
                lacks the values of its reference; names the constraint.
        """
        if not self.constraints:
            return []
        try:
            return self.constraint_cases.limits(self.constraints, known=known)
        except ValueError as error:
            raise ValueError(f"constraints.{error}") from error

    @property
    def constraint_cases(self) -> Cases:
        """Cases and columns that constraints may name."""
        worlds = 1 if self.worlds is None else self.worlds.count
        scenarios = [s.name for s in self.resolved_scenarios() for _ in range(worlds)]
        return Cases(self.case_names, scenarios, self.columns)

    def without_references(self) -> JobSpec:
        """Return the job without the values of references and the start from them."""
        bare = [c.model_copy(update={"reference": None}) for c in self.constraints]
        relative = any(c.relative_to is not None for c in bare)
        start = () if relative else self.start
        return self.model_copy(update={"constraints": tuple(bare), "start": start})

    def design_space(self) -> DesignSpace:
        """Return the controller's variables, and chosen ones of its conventions and of the gait."""
        controller = CONTROLLERS[self.controller]
        return DesignSpace.build(
            required=controller.variables,
            optional=(*controller.conventions, *GAIT_VARIABLES),
            chosen=self.variables,
            fixed=self.fixed,
        )

    def with_gait_searched(self) -> JobSpec:
        """Return the job with chapter 3's gait variables searched as well, unless fixed.

        A cycle time in which the scenarios differ stays theirs; bounds include the scenarios' own
        gait if the job starts from references of constraints.
        """
        space, scenarios = self.design_space(), self.resolved_scenarios()
        relative = any(constraint.relative_to is not None for constraint in self.constraints)
        added = []
        for name in GAIT_OF_CHAPTER_3:
            own = [getattr(scenario, name) for scenario in scenarios]
            if name in space.names or (name == "cycle_time" and len(set(own)) > 1):
                continue
            variable = GAIT_CATALOGUE[name]
            ends = [variable.low, variable.high, *(own if relative else ())]
            added.append(variable.model_copy(update={"low": min(ends), "high": max(ends)}))
        document = self.model_dump() | {"variables": (*space.variables, *added)}
        return JobSpec.model_validate(document)

    def check_can_be_simulated(self) -> None:
        """Check that the controller compiles and that scenarios' gentlest gaits are in reach."""
        from gaitswarm.sim.simulate import check_drives, check_reach
        from gaitswarm.sim.worlds.perturbations import check_worlds
        from gaitswarm.sim.worlds.walks import check_grounds

        super().check_can_be_simulated()
        space, scenarios = self.design_space(), self.resolved_scenarios()
        for design in space.corners():
            with space.requested():
                law = CONTROLLERS[self.controller].compile(design)
                with_gait(scenarios[0], _gait_of(design))
            with simulation_errors("controller"):
                check_drives(law, self.robot)
        if self.worlds is not None:
            variables = self.worlds.variables()
            ends = np.array([[v.low for v in variables], [v.high for v in variables]])
            with simulation_errors("worlds.ranges"):
                names = tuple(v.name for v in variables)
                check_worlds(names, ends)
                check_grounds(scenarios, names, ends)
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
        with simulation_errors("case"):
            self.cases({})

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the scenarios, in order; with worlds, of each world in each scenario."""
        names = super().case_names
        worlds = range(0 if self.worlds is None else self.worlds.count)
        return tuple(f"{name}.world-{k}" for name in names for k in worlds) or names

    @property
    def measurements(self) -> tuple[Objective, ...]:
        """Measurements of the simulator, or of a plug-in's case."""
        return RESULTS[N_OBJECTIVES:] if self.case is None else CASES[self.case.name].measurements

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        """Return one case for each scenario, or for each world in each scenario."""
        return self.cases_of(self.controller, self.design_space().names)

    def cases_of(self, controller: ControllerName, names: tuple[str, ...]) -> tuple[Case, ...]:
        """Return the cases for designs of any controller.

        Args:
            controller: Of the designs.
            names: Of their variables, in the order of the columns.
        """
        from gaitswarm.sim.case import MeasuredWalk, Walk
        from gaitswarm.sim.worlds.walks import MeasuredPerturbedWalk

        if self.worlds is not None:
            pairs = product(self.resolved_scenarios(), self.worlds.drawn())
            return tuple(
                MeasuredPerturbedWalk(
                    name, self.robot, controller, scenario, world, names, self.precision
                )
                for name, (scenario, world) in zip(self.case_names, pairs, strict=True)
            )
        walk = MeasuredWalk if self.case is None else Walk
        walks = tuple(
            walk(self.robot, controller, scenario, names, self.precision)
            for scenario in self.resolved_scenarios()
        )
        return walks if self.case is None else tuple(create_case(self.case, w) for w in walks)

    @property
    def aggregation(self) -> Aggregation:
        """Aggregation over worlds and scenarios."""
        weights = None
        if self.scenario_weights:
            names = (scenario.name for scenario in self.resolved_scenarios())
            weights = tuple(self.scenario_weights.get(name, 1.0) for name in names)
        return Aggregation(self.worlds, weights, self.scenario_aggregate == "worst")

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Distributions of a plug-in's controller and libraries of its case."""
        case = () if self.case is None else CASES[self.case.name].libraries
        return (*CONTROLLERS.distribution(self.controller), *case)

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Return fitness and utilities of n designs, aggregated as the job says.

        A design that violates a constraint has no fitness.

        Args:
            objectives: (n, K, m) raw results.
            failed: (n, K), true for a case without a result.
        """
        judged = self._unconstrained(objectives, failed)
        if not self.constraints:
            return judged
        infeasible = violations(self.limits(), objectives) > 0.0
        return judged._replace(fitness=np.where(infeasible, np.inf, judged.fitness))

    def _unconstrained(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        logarithms = log_utilities(objectives, failed, self.resolved_preference())
        return self.aggregation.judged(logarithms)

    def violations(self, results: Floats, failed: NDArray[np.bool_]) -> Floats | None:
        """Return by how much n designs violate the constraints, as `Spec.violations` says."""
        if not self.constraints:
            return None
        fitness = self._unconstrained(results, failed).fitness
        return np.where(np.isfinite(fitness), violations(self.limits(), results), np.inf)

    def search_feedback(
        self, objectives: Floats, failed: NDArray[np.bool_], fitness: Floats
    ) -> Floats:
        """Return the fitness; for a multi-objective method f1 to f5 over all scenarios.

        Infeasible designs have numbers beyond those of all feasible ones, increasing with the
        violation.
        """
        feedback = fitness
        if METHODS[self.search.name].multi_objective:
            aggregate = self.aggregation.aggregated
            feedback = objective_vectors(objectives, failed, aggregate=aggregate)
        violation = self.violations(objectives, failed)
        if violation is None:
            return feedback
        columns = feedback.reshape(len(violation), -1).T
        ordered = [feasible_first(column, violation) for column in columns]
        return np.stack(ordered, axis=1).reshape(feedback.shape)

    def resolved(self) -> JobSpec:
        """Return the job with scenarios, preference, variables and optimizer written out."""
        return (
            super()
            .resolved()
            .model_copy(
                update={
                    "scenarios": self.resolved_scenarios(),
                    "preference": self.resolved_preference(),
                    "worlds": self.worlds
                    and self.worlds.model_copy(update={"ranges": self.worlds.variables()}),
                }
            )
        )


def _gait_of(design: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in design.items() if name in GAIT_CATALOGUE}


def _gentlest_gait(searched: Sequence[Variable]) -> dict[str, float]:
    """Return the searched gait whose feet move least: short, flat, smooth."""
    least = {v.name: v.low for v in searched if split_name(v.name)[0] in ("stride", "height")}
    # Any value shows whether the robot has such a group of legs.
    least |= {
        v.name: 0.5 * (v.low + v.high)
        for v in searched
        if v.name in _POSTURE or (split_name(v.name)[1] and v.name not in least)
    }
    return least | {v.name: v.high for v in searched if v.name == "fir_ms"}


def reference_design(
    spec: JobSpec,
) -> tuple[str, Literal["published", "start"], Mapping[str, float]] | None:
    """Return the design that a job's best is compared with; None with a plug-in's case."""
    if spec.case is not None:
        return None
    study = None if isinstance(spec.robot, RobotFiles) else published_study(spec)
    if study is None:
        space = spec.design_space()
        (values,) = space.simulated_values(space.middle)
        return "start design", "start", values
    published = CONTROLLERS[spec.controller].published[study]
    return study, "published", adapted_to_job(published, spec)


def published_study(spec: JobSpec) -> str | None:
    """Return the name of the published design that was tuned by the job's preference."""
    published, preference = CONTROLLERS[spec.controller].published, spec.resolved_preference()
    names = (name for name, other in PREFERENCES.items() if other == preference)
    return next((name for name in (*names, *published) if name in published), None)


def adapted_to_job(published: Mapping[str, float], spec: JobSpec) -> dict[str, float]:
    space = spec.design_space()
    searched = {variable.name for variable in space.variables}
    conventions = {variable.name for variable in CONTROLLERS[spec.controller].conventions}
    fixed = dict(space.fixed)
    held = {name: fixed[name] for name in fixed if name in conventions or name in GAIT_CATALOGUE}
    shared = (name for name in published if name not in GAIT_CATALOGUE or name in searched)
    return {name: published[name] for name in shared} | held


def nearest_design(spec: JobSpec, design: Mapping[str, float]) -> dict[str, float | str] | None:
    """Return the design nearest to a reference, with the first scenario's gait, or None."""
    gait, nearest = spec.resolved_scenarios()[0].model_dump(), dict[str, float | str]()
    for variable in spec.design_space().variables:
        value = design.get(variable.name, gait.get(variable.name))
        if value is None:
            return None
        number = min(max(variable.number(value), variable.low), variable.high)
        nearest[variable.name] = variable.shown(number)
    return nearest
