"""Base of all views: domain objects as JSON, for the HTTP API and the command line alike"""

from __future__ import annotations

import math
import struct
from typing import Annotated, Any, Final, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from gaitswarm.sim.input import Described

T = TypeVar("T")

StatusName = Literal["ok", "diverged", "fell", "unreachable", "stalled", "struck"]


class View(Described):
    """A domain object as JSON, in which a number that is not finite is null."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True, defer_build=True)


class Request(Described):
    """The body of a request."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def fields_of(view: type[BaseModel], *sources: object) -> dict[str, Any]:
    """Read the fields of a view from the attributes of objects; the last that has one counts."""
    return {
        name: getattr(source, name)
        for source in sources
        for name in view.model_fields
        if hasattr(source, name)
    }


def finite(value: float | None) -> float | None:
    """Return None for a number that JSON cannot represent."""
    return None if value is None or not math.isfinite(value) else float(value)


Finite = Annotated[float | None, BeforeValidator(finite)]
"""A number, null if it is not finite."""

IterationIndex = Annotated[int, Field(description="Iteration of the job, from 0.", examples=[24])]
Particle = Annotated[
    int, Field(description="Number of the design in its iteration, from 0.", examples=[7])
]
DesignValues = Annotated[
    dict[str, float | str],
    Field(
        description="Value of every variable, by name; units as in /v1/controllers.",
        examples=[{"I": 0.171, "FI1R": 5837.0}],
    ),
]
JobName = Annotated[str, Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])]
NextPage = Annotated[
    str | None,
    Field(
        description="Give it as `after` to get the following page; null on the last page.",
        examples=["24"],
    ),
]


def listing_name(params: tuple[type[Any], ...], kind: str) -> str:
    """Name the schema of a list of views: (JobSummaryView,), "Page" -> JobSummaryPage."""
    return "".join(param.__name__.removesuffix("View") for param in params) + kind


class PageView(View, Generic[T]):
    """A page of a list. The list is complete when `next` is null."""

    # A parametrized generic does not inherit its docstring.
    model_config = ConfigDict(
        json_schema_extra={
            "description": "A page of a list. The list is complete when `next` is null."
        }
    )

    items: list[T] = Field(description="The items, in the list's order.")
    next: NextPage

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Name the schema of a page."""
        return listing_name(params, "Page")


MEDIA_TYPE: Final = "application/octet-stream"


def framed(header: BaseModel, numbers: NDArray[np.floating]) -> bytes:
    """Encode a JSON header followed by little-endian float32 numbers."""
    text = header.model_dump_json().encode()
    text += b" " * (-len(text) % 4)
    with np.errstate(over="ignore"):
        return struct.pack("<I", len(text)) + text + numbers.astype("<f4").tobytes()
