"""Outcomes of simulations: objectives, measurements and statuses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError


class Status(IntEnum):
    """End of a simulation, a result like any other: a bad design is not an error."""

    OK = 0
    DIVERGED = 1
    FELL = 2
    UNREACHABLE = 3
    STALLED = 4
    STRUCK = 5

    @property
    def label(self) -> str:
        """Lower-case name, as in texts and JSON."""
        return self.name.lower()

    @property
    def phrase(self) -> str:
        """Explanation for users, with a remedy."""
        return _PHRASES[self]

    @classmethod
    def from_label(cls, label: str) -> Status:
        """Return the status of a label; raise KeyError if there is none.

        Args:
            label: As in texts and JSON.
        """
        return cls[label.upper()]


_PHRASES: Final = {
    Status.OK: "walked to the end",
    Status.DIVERGED: "a state became infinite or undefined; check gains and contact stiffness",
    Status.FELL: "the body sank below half its hip height or tilted over 45 degrees",
    Status.UNREACHABLE: "the foot trajectory leaves the leg's reach; reduce stride or hip_height",
    Status.STALLED: "the robot did not move forward, so energy per metre has no value",
    Status.STRUCK: "a knee or the body struck uneven ground; raise hip_height",
}


class Objective(NamedTuple):
    """A column of results, minimized or measured: name in tables and JSON, unit, description."""

    name: str
    unit: str
    description: str


OBJECTIVES: Final[tuple[Objective, ...]] = (
    Objective("torque", "N m", "f1: rms over time of the sum of the absolute gear torques"),
    Objective("acceleration", "m/s2", "f2: rms of the norm of the body's linear acceleration"),
    Objective("angular_acceleration", "rad/s2", "f3: rms of the body's angular acceleration"),
    Objective("energy", "J/m", "f4: electrical energy of the motors per metre walked"),
    Objective("reciprocal_speed", "s/m", "f5: one over the mean forward speed"),
    Objective(
        "height_loss",
        "m",
        "f6: loss of height of the body from start to end, positive when it sinks",
    ),
)
"""Objectives of a walk (thesis table 4.1), in the order of an objectives array's columns.

f6 has the opposite sign of table 4.1, whose loss of height is z(t_end) - z(0): here less is better
in every column. Preferences weigh its absolute value (eq. 3.1), so fitness ignores the sign.
"""

MEASUREMENTS: Final[tuple[Objective, ...]] = (
    Objective("peak_current", "A", "largest absolute current of any motor at any physics step"),
    Objective("mean_current", "A", "mean over time and motors of the absolute current"),
    Objective("motor_heat", "W", "mean heat of all windings, R I^2"),
    Objective("power", "W", "mean electrical power of all motors, as counted by f4"),
    Objective("speed", "m/s", "mean speed in the direction of the walk"),
    Objective(
        "peak_torque",
        "N m",
        "largest absolute torque that any gear passes to its link at any physics step",
    ),
    Objective("roll", "deg", "largest absolute roll of the body against the ground's plane"),
    Objective("pitch", "deg", "largest absolute pitch of the body against the ground's plane"),
    Objective(
        "foot_clearance",
        "m",
        "largest height of a sole above the ground in a gait cycle, least of all legs and cycles",
    ),
    Objective(
        "slip", "m/m", "distance that feet slide on the ground, mean of all feet, per metre walked"
    ),
)
"""Further results of a walk, in the order of a measurements array's columns."""

MEASUREMENT_NAMES: Final = tuple(measurement.name for measurement in MEASUREMENTS)
N_MEASUREMENTS: Final = len(MEASUREMENTS)

OBJECTIVES_VERSION: Final = 2
"""Version of `OBJECTIVES` in provenances. In version 1, f6 was end height less start height."""

RESULTS: Final = (*OBJECTIVES, *MEASUREMENTS)
"""All results of a walk, f1 to f6 first."""

OBJECTIVE_NAMES: Final = tuple(objective.name for objective in OBJECTIVES)
N_OBJECTIVES: Final = len(OBJECTIVES)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Results of a batch of n designs in one case.

    Attributes:
        objectives: (n, m) float64, columns as in the case's `objectives` (`OBJECTIVES` for a walk);
            a value that does not exist (the design did not walk) is NaN.
        statuses: (n,) uint8, values of `Status`.
    """

    objectives: Floats
    statuses: NDArray[np.uint8]

    def __post_init__(self) -> None:
        n = len(self.statuses)
        if self.objectives.ndim != 2 or len(self.objectives) != n or self.statuses.shape != (n,):
            raise SimulationInputError(
                f"an outcome of {n} designs needs objectives of shape ({n}, m),"
                f" not {self.objectives.shape}"
            )


class Measurements(NamedTuple):
    """Measurements of n designs, each (n,), NaN where a walk ended early; see `MEASUREMENTS`."""

    peak_current: Floats
    mean_current: Floats
    motor_heat: Floats
    power: Floats
    speed: Floats
    peak_torque: Floats
    roll: Floats
    pitch: Floats
    foot_clearance: Floats
    slip: Floats

    @classmethod
    def of(cls, rows: Floats) -> Measurements:
        """Create measurements from rows (n, 10), columns as in `MEASUREMENTS`."""
        return cls(**dict(zip(MEASUREMENT_NAMES, rows.T.copy(), strict=True)))

    def array(self) -> Floats:
        """Return an array (n, 10), columns as in `MEASUREMENTS`."""
        return np.stack([getattr(self, name) for name in MEASUREMENT_NAMES], axis=1)
