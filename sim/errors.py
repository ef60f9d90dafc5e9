"""Errors of the simulator.

SimulationError
├── SimulationInputError    a value that cannot be simulated; names the field (also a ValueError)
│   ├── UnreachablePose     a foot target outside the leg's reach; names scenario, leg, miss in mm
│   ├── MeasuredLogError    a log that cannot be read; names line and column (sim.validation)
│   └── RobotFileError      a robot description that cannot be used; names file and field
└── KernelBuildError        the compiler was found but did not compile the kernel

What a walk may legitimately end in (divergence, a fall) is a `sim.outcome.Status`, never one of
these.
"""

from __future__ import annotations


class SimulationError(Exception):
    """Base of everything that the simulator raises on purpose."""


class SimulationInputError(SimulationError, ValueError):
    """A value that cannot be simulated."""


class UnreachablePose(SimulationInputError):
    """A foot target lies outside the reach of its leg.

    scenario, leg: names; miss: distance between target and reach [m]
    """

    def __init__(self, scenario: str, leg: str, miss: float) -> None:
        self.scenario = scenario
        self.leg = leg
        self.miss = miss
        super().__init__(
            f"scenario {scenario!r}: leg {leg!r} misses its foot trajectory by"
            f" {miss * 1000:.1f} mm; reduce stride, radius or hip_height"
        )

    def __reduce__(self) -> tuple[type[UnreachablePose], tuple[str, str, float]]:
        """Pickle by the arguments, so that it comes back from another process as itself."""
        return type(self), (self.scenario, self.leg, self.miss)


class RobotFileError(SimulationInputError):
    """A robot description that cannot be used."""


class KernelBuildError(SimulationError):
    """The compiler was found, but did not compile the kernel."""
