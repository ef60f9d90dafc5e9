"""Certificates: one design in many perturbed models and in held-out scenarios"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from gaitswarm.services.optimizer.errors import simulation_errors
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec, WalksSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import mean_of_greatest
from gaitswarm.services.optimizer.jobs.preference import PreferenceChoice
from gaitswarm.services.optimizer.jobs.spec import OptimizerChoice
from gaitswarm.services.optimizer.search.optimizer import CountedState, Optimizer, Stateful
from gaitswarm.services.optimizer.search.registry import RandomSearchSettings
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import Case
from gaitswarm.sim.catalogue import (
    GAIT_CATALOGUE,
    check_design,
    design_numbers,
    design_shown,
    with_gait,
)
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.identification import Recordings
from gaitswarm.sim.input import check_distinct
from gaitswarm.sim.mujoco.engines import (
    ENGINES,
    LIBRARY,
    EngineName,
    check_installed,
    engine_variable,
)
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice, load_robot
from gaitswarm.sim.scenario import HELD_OUT, SCENARIOS, Scenario, ScenarioChoice, ScenarioName
from gaitswarm.sim.simulate import check_drives, check_reach
from gaitswarm.sim.variables import VariableName, VariableValue
from gaitswarm.sim.worlds.perturbations import (
    DRAWN,
    NOMINAL,
    PERTURBATIONS,
    check_worlds,
    sample_worlds,
)
from gaitswarm.sim.worlds.walks import EngineWalk, WorldWalk, check_grounds

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
        except ValueError:
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


def with_engine(space: DesignSpace, engines: Sequence[EngineName]) -> DesignSpace:
    """Add the engine that computes each world's simulations to a space."""
    if not engines:
        return space
    drawn = len(space.variables)
    return replace(
        space,
        variables=(*space.variables, engine_variable(engines)),
        catalogue=(*space.catalogue[:drawn], engine_variable(), *space.catalogue[drawn:]),
    )


def world_positions(
    space: DesignSpace, engines: Sequence[EngineName], seed: int
) -> Callable[[int, int], Floats]:
    """Return a function of (start, stop) that yields the certificate's positions in order."""
    first = [[min(max(NOMINAL[v.name], v.low), v.high) for v in space.variables]]
    nominal = np.array(first * (1 + len(engines)))
    box = with_engine(space, engines).box

    def positions(start: int, stop: int) -> Floats:
        drawn = sample_worlds(max(0, stop - len(nominal)), seed, space.variables)
        worlds = np.concatenate([nominal, drawn])[:stop]
        if engines:
            engine = np.zeros((len(worlds), 1))
            engine[: len(nominal), 0] = np.arange(len(nominal))[: len(worlds)]
            worlds = box.positions(np.hstack([worlds, engine]))
        return worlds[start:]

    return positions


class Enumeration(Stateful[CountedState]):
    """An optimizer that ignores its feedback: position k is a function of k."""

    def __init__(self, name: str, particles: int, positions: Callable[[int, int], Floats]) -> None:
        state = CountedState(optimizer=name, schema_version=1, iteration=0, asked=0, evaluations=0)
        super().__init__(particles, state)
        self._positions = positions

    @property
    def evaluations(self) -> int:
        return self.state.evaluations

    def start_from(self, positions: Floats) -> None:
        if len(positions):
            raise ValueError(
                f"start_from(): {self.state.optimizer} does not accept start positions"
            )

    def _waiting(self) -> Floats:
        first = self.state.evaluations
        return self._positions(first, first + (self.state.asked or self._particles))

    def _answer(self, fitness: Floats) -> None:
        self.state.evaluations += len(fitness)


LEVEL: Final = 0.95
"""Of intervals and conditional values at risk."""


def conditional_value_at_risk(values: Floats, level: float = LEVEL) -> float:
    """Mean of the worst of (n,) values (Rockafellar and Uryasev 2002), the greatest being worst."""
    return mean_of_greatest(np.sort(values)[::-1].tolist(), max((1.0 - level) * len(values), 1.0))


BATCH: Final = 50
"""Worlds per iteration: with eight scenarios 400 simulations, about half a second on two cores."""

_OPTIMIZER: Final[TypeAdapter[Any]] = TypeAdapter(OptimizerChoice)
_COUNT: Final[TypeAdapter[int | None]] = TypeAdapter(int | None)


