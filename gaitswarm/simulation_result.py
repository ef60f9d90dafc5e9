"""Results of simulations outside any job, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.preference import Preference, figure_of_merit
from gaitswarm.sim.catalogue import design_numbers
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES, Status
from gaitswarm.sim.robot import RobotSource
from gaitswarm.tables import Table
from gaitswarm.views.simulation import SimulationView

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScenarioResult:
    """Results of n designs in one scenario.

    Attributes:
        statuses: How each simulation ended; everything but `Status.OK` is a failure.
        objectives: (n,) raw objectives by name, to be minimized, NaN where there is none;
            `gaitswarm.OBJECTIVES` has their units.
        measurements: (n,) further quantities by name, NaN where a simulation
            ended early; `gaitswarm.MEASUREMENTS` has their units.
        utility: (n,) bias-weighted product (eq. 3.8, 4.1), to be minimized; NaN where the
            simulation failed.
        logs: Logs at 500 Hz, None for a gait out of reach; empty unless requested.
    """

    statuses: tuple[Status, ...]
    objectives: Mapping[str, Floats]
    measurements: Mapping[str, Floats]
    utility: Floats
    logs: tuple[WalkLog | None, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SimulationResult:
    """Results of n designs in K scenarios; `result["normal-fast"]` is one scenario's part.

    Attributes:
        robot: The robot.
        controller: The controller.
        preference: By which utilities and fitness were computed.
        precision: Of the physics' numbers.
        variables: Names of the v variables of the designs.
        designs: (n, v) their values, in the variables' units.
        scenarios: Names of the K scenarios.
        statuses: (n, K) values of `Status`.
        objectives: (n, K, 6) raw objectives f1..f6 of table 4.1, to be minimized, in the units of
            `gaitswarm.OBJECTIVES`; NaN where there is none.
        measurements: (n, K, 5) peak and mean current, motor heat, power and speed, in the order and
            units of `gaitswarm.MEASUREMENTS`; NaN for a simulation that ended early.
        utilities: (n, K) bias-weighted products (eq. 3.8, 4.1), to be minimized; NaN where
            the simulation failed.
        fitness: (n,) geometric means of the utilities (eq. 4.2), to be minimized; NaN where any
            simulation failed.
        logs: Logs by scenario, in the order of the designs; empty unless requested.
    """

    robot: RobotSource
    controller: str
    preference: Preference
    precision: Precision
    variables: tuple[str, ...]
    designs: Floats
    scenarios: tuple[str, ...]
    statuses: NDArray[np.uint8]
    objectives: Floats
    measurements: Floats
    utilities: Floats
    fitness: Floats
    logs: Mapping[str, tuple[WalkLog | None, ...]] = field(repr=False, default_factory=dict)

    @classmethod
    def from_view(cls, view: SimulationView) -> Self:
        """Convert a server's answer to arrays.

        Args:
            view: Result of one design.
        """
        results = list(view.scenarios.values())
        values = [[list(result.objectives.values()) for result in results]]
        measured = [[getattr(r.measurements, m) for m in MEASUREMENT_NAMES] for r in results]
        logs = {
            name: (None if result.log is None else _log(result.log.columns),)
            for name, result in view.scenarios.items()
        }
        recorded = any(log is not None for walks in logs.values() for log in walks)
        return cls(
            robot=view.robot,
            controller=view.controller,
            preference=view.preference,
            precision=view.precision,
            variables=tuple(view.design),
            designs=np.array([list(design_numbers(view.controller, view.design).values())]),
            scenarios=tuple(view.scenarios),
            statuses=np.array([[Status.from_label(r.status) for r in results]], dtype=np.uint8),
            objectives=np.array(values, dtype=np.float64),
            measurements=np.array([measured], dtype=np.float64),
            utilities=np.array([[result.utility for result in results]], dtype=np.float64),
            fitness=np.array([view.fitness], dtype=np.float64),
            logs=logs if recorded else {},
        )

    @property
    def figure_of_merit(self) -> Floats:
        """(n,) F of eq. 3.1, to be maximized; NaN unless the preference is `chapter-3`."""
        values = [figure_of_merit(fitness, self.preference) for fitness in self.fitness.tolist()]
        return np.array(values, dtype=np.float64)

    def __getitem__(self, scenario: str) -> ScenarioResult:
        k = self.scenarios.index(scenario) if scenario in self.scenarios else None
        if k is None:
            raise KeyError(f"{scenario!r}; simulated were {', '.join(self.scenarios)}")
        return ScenarioResult(
            statuses=tuple(Status(status) for status in self.statuses[:, k].tolist()),
            objectives=dict(zip(OBJECTIVE_NAMES, self.objectives[:, k].T, strict=True)),
            measurements=dict(zip(MEASUREMENT_NAMES, self.measurements[:, k].T, strict=True)),
            utility=self.utilities[:, k],
            logs=self.logs.get(scenario, ()),
        )

    def table(self) -> Table:
        """One row for every simulation, by design and scenario.

        Returns:
            A table with the columns design (index from 0), scenario, status, utility, the
            objectives and measurements by name, and `design.<variable>`.
        """
        n, k = self.statuses.shape
        columns: dict[str, NDArray[Any]] = {
            "design": np.repeat(np.arange(n), k),
            "scenario": np.tile(np.array(self.scenarios), n),
            "status": np.array([Status(s).label for s in self.statuses.ravel().tolist()]),
            "utility": self.utilities.ravel(),
        }
        columns |= {
            name: self.objectives[:, :, m].ravel() for m, name in enumerate(OBJECTIVE_NAMES)
        }
        columns |= {
            name: self.measurements[:, :, m].ravel() for m, name in enumerate(MEASUREMENT_NAMES)
        }
        for name, values in zip(self.variables, self.designs.T, strict=True):
            columns[f"design.{name}"] = np.repeat(values, k)
        return Table(columns)

    def to_pandas(self) -> pd.DataFrame:
        """`table()` as a data frame. Raises ImportError without pandas."""
        return self.table().to_pandas()


def _log(columns: Mapping[str, Any]) -> WalkLog:
    arrays = {name: np.array(c.values, dtype=np.float64) for name, c in columns.items()}
    return WalkLog(**arrays)
