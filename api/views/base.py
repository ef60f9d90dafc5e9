"""What every view has in common."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, ConfigDict


class View(BaseModel):
    """A domain object as people and programs see it, in JSON.

    Views are made from domain objects by their `from_*` constructors, at one place, for the HTTP
    API and the command line alike. JSON has no infinities: a number that is not finite is null.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")


def listing_name(params: tuple[type[Any], ...], kind: str) -> str:
    """Name of the schema of a list of views: (JobSummaryView,), "Page" -> JobSummaryPage."""
    return "".join(param.__name__.removesuffix("View") for param in params) + kind


def finite(value: float | None) -> float | None:
    """The value, or None where it is missing, infinite or undefined."""
    return None if value is None or not math.isfinite(value) else float(value)
