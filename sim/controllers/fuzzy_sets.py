"""Membership functions that the fuzzy controllers share, on normalised universes.

Assumed, since the thesis draws but does not list them; see docs/model.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from sim.controllers.mamdani import FuzzySet

SIGNED: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {
        "negative": FuzzySet(-1.0, 1.0),
        "zero": FuzzySet(0.0, 1.0),
        "positive": FuzzySet(1.0, 1.0),
    }
)
"""Of an error, angle or velocity."""

AMOUNT: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {"small": FuzzySet(0.0, 1.0), "large": FuzzySet(1.0, 1.0)}
)
"""Of a current's absolute value."""

OUTPUT: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {
        "null": FuzzySet(0.0, 0.5),
        "positive": FuzzySet(0.5, 0.5),
        "negative": FuzzySet(-0.5, 0.5),
    }
)

EXTREME: Final[Mapping[str, FuzzySet]] = MappingProxyType(
    {
        "positive-extreme": FuzzySet(1.0, 0.5),
        "negative-extreme": FuzzySet(-1.0, 0.5),
    }
)
"""Of an output that can be reversed at full strength."""
