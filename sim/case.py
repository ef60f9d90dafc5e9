"""What every design of a job is put to, as it is sent to whoever runs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.kernel.walk import Precision
from sim.outcome import MEASUREMENTS, OBJECTIVES, Objective, Outcome
from sim.robot import RobotSource
from sim.scenario import Scenario
from sim.simulate import Simulation, simulate


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
        return self._walk(designs).outcome

    def _walk(self, designs: NDArray[np.float64]) -> Simulation:
        return simulate(
            self.scenario,
            self.controller,
            self.variables,
            designs,
            robot=self.robot,
            precision=self.precision,
        )


@dataclass(frozen=True, slots=True)
class MeasuredWalk(Walk):
    """The same walk with its measurements, as further columns behind its objectives."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1, then `MEASUREMENTS`."""
        told = (Objective(m.name, m.unit, m.description) for m in MEASUREMENTS)
        return (*OBJECTIVES, *told)

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        """Let every design walk."""
        walked = self._walk(designs)
        columns = [walked.outcome.objectives, walked.measurements.array()]
        return Outcome(np.concatenate(columns, axis=1), walked.outcome.statuses)
