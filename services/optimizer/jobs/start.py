"""Start designs of a job's search"""

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
        description="Value of every searched variable, by name; a categorical one by a"
        " choice's name or index. Fixed variables may be omitted.",
        examples=[{"FI1R": 4380.5, "FO2R": 231.0}],
    ),
]


class EarlierJobs(BaseModel):
    """The best designs of earlier jobs, looked up once, at submission."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    jobs: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = Field(
        min_length=1,
        max_length=100,
        description="Job identifiers; the best design of each comes first, then the second ones.",
        examples=[["k2q7zr5dm9xw"]],
    )
    count: int = Field(
        default=5, ge=1, le=10_000, description="Maximum number of distinct designs in total [1]."
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
