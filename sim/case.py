"""What every design of a job is put to, as it is sent to whoever runs it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.walk import Kernel, KernelTime, Precision, Walking, walk_together
from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES, Objective, Outcome
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, simulating


@runtime_checkable
class Case(Protocol):
    """One test of designs, with all that it depends on; immutable, and fit for another process.

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
        """The robots, whose kernels should be ready before many processes need them."""

    @property
    def precision(self) -> Precision:
        """Of the physics' numbers."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Columns of its outcomes' objectives, in order."""

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        """Put designs to the test.

        Args:
            designs: (n, v), columns as the case names them.

        Returns:
            Objectives and statuses in the order of the designs.

        Raises:
            SimulationInputError: A design cannot be simulated.
        """


@runtime_checkable
class WalkingCase(Case, Protocol):
    """A case whose walks can be computed together with those of other cases.

    `run` computes the same, alone.
    """

    def walking(self, designs: NDArray[np.float64]) -> Walking[Outcome]:
        """Put designs to the test, beside others."""


@runtime_checkable
class LongCase(Case, Protocol):
    """A case that may take minutes of a single design, and can be broken off on the way.

    Designs share nothing, so that each may be a task of its own.
    """

    def run_until(self, designs: NDArray[np.float64], should_stop: Callable[[], bool]) -> Outcome:
        """As `run`, to the bit, unless it is broken off.

        Args:
            designs: As for `run`.
            should_stop: Polled every few seconds at least.

        Returns:
            As of `run`.

        Raises:
            Exception: Of any kind, when `should_stop` has said so; nobody waits for an outcome.
        """


def run_together(
    cases: Sequence[Case],
    designs: Sequence[NDArray[np.float64]],
    kernel_time: KernelTime | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[Outcome, ...]:
    """Put designs to several cases, whose walks share calls of kernels where they can."""
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


def _run(case: Case, designs: NDArray[np.float64], should_stop: Callable[[], bool]) -> Outcome:
    if isinstance(case, LongCase):
        return case.run_until(designs, should_stop)
    return case.run(designs)


@dataclass(frozen=True, slots=True)
class Walk:
    """Designs of a controller walk through a scenario.

    Attributes:
        robot: that walks.
        controller: name of its motor controller.
        scenario: that it walks through.
        variables: columns of the designs.
        precision: of the physics' numbers.
    """

    robot: RobotSource
    controller: str
    scenario: Scenario
    variables: tuple[str, ...]
    precision: Precision = "double"

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.scenario.name

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """The robot that walks."""
        return (self.robot,)

    @property
    def duration(self) -> float:
        """Simulated time of one walk [s]."""
        return self.scenario.duration

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1."""
        return OBJECTIVES

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        """Let every design walk."""
        (outcome,) = walk_together([self.walking(designs)])
        return outcome

    def run_with(self, kernel: Kernel, designs: NDArray[np.float64]) -> Outcome:
        """Let every design walk, by a kernel of one's choice.

        Args:
            kernel: Of the robot: another engine's, for one.
            designs: As for `run`.

        Returns:
            Objectives and statuses.

        Raises:
            SimulationInputError: A design cannot be simulated; names the variable.
        """
        (simulation,) = walk_together([self._simulating(designs, kernel)])
        return simulation.outcome

    def walking(self, designs: NDArray[np.float64]) -> Walking[Outcome]:
        """Simulate all designs together with those of other cases.

        Args:
            designs: As for `run`.
        """
        walked = yield from self._simulating(designs)
        return walked.outcome

    def _simulating(
        self, designs: NDArray[np.float64], kernel: Kernel | None = None
    ) -> Walking[Simulation]:
        return simulating(
            self.scenario,
            self.controller,
            self.variables,
            designs,
            robot=self.robot,
            precision=self.precision,
            kernel=kernel,
        )


@dataclass(frozen=True, slots=True)
class MeasuredWalk(Walk):
    """The same walk with its measurements, as further columns behind its objectives."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1, then `MEASUREMENTS`."""
        told = (Objective(m.name, m.unit, m.description) for m in MEASUREMENTS)
        return (*OBJECTIVES, *told)

    def walking(self, designs: NDArray[np.float64]) -> Walking[Outcome]:
        """Let every design walk, beside walks of other cases."""
        walked = yield from self._simulating(designs)
        columns = [walked.outcome.objectives, walked.measurements.array()]
        return Outcome(np.concatenate(columns, axis=1), walked.outcome.statuses)
