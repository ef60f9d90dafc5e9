"""Any job's spec: the union of all kinds, told apart by `kind`."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Discriminator, Tag, TypeAdapter

from services.optimizer.jobs.identification import IdentificationSpec
from services.optimizer.jobs.tuning import JobSpec


def _kind(value: Any) -> str:
    """Of a document or a spec; a job without one tunes a drive."""
    if isinstance(value, dict):
        return str(value.get("kind", "tuning"))
    return str(getattr(value, "kind", "tuning"))


AnySpec = Annotated[
    Annotated[JobSpec, Tag("tuning")] | Annotated[IdentificationSpec, Tag("identification")],
    Discriminator(
        _kind,
        custom_error_type="unknown_kind",
        custom_error_message="kind: must be tuning or identification",
    ),
]

SPECS: Final[TypeAdapter[JobSpec | IdentificationSpec]] = TypeAdapter(AnySpec)
"""Reads a spec of any kind. Raises ValidationError."""
