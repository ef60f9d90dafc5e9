"""What every view has in common, and how numbers are framed."""

from __future__ import annotations

import math
import struct
from typing import Any, Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

T = TypeVar("T")


class View(BaseModel):
    """A domain object as people and programs see it, in JSON.

    Views are made from domain objects by their `from_*` constructors, at one place, for the HTTP
    API and the command line alike. JSON has no infinities: a number that is not finite is null.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")


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
    next: str | None = Field(
        description="Give it as `after` to get the following page; null on the last page.",
        examples=["24"],
    )

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Name the schema of a page."""
        return listing_name(params, "Page")


def finite(value: float | None) -> float | None:
    """Make a number one that JSON has."""
    return None if value is None or not math.isfinite(value) else float(value)


MEDIA_TYPE: Final = "application/octet-stream"


def framed(header: BaseModel, numbers: NDArray[np.floating]) -> bytes:
    """Frame numbers behind a header that explains them; all little-endian.

    The numbers begin at a multiple of four bytes, as typed arrays want them.
    """
    text = header.model_dump_json().encode()
    text += b" " * (-len(text) % 4)
    with np.errstate(over="ignore"):
        return struct.pack("<I", len(text)) + text + numbers.astype("<f4").tobytes()


def unframed(content: bytes) -> tuple[bytes, NDArray[np.float32]]:
    """Header and numbers of what `framed` made."""
    if len(content) < struct.calcsize("<I"):
        raise ValueError("there is no header")
    (length,) = struct.unpack_from("<I", content)
    begin = struct.calcsize("<I") + length
    if begin > len(content):
        raise ValueError("the header is cut off")
    return content[begin - length : begin], np.frombuffer(content, dtype="<f4", offset=begin)
