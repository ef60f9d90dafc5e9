"""What every view has in common, how numbers are framed, and problems (RFC 9457)."""

from __future__ import annotations

import math
import struct
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field


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


MEDIA_TYPE: Final = "application/octet-stream"


def framed(header: BaseModel, numbers: NDArray[np.floating]) -> bytes:
    """Length of the header (uint32), header (padded with spaces), numbers; all little-endian.

    The numbers begin at a multiple of four bytes, as typed arrays want them.
    """
    text = header.model_dump_json().encode()
    text += b" " * (-len(text) % 4)
    with np.errstate(over="ignore"):
        return struct.pack("<I", len(text)) + text + numbers.astype("<f4").tobytes()


class FieldErrorView(View):
    """What is wrong with one field of a request."""

    field: str = Field(
        description="Path of the field, parts joined by dots; empty for the request as a whole.",
        examples=["variables.0.low"],
    )
    message: str = Field(
        description="What is wrong with it and what it must be.",
        examples=["Input should be a finite number"],
    )


class ProblemView(View):
    """A problem (RFC 9457, application/problem+json)."""

    type: str = Field(
        description="Kind of problem, the same for every occurrence of it.",
        examples=["urn:gaitswarm:problem:invalid-request"],
    )
    title: str = Field(description="The kind in words.", examples=["The request is not valid"])
    status: int = Field(description="HTTP status code.", examples=[422])
    detail: str = Field(
        description="What went wrong this time and what to do about it.",
        examples=["iterations: Input should be greater than or equal to 1"],
    )
    instance: str = Field(description="Path of the request.", examples=["/v1/jobs"])
    errors: list[FieldErrorView] = Field(
        default=[], description="Every offending field; empty if no field is to blame."
    )
