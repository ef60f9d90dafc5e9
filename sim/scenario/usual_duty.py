"""Duty factors of gaits for which the default of a scenario is too little."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

USUAL_SUPPORT: Final[Mapping[str, float]] = MappingProxyType(
    {"wave": 0.85, "ripple": 0.7, "crawl": 0.85}
)
"""Support's share of the cycle by gait [1]: on four or six legs, a little more than that at which a
foot leaves the ground as soon as another one has come down."""


def with_duty_factor(document: Any) -> Any:
    """Add the duty factor that a scenario's gait has unless one is given."""
    if not isinstance(document, Mapping) or "duty_factor" in document:
        return document
    support = USUAL_SUPPORT.get(str(document.get("gait")))
    if support is None:
        return document
    swings = document.get("duty_phase") == "swing"
    return {**document, "duty_factor": round(1.0 - support, 9) if swings else support}
