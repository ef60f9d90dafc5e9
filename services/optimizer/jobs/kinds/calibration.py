"""Identification and calibration jobs, which fit a robot to measured walks and tables of results"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from gaitswarm.services.optimizer.errors import simulation_errors
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    Judgement,
    PreferenceName,
    figure_of_merit,
    judge,
)
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.calibration import (
    QUANTITIES,
    CalibrationWalk,
    Target,
    TargetWalk,
    robot_variables,
    varied_robot,
    walk_variables,
)
from gaitswarm.sim.case import Case
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, design_shown, orders_searched
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.identification import LINK_CURRENTS, CurrentFit, Recordings
from gaitswarm.sim.input import check_distinct
from gaitswarm.sim.outcome import RESULTS, Objective
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables, with_parameters
from gaitswarm.sim.robot.variant import RobotName
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_drives, check_gait, check_reach
from gaitswarm.sim.variables import Variable

RecordingId = Annotated[
    str,
    Field(
        pattern=r"^[0-9a-f]{32}$",
        description="Id of a recorded walk, as returned by POST /v1/recordings.",
        examples=["0f343b0931126a20f133d67c2b018a3b"],
    ),
]

Link = Literal[1, 2, 3]


class IdentificationSpec(Spec):
    """Fit a robot's parameters to recorded walks.

    Fitness is the mean absolute error of motor currents (eq. 2.21), over links and walks [A].
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "identification",
                    "recordings": ["0f343b0931126a20f133d67c2b018a3b"],
                    "variables": ["battery_voltage", "body_mass"],
                    "iterations": 100,
                }
            ]
        },
    )

    kind: Literal["identification"] = Field(description="Fit parameters of the robot.")
    recordings: tuple[RecordingId, ...] = Field(
        min_length=1,
        max_length=32,
        description="Recorded walks to fit simultaneously; see /v1/recordings.",
    )
    links: tuple[Link, ...] = Field(
        default=(1, 2, 3),
        min_length=1,
        max_length=3,
        description="Links whose currents are compared: 1 coxa, 2 femur, 3 tibia.",
    )

    @model_validator(mode="after")
    def _can_be_run(self) -> IdentificationSpec:
        check_distinct("recordings", self.recordings)
        check_distinct("links", self.links)
        self.design_space()
        return self

    def design_space(self) -> DesignSpace:
        """Return the chosen robot parameters; the others stay as described."""
        identifiable = identifiable_variables(load_robot(self.robot))
        return DesignSpace.build(
            optional=identifiable, default=identifiable, chosen=self.variables, fixed=self.fixed
        )

    def check_can_be_simulated(self) -> None:
        """Check that the robot is valid at both ends of all bounds."""
        super().check_can_be_simulated()
        robot, space = load_robot(self.robot), self.design_space()
        for values in space.corners():
            with space.requested():
                with_parameters(robot, values)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Mean absolute error of the currents of each link [A]."""
        return LINK_CURRENTS

    @property
    def case_names(self) -> tuple[str, ...]:
        """Ids of the recordings, shortened, in order."""
        return tuple(recording[:12] for recording in self.recordings)

    @property
    def recording_ids(self) -> tuple[str, ...]:
        return self.recordings

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:
        """Return one fit for each recorded walk.

        Args:
            recordings: Those named by `recording_ids`, by id.
        """
        names = self.design_space().names
        return tuple(
            CurrentFit(name, self.robot, recordings[recording], names, self.precision)
            for name, recording in zip(self.case_names, self.recordings, strict=True)
        )

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the mean absolute error of currents over walks (eq. 2.21) [A]."""
        columns = [link - 1 for link in self.links]
        means = [
            [math.fsum(walk) / len(columns) for walk in design]
            for design in objectives[:, :, columns].tolist()
        ]
        errors = np.where(failed, np.inf, np.array(means).reshape(failed.shape))
        fitness = [math.fsum(row) / len(row) for row in errors.tolist()]
        with np.errstate(divide="ignore"):
            return Judgement(np.array(fitness), np.log(errors))


_COLUMNS: Final = {result.name: column for column, result in enumerate(RESULTS)}


