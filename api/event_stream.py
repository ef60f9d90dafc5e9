"""Answers of server-sent events that are encoded already: once for all who follow a job."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from typing import Final

from fastapi.responses import StreamingResponse
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from starlette.types import Receive, Scope, Send

KEEP_ALIVE_SECONDS: Final = 15.0
"""After so long a silence a comment is sent, for proxies that end idle connections [s]."""

_REVOKED: Final = format_sse_event(comment="the token was revoked")

EVENT_SCHEMA: Final = {
    "type": "object",
    "properties": {
        "data": {"type": "string"},
        "event": {"type": "string"},
        "id": {"type": "string"},
        "retry": {"type": "integer", "minimum": 0},
    },
}
"""Of one event, as OpenAPI 3.2 has it."""

_HEADERS: Final = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
"""Nothing is to be kept, or held back until there is more of it."""


class EventStream(StreamingResponse):
    """An answer that ends with its events, with its client, or with its client's token."""

    media_type = "text/event-stream"

    def __init__(
        self, events: AsyncGenerator[bytes, None], until_revoked: Callable[[], Awaitable[None]]
    ) -> None:
        """Take on the events."""
        self._texts = _kept_alive(events, until_revoked)
        super().__init__(self._texts, headers=_HEADERS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            await self._texts.aclose()


async def _kept_alive(
    events: AsyncGenerator[bytes, None], until_revoked: Callable[[], Awaitable[None]]
) -> AsyncGenerator[bytes, None]:
    """The same, with comments where nothing else is to be sent for a while."""
    following: asyncio.Task[bytes | None] | None = None
    revoked = asyncio.ensure_future(until_revoked())
    try:
        while True:
            following = following or asyncio.ensure_future(anext(events, None))
            await asyncio.wait(
                [following, revoked],
                timeout=KEEP_ALIVE_SECONDS,
                return_when=asyncio.FIRST_COMPLETED,
            )
            if revoked.done():
                revoked.result()
                yield _REVOKED
                return
            if not following.done():
                yield KEEPALIVE_COMMENT
                continue
            text, following = following.result(), None
            if text is None:
                return
            yield text
    finally:
        waiting = [revoked] if following is None else [revoked, following]
        for task in waiting:
            task.cancel()
        await asyncio.wait(waiting)
        await events.aclose()
