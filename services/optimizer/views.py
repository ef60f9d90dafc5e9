"""Base of all views: domain objects as JSON, for the HTTP API and the command line alike"""

from __future__ import annotations

import ast
import inspect
import math
import struct
import sys
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, Final, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

T = TypeVar("T")

StatusName = Literal["ok", "diverged", "fell", "unreachable", "stalled", "struck"]


@cache
def field_docstrings(module: str) -> Mapping[str, Mapping[str, str]]:
    """Docstrings below the fields of a module's classes, each in one line."""
    return {
        model.name: {
            field.target.id: " ".join(text.value.value.split())
            for field, text in pairwise(model.body)
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
            if isinstance(text.value.value, str)
        }
        for model in ast.parse(inspect.getsource(sys.modules[module])).body
        if isinstance(model, ast.ClassDef)
    }


class _Described(BaseModel):
    """A model whose longer descriptions of fields are docstrings below them.

    They are read for JSON schemas alone: Pydantic would read them at every start.
    """

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        document = handler(schema)
        properties = handler.resolve_ref_schema(document)["properties"]
        for base in cls.__mro__[: cls.__mro__.index(_Described)]:
            for name, text in field_docstrings(base.__module__).get(base.__name__, {}).items():
                properties[name].setdefault("description", text)
        return document


class View(_Described):
    """A domain object as JSON, in which a number that is not finite is null."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True, defer_build=True)


class Request(_Described):
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
