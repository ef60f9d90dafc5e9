"""Membership functions of the fuzzy controllers, on normalised universes.

The thesis draws but does not list them. Choices that the drawings leave open are conventions, which
a design may set. With the default sets, table 4.3's own weights and the published optima A and B
reverse the drive at extreme current, as in 4.3.2 and fig. 4.5; see docs/model.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from gaitswarm.sim.controllers.fixed_point import given_or_default
from gaitswarm.sim.controllers.mamdani import FuzzySet
from gaitswarm.sim.variables import Variable

SIGNED: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {"negative": FuzzySet(-1.0, 1.0), "zero": FuzzySet(0.0, 1.0), "positive": FuzzySet(1.0, 1.0)}
)
"""Sets of an angle or velocity error."""

LARGE_BEGINS: Final = Variable(
    name="large_begins",
    low=0.0,
    high=0.9,
    default=0.1,
    description="Share of the current's range from which a current is large.",
)
SMALL_ENDS: Final = Variable(
    name="small_ends",
    low=0.1,
    high=1.0,
    default=0.5,
    description="Share of the current's range up to which a current is small.",
)
POSITIVE_PEAK: Final = Variable(
    name="positive_peak",
    low=0.25,
    high=1.5,
    default=1.0,
    description="Share of the output's range at which the positive output peaks.",
)
EXTREME_PEAK: Final = Variable(
    name="extreme_peak",
    low=0.5,
    high=3.0,
    default=2.0,
    description="Share of the output's range at which the extreme positive output peaks.",
)
UNIVERSE: Final = Variable(
    name="universe",
    low=0.5,
    high=4.5,
    default=3.0,
    description="Share of the output's range up to which the output's centroid is taken; sets that"
    " reach beyond are cut there.",
)


_LIMITS: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "large_begins": (0.0, 0.99),
        "small_ends": (0.01, 10.0),
        "positive_peak": (0.01, 10.0),
        "extreme_peak": (0.01, 10.0),
        "universe": (0.1, 10.0),
    }
)
"""Values that can be computed, a wider range than that worth searching."""


@dataclass(frozen=True, slots=True)
class MembershipSets:
    """Sets of a current's absolute value and of an output, for the conventions above."""

    large_begins: float
    small_ends: float
    positive_peak: float
    universe: float
    extreme_peak: float | None = None  # None for an output without extremes

    @classmethod
    def of(cls, design: Mapping[str, float], conventions: Iterable[Variable]) -> MembershipSets:
        return cls(
            **{
                variable.name: given_or_default(design, variable, *_LIMITS[variable.name])
                for variable in conventions
                if variable.name in _LIMITS
            }
        )

    @property
    def amount(self) -> dict[str, FuzzySet]:
        """Sets of a current's absolute value."""
        return {
            "small": FuzzySet(0.0, self.small_ends),
            "large": FuzzySet(1.0, 1.0 - self.large_begins),
        }

    @property
    def output(self) -> dict[str, FuzzySet]:
        """Sets of the output."""
        peaks = {"null": 0.0, "positive": self.positive_peak, "negative": -self.positive_peak}
        if self.extreme_peak is not None:
            peaks["positive-extreme"] = self.extreme_peak
            peaks["negative-extreme"] = -self.extreme_peak
        return {name: FuzzySet(peak, self.positive_peak) for name, peak in peaks.items()}
