"""What messages of the log belong to: a job, an iteration, a request."""

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
    """Let messages that are logged inside the block say what they belong to.

    It holds for the thread or the asynchronous task that enters the block, and for threads that
    anyio runs for it; a thread that is started inside enters a block of its own.
    """
    known = {name: value for name, value in fields.items() if value is not None}
    token = _fields.set({**_fields.get(), **known})
    try:
        yield
    finally:
        _fields.reset(token)


def log_fields() -> Mapping[str, str | int]:
    """What a message that is logged now belongs to."""
    return _fields.get()
