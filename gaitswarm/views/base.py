"""Problems, and the prefix of paths."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import Field

from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.input import message_of, without_tags

PREFIX: Final = "/v1"
"""Version of the HTTP API, in every path."""

_LEADING_FIELD: Final = re.compile(r"^([a-z_]+(?:\.\w+)*): (.*)$", re.DOTALL)


class FieldErrorView(View):
    """What is wrong with one field of a request."""

    field: str = Field(examples=["variables.0.low"])
    """Path of the field, parts joined by dots; empty for the request as a whole."""
    message: str = Field(examples=["must be a finite number"])
    """What is wrong with it and what it must be."""

    @classmethod
    def from_message(cls, field: str, message: str) -> FieldErrorView:
        """An error whose message may name its field."""
        match = _LEADING_FIELD.match(message)
        if not field and match:
            field, message = match.groups()
        return cls(field=field, message=message)


class ProblemView(View):
    """A problem (RFC 9457, application/problem+json)."""

    type: str = Field(examples=["urn:gaitswarm:problem:invalid-request"])
    """Kind of problem, the same for every occurrence of it."""
    title: str = Field(description="The kind in words.", examples=["Invalid request"])
    status: int = Field(description="HTTP status code.", examples=[422])
    detail: str = Field(examples=["iterations: must be at least 1"])
    """What went wrong this time and what to do about it."""
    instance: str = Field(description="Path of the request.", examples=["/v1/jobs"])
    errors: list[FieldErrorView] = Field(default=[])
    """Every offending field; empty if no field is to blame."""


def field_errors(errors: Iterable[Mapping[str, Any]], *, prefix: str = "") -> list[FieldErrorView]:
    """Return pydantic's errors by field, without repeats."""
    found = []
    for error in errors:
        if error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]:
            continue  # the list is too short without its wrong items
        location = without_tags(error["loc"])
        path = ".".join(str(part) for part in (*([prefix] if prefix else []), *location))
        found.append(FieldErrorView.from_message(path, message_of(error)))
    return list(dict.fromkeys(found))
