"""What went wrong, as RFC 9457 says it."""

from __future__ import annotations

from pydantic import Field

from api.views.base import View


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