def simulated_values(
    target: Target,
    objectives: Floats,
    failed: NDArray[np.bool_],
    of_walk: Mapping[str, Sequence[int]],
) -> Floats:
    """Return the values that designs reach for a target."""

    def of(walk: str) -> Floats:
        cases = list(of_walk[walk])
        rows, bad, quantity = objectives[:, cases], failed[:, cases], target.quantity
        if quantity == "F":
            preference = PREFERENCES["chapter-3"]
            fitness = judge(rows, bad, preference).fitness.tolist()
            merits = [figure_of_merit(value, preference) for value in fitness]
            values = np.array([math.nan if value is None else value for value in merits])
        elif quantity.startswith("fitness:"):
            name: PreferenceName = quantity.removeprefix("fitness:")  # type: ignore[assignment]
            values = judge(rows, bad, PREFERENCES[name]).fitness
        else:
            values = rows[:, 0, _COLUMNS[quantity]].copy()
        values[bad.any(axis=1)] = np.nan
        return values

    values = of(target.walk)
    if target.relative_to is None:
        return values
    with np.errstate(divide="ignore", invalid="ignore"):
        return values / of(target.relative_to)


def difference(target: Target, value: float) -> float:
    """Return the signed distance of a value from its target, in tolerances."""
    if not math.isfinite(value):
        return math.inf
    if not QUANTITIES[target.quantity].positive:
        return (value - target.value) / target.tolerance
    if value <= 0.0:
        return math.inf
    return math.log(value / target.value) / math.log1p(target.tolerance)


def root_mean_square(differences: Floats) -> Floats:
    rows = [[difference * difference for difference in row] for row in differences.tolist()]
    return np.array([math.sqrt(math.fsum(row) / len(row)) if row else 0.0 for row in rows])


_NO_EVIDENCE: Final = 4.0
"""Increase of the sum of squares, in tolerances, that may be chance: two standard deviations."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Cases of a job, and the cases that each walk requires."""

    # name, walk and scenario of each of the K cases; identical walks share one
    cases: tuple[tuple[str, TargetWalk, Scenario], ...]
    # indices of a walk's cases, in the order of its scenarios, by the walk's name
    of_walk: dict[str, tuple[int, ...]]


