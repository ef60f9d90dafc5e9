"""Where a job's search begins: designs that are known to be good."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from gaitswarm.sim.variables import VariableName, VariableValue

_DESIGNS: Final = "<designs>"
_JOBS: Final = "<jobs>"

StartDesign = Annotated[
    dict[VariableName, VariableValue],
    Field(
        min_length=1,
        max_length=128,
        description="A value of every variable that is searched, by name; a categorical one at a"
        " choice's name or index. A variable that is held fixed may be left out.",
        examples=[{"FI1R": 4380.5, "FO2R": 231.0}],
    ),
]
"""One design, as people give it."""


class EarlierJobs(BaseModel):
    """The best designs of earlier jobs; looked up once, when the job is submitted."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    jobs: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = Field(
        min_length=1,
        max_length=100,
        description="Identifiers of jobs: the best of each comes first, then the second of each.",
        examples=[["k2q7zr5dm9xw"]],
    )
    count: int = Field(
        default=5, ge=1, le=10_000, description="Different designs in all, at most [1]."
    )


def _tag(value: Any) -> str | None:
    if isinstance(value, Mapping | EarlierJobs):
        return _JOBS
    return _DESIGNS if isinstance(value, list | tuple) else None


StartChoice = Annotated[
    Annotated[tuple[StartDesign, ...], Field(max_length=10_000, fail_fast=True), Tag(_DESIGNS)]
    | Annotated[EarlierJobs, Tag(_JOBS)],
    Discriminator(
        _tag,
        custom_error_type="no_choice",
        custom_error_message="must be a list of designs, or an object that names earlier jobs",
    ),
]
"""How jobs name the designs that they start from."""
