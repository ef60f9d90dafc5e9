"""Errors of the simulator.

SimulationError
├── SimulationInputError    a value that cannot be simulated; names the field (also a ValueError)
│   ├── UnreachablePose     a foot target outside the leg's reach; names scenario, leg, miss in mm
│   ├── BeyondJointLimit    a gait turns a joint too far; names scenario, leg, joint, excess in rad
│   ├── MeasuredLogError    a log that cannot be read; names line, column and unit
│   └── RobotFileError      a robot description that cannot be used; names file and field
├── ProcessEnded            a limited process exceeded a limit or ended
└── KernelBuildError        a kernel cannot be compiled, stored or loaded on this machine

Legitimate ends of a simulation (divergence, a fall) are a `sim.outcome.Status` instead.
"""

from __future__ import annotations


class SimulationError(Exception):
    """Base of all errors that the simulator raises."""


class SimulationInputError(SimulationError, ValueError):
    """A value that cannot be simulated."""


class UnreachablePose(SimulationInputError):
    """A foot target lies outside the reach of its leg, by `miss` [m]."""

    def __init__(self, scenario: str, leg: str, miss: float) -> None:
        self.scenario = scenario
        self.leg = leg
        self.miss = miss
        self.reason = f"leg {leg!r} misses its foot trajectory by {miss * 1000:.1f} mm"
        super().__init__(
            f"scenario {scenario!r}: {self.reason}; reduce stride, radius or hip_height"
        )

    def __reduce__(self) -> tuple[type[UnreachablePose], tuple[str, str, float]]:
        """Pickle by the arguments, so that the error keeps its type across processes."""
        return type(self), (self.scenario, self.leg, self.miss)


class BeyondJointLimit(SimulationInputError):
    """A gait rotates a joint beyond its URDF's limits, by `excess` [rad]."""

    def __init__(self, scenario: str, leg: str, joint: str, excess: float) -> None:
        self.scenario = scenario
        self.leg = leg
        self.joint = joint
        self.excess = excess
        self.reason = f"joint {joint!r} of leg {leg!r} would turn {excess:.3f} rad beyond its limit"
        super().__init__(
            f"scenario {scenario!r}: {self.reason}; reduce stride or height, or change hip_height"
            " or radius"
        )

    def __reduce__(self) -> tuple[type[BeyondJointLimit], tuple[str, str, str, float]]:
        """Pickle by the arguments, so that the error keeps its type across processes."""
        return type(self), (self.scenario, self.leg, self.joint, self.excess)


class MeasuredLogError(SimulationInputError):
    """A measured log that cannot be read or compared."""

    def __init__(
        self,
        problem: str,
        *,
        line: int | None = None,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        self.problem = problem
        self.line = line
        self.column = column
        where = [f"{name} {n}" for name, n in (("line", line), ("row", row)) if n is not None]
        where += [] if column is None else [f"column '{column}'"]
        super().__init__(": ".join([*([", ".join(where)] if where else []), problem]))


class RobotFileError(SimulationInputError):
    """A robot description that cannot be used."""


class ProcessEnded(SimulationError):
    """A limited process did not finish; the message continues a sentence."""


class KernelBuildError(SimulationError):
    """Compiled code is not available: the compiler, the cache or the system refused it."""
