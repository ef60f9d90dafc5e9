"""Cases: evaluations of designs, as they are sent to workers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.walk import Kernel, KernelTime, Walking, walk_together
from gaitswarm.sim.outcome import OBJECTIVES, RESULTS, Objective, Outcome
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, simulating


@runtime_checkable
class Case(Protocol):
    """A test of designs with everything that it depends on; immutable and picklable.

    A design's result depends on the case and the design alone, bit for bit.
    """

    @property
    def name(self) -> str:
        """Unique in its job."""

    @property
    def duration(self) -> float:
        """Simulated time of one design [s]."""

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """Robots whose kernels should be built before many processes need them."""

    @property
    def precision(self) -> Precision:
        """Precision of the physics."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Columns of its outcomes' objectives."""

    def run(self, designs: Floats) -> Outcome:
        """Evaluate designs.

        Args:
            designs: (n, v), columns as the case names them.

        Raises:
            SimulationInputError: A design cannot be simulated.
        """


@runtime_checkable
class WalkingCase(Case, Protocol):
    """A case whose simulations can run together with those of other cases; `run` gives the same."""

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Prepare the evaluation of designs together with other cases."""


@runtime_checkable
class LongCase(Case, Protocol):
    """A case that may take minutes for one design, and can be stopped.

    Designs share nothing, so that each may be a task of its own.
    """

    def run_until(self, designs: Floats, should_stop: Callable[[], bool]) -> Outcome:
        """Evaluate designs as `run` does, bit for bit, unless it is stopped.

        Args:
            designs: As for `run`.
            should_stop: To be polled every few seconds at least.

        Raises:
            Exception: Of any kind, after `should_stop` returned True; the outcome is not needed.
        """


def run_together(
    cases: Sequence[Case],
    designs: Sequence[Floats],
    kernel_time: KernelTime | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[Outcome, ...]:
    """Evaluate designs in several cases, which share calls of kernels where possible."""
    pairs = list(zip(cases, designs, strict=True))
    walking = {
        index: case.walking(rows)
        for index, (case, rows) in enumerate(pairs)
        if isinstance(case, WalkingCase)
    }
    outcomes = dict(zip(walking, walk_together(list(walking.values()), kernel_time), strict=True))
    return tuple(
        outcomes[index] if index in outcomes else _run(case, rows, should_stop)
        for index, (case, rows) in enumerate(pairs)
    )


def _run(case: Case, designs: Floats, should_stop: Callable[[], bool]) -> Outcome:
    if isinstance(case, LongCase):
        return case.run_until(designs, should_stop)
    return case.run(designs)


class SimulatedCase(ABC):
    """Cases whose outcome is that of a simulation."""

    __slots__ = ()

    robot: RobotSource

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return (self.robot,)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return OBJECTIVES

    @abstractmethod
    def _simulating(
        self, designs: Floats, *, log: bool = False, kernel: Kernel | None = None
    ) -> Walking[Simulation]:
        """Prepare the simulation of all designs, by the robot's kernel or a given one."""

    def simulate(
        self, designs: Floats, *, log: bool = False, kernel: Kernel | None = None
    ) -> Simulation:
        """Simulate every design, with measurements and, if requested, logs.

        Args:
            designs: As for `run`.
            log: Whether to record every simulation at 500 Hz.
            kernel: Kernel of the robot, such as another engine's.
        """
        (simulation,) = walk_together([self._simulating(designs, log=log, kernel=kernel)])
        return simulation

    def run(self, designs: Floats) -> Outcome:
        """Simulate every design."""
        (outcome,) = walk_together([self.walking(designs)])
        return outcome

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Prepare the simulation of all designs together with other cases.

        Args:
            designs: As for `run`.
        """
        simulation = yield from self._simulating(designs)
        return simulation.outcome


class MeasuredCase(SimulatedCase):
    """The same simulation with measurements as additional columns after the objectives."""

    __slots__ = ()

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return RESULTS

    def walking(self, designs: Floats) -> Walking[Outcome]:
        simulation = yield from self._simulating(designs)
        columns = [simulation.outcome.objectives, simulation.measurements.array()]
        return Outcome(np.concatenate(columns, axis=1), simulation.outcome.statuses)


@dataclass(frozen=True, slots=True)
class Walk(SimulatedCase):
    """Designs of a controller in a scenario; `variables` are the columns of the designs."""

    robot: RobotSource
    controller: str
    scenario: Scenario
    variables: tuple[str, ...]
    precision: Precision = "double"

    @property
    def name(self) -> str:
        return self.scenario.name

    @property
    def duration(self) -> float:
        return self.scenario.duration

    def run_with(self, kernel: Kernel, designs: Floats) -> Outcome:
        """Simulate every design with a given kernel.

        Args:
            kernel: Kernel of the robot, such as another engine's.
            designs: As for `run`.
        """
        return self.simulate(designs, kernel=kernel).outcome

    def _simulating(
        self, designs: Floats, *, log: bool = False, kernel: Kernel | None = None
    ) -> Walking[Simulation]:
        return simulating(
            self.scenario,
            self.controller,
            self.variables,
            designs,
            robot=self.robot,
            log=log,
            precision=self.precision,
            kernel=kernel,
        )


@dataclass(frozen=True, slots=True)
class MeasuredWalk(MeasuredCase, Walk):
    """A walk with its measurements."""