class CertificateSpec(WalksSpec):
    """A certificate: one design, in worlds that vary all that a model may get wrong.

    A design of the job is a world: a value of every perturbation. The first is the nominal world,
    repeated in each of the `engines`. The others are drawn, each by its number alone.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "certificate",
                    "controller": "fuzzy-pi",
                    "design": dict(CONTROLLERS["fuzzy-pi"].published["A"]),
                    "preference": "A",
                    "worlds": 1000,
                    "seed": 1,
                }
            ]
        },
    )

    outcome_independent_fields = WalksSpec.outcome_independent_fields | {
        "preference",
        "worlds",
        "engines",
        "held_out",
    }

    searches = False

    kind: Literal["certificate"] = Field(description="Test one design in many perturbed models.")
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller of the design; see /v1/controllers."
    )
    design: dict[VariableName, VariableValue] = Field(
        description="The design: a value of each of the controller's variables, and of any gait"
        " variable, which overrides the scenarios' value.",
        examples=[dict(CONTROLLERS["fuzzy-pi"].published["A"])],
    )
    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=(*(scenario.name for scenario in SCENARIOS), *_MIRRORED),
        min_length=1,
        max_length=32,
        description="Scenarios simulated in every world: names or numbers of presets (see"
        " /v1/scenarios), or custom ones. Default: the six of table 4.2, and its turn and"
        " its slope in the other direction; choose others for a robot that these do not suit.",
    )
    held_out: tuple[ScenarioName, ...] | None = Field(
        default=None,
        max_length=32,
        description="Names of the `scenarios` that the design was not tuned in; they are marked."
        " Default: the presets other than those of table 4.2.",
        examples=[["fast-turn-left", "fast-downhill"]],
    )
    preference: PreferenceChoice = Field(
        default="A",
        description="Weights of the objectives: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " a custom preference.",
    )
    worlds: int = Field(
        default=1000,
        ge=1,
        le=100_000,
        description="Number of worlds to draw, besides the nominal one, which is simulated first."
        " It determines `iterations`.",
    )
    engines: tuple[EngineName, ...] = Field(
        default=(),
        max_length=len(ENGINES),
        description="Further engines that simulate the design in the nominal world, to show which"
        " results depend on the engine: `mujoco` (its rigid bodies and integrator, gaitswarm's"
        " contact laws) and `mujoco-contacts` (its contacts as well). Their simulations take some"
        " hundred times as long and require the extra `mujoco`.",
        examples=[["mujoco"]],
    )
    optimizer: OptimizerChoice = Field(
        default=RandomSearchSettings(particles=BATCH),
        description="Sampler of the worlds: `random`, with `particles` worlds per iteration.",
    )

    @model_validator(mode="before")
    @classmethod
    def _count_worlds(cls, document: Any) -> Any:
        if not isinstance(document, Mapping):
            return document
        if document.get("start"):
            raise ValueError("start: worlds are sampled; omit it")
        try:
            default = cls.model_fields["optimizer"].default
            batch = _OPTIMIZER.validate_python(document.get("optimizer", default)).particles
            # As the fields parse them: 1000.0 and "1000" are valid counts.
            worlds = _COUNT.validate_python(document.get("worlds"))
            iterations = _COUNT.validate_python(document.get("iterations"))
        except ValidationError:
            return document
        if iterations is not None and iterations < 1:
            return document
        engines = document.get("engines", ())
        nominal = 1 + (len(engines) if isinstance(engines, list | tuple) else 0)
        if worlds is None and iterations is not None:
            worlds, iterations = max(1, iterations * batch - nominal), None
        elif worlds is None:
            worlds = cls.model_fields["worlds"].default
        if worlds < 1:
            return document
        needed = math.ceil((worlds + nominal) / batch)
        if iterations not in (None, needed):
            raise ValueError(
                f"iterations: determined by worlds; {worlds} in batches of {batch} are {needed}"
                " with the nominal one; omit it"
            )
        return {**document, "worlds": worlds, "iterations": needed}

    @model_validator(mode="after")
    def _can_be_run(self) -> Self:
        if self.optimizer.name != "random":
            raise ValueError("optimizer: must be random")
        check_distinct("engines", self.engines)
        for held_out in self.held_out or ():
            if held_out not in self.case_names:
                raise ValueError(f"held_out: {held_out!r} is not among the scenarios")
        check_design(self.controller, self.design)
        self.design_space()
        return self

    @property
    def numbers(self) -> dict[str, float]:
        """The design in the simulator's numbers."""
        return design_numbers(self.controller, self.design)

    @property
    def budget(self) -> int:
        """The nominal world in every engine, and the drawn worlds."""
        return self.nominal_rows + self.worlds

    @property
    def nominal_rows(self) -> int:
        """Evaluations of the nominal world: our engine's first, then those of `engines`."""
        return 1 + len(self.engines)

    def with_budget(self, iterations: int) -> Self:
        worlds = iterations * self.optimizer.particles - self.nominal_rows
        return self.model_copy(update={"iterations": iterations, "worlds": worlds})

    def design_space(self) -> DesignSpace:
        """Return the perturbations, and the engine if there are `engines`."""
        return with_engine(self.world_space(), self.engines)

    @classmethod
    def of_job(
        cls,
        spec: JobSpec,
        design: Mapping[str, float | str],
        *,
        name: str = "",
        worlds: int = 1000,
        seed: int = 1,
    ) -> Self:
        """Build the certificate of a design that a job found."""
        numbers = design_numbers(spec.controller, design)
        return cls(
            kind="certificate",
            name=name,
            robot=spec.robot,
            controller=spec.controller,
            design=dict(design),
            **certificate_walks(spec.resolved_scenarios(), spec.robot, numbers),
            preference=spec.preference,
            worlds=worlds,
            seed=seed,
        )

    def world_space(self) -> DesignSpace:
        """Return the perturbations; others are as the robot has them."""
        return DesignSpace.build(
            optional=PERTURBATIONS, default=DRAWN, chosen=self.variables, fixed=self.fixed
        )

    def create_search(self) -> Optimizer:
        """Enumerate the nominal world, then those of `sample_worlds`."""
        positions = world_positions(self.world_space(), self.engines, self.seed)
        return Enumeration(self.optimizer.name, self.optimizer.particles, positions)

    @property
    def further_libraries(self) -> tuple[str, ...]:
        return (*((LIBRARY,) if self.engines else ()), *CONTROLLERS.distribution(self.controller))

    def world(self, index: int) -> dict[str, float]:
        """Return the perturbations of a drawn world, by name.

        Args:
            index: Its number, from 0.
        """
        space = self.world_space()
        drawn = sample_worlds(index + 1, self.seed, space.variables)
        return next(space.simulated_values(drawn[index]))

    def check_can_be_simulated(self) -> None:
        """Check the design, the scenarios, and the worlds at both ends of all ranges."""
        super().check_can_be_simulated()
        if self.engines:
            with simulation_errors("engines"):
                check_installed()
        with simulation_errors("design"):
            law = CONTROLLERS[self.controller].compile(self.numbers)
        with simulation_errors("controller"):
            check_drives(law, self.robot)
        names, values = tuple(self.numbers), tuple(self.numbers.values())
        for index, scenario in enumerate(self.resolved_scenarios()):
            with simulation_errors(f"scenarios.{index}"):
                check_reach(scenario, names, values, robot=self.robot)
        space = self.world_space()
        with space.requested():
            worlds = space.simulated(space.designs(np.stack([space.box.low, space.box.high])))
            check_worlds(space.names, worlds)
            check_grounds(self.resolved_scenarios(), space.names, worlds)

    @property
    def held_out_names(self) -> tuple[str, ...]:
        """Names of the scenarios that the design was not tuned in."""
        names = [s.name for s in HELD_OUT] if self.held_out is None else self.held_out
        return tuple(name for name in self.case_names if name in names)

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        space, design = self.world_space(), tuple(self.numbers.items())
        walks = tuple(
            WorldWalk(self.robot, self.controller, design, scenario, space.names, self.precision)
            for scenario in self.resolved_scenarios()
        )
        if not self.engines:
            return walks
        return tuple(EngineWalk(walk, len(space.variables)) for walk in walks)

    def resolved(self) -> Self:
        """Return the job with scenarios, preference, design and perturbations written out."""
        space = self.world_space()
        return self.model_copy(
            update={
                "scenarios": self.resolved_scenarios(),
                "preference": self.resolved_preference(),
                "design": design_shown(self.controller, self.numbers),
                "variables": space.variables,
                "fixed": space.shown_fixed,
            }
        )
