"""Context of log messages: job, iteration, request"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType
from typing import Final

_NOTHING: Final[Mapping[str, str | int]] = MappingProxyType({})

_fields: ContextVar[Mapping[str, str | int]] = ContextVar("log_fields", default=_NOTHING)


@contextmanager
def log_context(**fields: str | int | None) -> Iterator[None]:
    """Attach fields to messages logged inside the block."""
    given = {name: value for name, value in fields.items() if value is not None}
    token = _fields.set({**_fields.get(), **given})
    try:
        yield
    finally:
        _fields.reset(token)


def log_fields() -> Mapping[str, str | int]:
    return _fields.get()