class CalibrationSpec(Spec):
    """Fit parameters and conventions to results of walks.

    Fitness is the root mean square over fitted targets of their distances in tolerances [1].
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "calibration",
                    "walks": [
                        {
                            "name": "pi",
                            "controller": "pi",
                            "design": {"P": 0.454, "I": 0.147, "stride": 0.168},
                            "scenarios": ["normal-fast"],
                        }
                    ],
                    "targets": [
                        {"walk": "pi", "quantity": "energy", "value": 42.55, "tolerance": 0.2},
                        {"walk": "pi", "quantity": "speed", "value": 0.152, "tolerance": 0.05},
                    ],
                    "variables": ["battery_voltage", "contact_law"],
                    "iterations": 50,
                }
            ]
        },
    )

    kind: Literal["calibration"] = Field(description="Fit a robot and conventions to results.")
    robots: tuple[RobotName, ...] = Field(
        default=(),
        max_length=16,
        description="At least two shipped robots among which the variable `robot` chooses. They"
        " replace `robot`.",
        examples=[[]],
    )
    walks: tuple[TargetWalk, ...] = Field(
        min_length=1, max_length=64, description="Walks that were measured or published."
    )
    targets: tuple[Target, ...] = Field(
        min_length=1, max_length=512, description="Their results; at least one is fitted."
    )

    @model_validator(mode="before")
    @classmethod
    def _begin_with_the_first_robot(cls, document: object) -> object:
        if isinstance(document, dict) and document.get("robots"):
            return {**document, "robot": document["robots"][0]}
        return document

    @model_validator(mode="after")
    def _can_be_run(self) -> CalibrationSpec:
        if len(self.robots) == 1 or len(set(self.robots)) < len(self.robots):
            raise ValueError("robots: give at least two different ones, or a single one as `robot`")
        if len({walk.name for walk in self.walks}) < len(self.walks):
            raise ValueError("walks: two of them have the same name")
        self._check_targets()
        names = [name for name, _, _ in self.layout().cases]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"walks: two cases would be called {name!r}; rename a walk")
        self.design_space()
        self._check_every_variable_matters()
        return self

    def _check_targets(self) -> None:
        walks = {walk.name: walk for walk in self.walks}
        for index, target in enumerate(self.targets):
            for field, name in (("walk", target.walk), ("relative_to", target.relative_to)):
                if name is None:
                    continue
                if name not in walks:
                    raise ValueError(
                        f"targets.{index}.{field}: no walk {name!r}; choose from {', '.join(walks)}"
                    )
                of_all = QUANTITIES[target.quantity].scenarios
                if not of_all and len(walks[name].scenarios) > 1:
                    raise ValueError(
                        f"targets.{index}.quantity: {target.quantity} requires one scenario; the"
                        f" walk {name} has {len(walks[name].scenarios)}"
                    )
        if all(target.use != "fit" for target in self.targets):
            raise ValueError("targets: at least one must be fitted")

    @property
    def robot_sources(self) -> tuple[RobotSource, ...]:
        return self.robots or (self.robot,)

    def layout(self) -> Layout:
        """Return the cases and the walks that require them."""
        cases: list[tuple[str, TargetWalk, Scenario]] = []
        index: dict[tuple[object, ...], int] = {}
        of_walk = {}
        for walk in self.walks:
            indices = []
            scenarios = walk.resolved_scenarios()
            for scenario in scenarios:
                key = walk.controller, walk.numbers, scenario
                if key not in index:
                    index[key] = len(cases)
                    name = walk.name if len(scenarios) == 1 else f"{walk.name}.{scenario.name}"
                    cases.append((name, walk, scenario))
                indices.append(index[key])
            of_walk[walk.name] = tuple(indices)
        return Layout(tuple(cases), of_walk)

    def catalogue(self) -> tuple[Variable, ...]:
        """Return all variables of robot, controllers and gait, which have different names."""
        of_robot = robot_variables(self.robot_sources)
        of_walks = walk_variables(walk.controller for walk in self.walks)
        for variable in of_walks:
            if any(variable.name == other.name for other in of_robot):
                raise ValueError(
                    f"{variable.name}: the robot and a controller both have this variable"
                )
        return (*of_robot, *of_walks)

    def design_space(self) -> DesignSpace:
        """Return the chosen variables; by default those of the robot."""
        return DesignSpace.build(
            optional=self.catalogue(),
            default=robot_variables(self.robot_sources),
            chosen=self.variables,
            fixed=self.fixed,
        )

    def _check_every_variable_matters(self) -> None:
        of_robot = {variable.name for variable in robot_variables(self.robot_sources)}
        cases = self._cases()
        for variable in self.design_space().variables:
            drives = [case.drive({variable.name: math.nan}) for case in cases]
            unused = all(not _is_nan(drive.get(variable.name)) for drive in drives)
            if variable.name not in of_robot and unused:
                raise ValueError(
                    f"variables: {variable.name} has no effect: the design of every walk that"
                    " has it sets it; remove it there or here"
                )

    def check_can_be_simulated(self) -> None:
        """Check robots, drives and gaits, unless searched, at both ends of all bounds."""
        super().check_can_be_simulated()
        space, cases = self.design_space(), self._cases()
        of_robot = {variable.name for variable in robot_variables(self.robot_sources)}
        for values in space.corners():
            with space.requested():
                varied_robot(
                    self.robot_sources, {name: v for name, v in values.items() if name in of_robot}
                )
            for index, case in self._walks(cases):
                drive = case.drive(values)
                with simulation_errors(f"walks.{index}.design"):
                    law = CONTROLLERS[case.controller].compile(drive)
                    for robot in self.robot_sources:
                        check_drives(law, robot)
        # The robots have the named groups of legs, and legs for every gait.
        values, orders = next(space.corners()), orders_searched(space.variables)
        for order, (_, case), robot in product(orders, self._walks(cases), self.robot_sources):
            with space.requested():
                check_gait(case.scenario, case.drive(values | order), robot=robot)
        searched = {v.name: math.nan for v in space.variables if v.name in GAIT_CATALOGUE}
        for index, case in self._walks(cases):
            drive = case.drive(dict(space.fixed) | searched)
            if any(map(_is_nan, drive.values())):
                continue
            gait = {name: value for name, value in drive.items() if name in GAIT_CATALOGUE}
            for robot in self.robot_sources:
                with simulation_errors(f"walks.{index}"):
                    check_reach(case.scenario, tuple(gait), tuple(gait.values()), robot=robot)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Raw results of a simulation: f1..f6 of table 4.1, and further ones."""
        return RESULTS

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of walks, with the scenario's if a walk has several."""
        return tuple(name for name, _, _ in self.layout().cases)

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        """Return one simulation for each distinct drive and scenario."""
        return self._cases()

    def _cases(self) -> tuple[CalibrationWalk, ...]:
        names = self.design_space().names
        return tuple(
            CalibrationWalk(
                name,
                self.robot_sources,
                walk.controller,
                walk.numbers,
                scenario,
                names,
                self.precision,
            )
            for name, walk, scenario in self.layout().cases
        )

    def _walks(self, cases: tuple[CalibrationWalk, ...]) -> list[tuple[int, CalibrationWalk]]:
        of_walk = self.layout().of_walk
        return [(i, cases[k]) for i, walk in enumerate(self.walks) for k in of_walk[walk.name]]

    def simulated(self, objectives: Floats, failed: NDArray[np.bool_]) -> Floats:
        """Return (n, T) simulated values of `targets`, NaN after a failure.

        Args:
            objectives: (n, K, m) raw results of simulations.
            failed: (n, K), true for a simulation without a result.
        """
        of_walk = self.layout().of_walk
        columns = [simulated_values(target, objectives, failed, of_walk) for target in self.targets]
        return np.stack(columns, axis=1)

    def differences(self, simulated: Floats) -> Floats:
        """Return the distances from the targets, in tolerances.

        Args:
            simulated: (n, T) values of `targets`.

        Returns:
            (n, T): ln(simulated / value) / ln(1 + tolerance), so that a factor of 1 + tolerance
            counts 1
            and its inverse -1; for height_loss (simulated - value) / tolerance. +inf without a
            value.
        """
        rows = [
            [difference(target, value) for target, value in zip(self.targets, row, strict=True)]
            for row in simulated.tolist()
        ]
        return np.array(rows).reshape(simulated.shape)

    @property
    def fitted(self) -> NDArray[np.bool_]:
        """(T,) whether a target is fitted."""
        return np.array([target.use == "fit" for target in self.targets])

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the root mean square of their distances from fitted targets [1]."""
        differences = self.differences(self.simulated(objectives, failed))
        fitted, of_walk = self.fitted, self.layout().of_walk
        utilities = np.zeros(failed.shape)
        for case in range(failed.shape[1]):
            needs = [
                case in (*of_walk[t.walk], *of_walk.get(t.relative_to or "", ()))
                for t in self.targets
            ]
            utilities[:, case] = root_mean_square(differences[:, fitted & np.array(needs)])
        utilities[failed] = np.inf
        with np.errstate(divide="ignore"):
            return Judgement(root_mean_square(differences[:, fitted]), np.log(utilities))

    def as_good_as(self, fitness: float) -> float:
        """Return the fitness at which the sum of squares over fitted targets is greater by 4.

        Two standard deviations more in total are no evidence; if even the best mean square exceeds
        1, 4 is multiplied by it.
        """
        square = fitness * fitness
        return math.sqrt(square + _NO_EVIDENCE * max(1.0, square) / int(self.fitted.sum()))

    def resolved(self) -> CalibrationSpec:
        """Return the job with scenarios, variables and optimizer written out."""
        walks = tuple(
            walk.model_copy(
                update={
                    "scenarios": walk.resolved_scenarios(),
                    "design": design_shown(walk.controller, dict(walk.numbers)),
                }
            )
            for walk in self.walks
        )
        return super().resolved().model_copy(update={"walks": walks})


def _is_nan(value: float | None) -> bool:
    return value is not None and math.isnan(value)
