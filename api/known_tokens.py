"""Tokens that a server remembers, so that a page's twenty requests ask the database once."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

from anyio.to_thread import run_sync

from gaitswarm.services.optimizer.access import Token, Tokens
from gaitswarm.services.optimizer.errors import StoreUnavailable

REMEMBERED_SECONDS: Final = 5.0
"""So long a token that was revoked may still be used."""

_MOST_REMEMBERED: Final = 1024


class KnownTokens:
    """What was looked up of secrets. Of one event loop."""

    def __init__(self, tokens: Callable[[], Tokens]) -> None:
        """Begin with none."""
        self._tokens = tokens
        # Until when each is as good as looked up now.
        self._remembered: dict[str, tuple[float, Token]] = {}
        self._watching = asyncio.Lock()

    def last(self, secret: str) -> Token | None:
        """What a secret was good for when it was last looked up, however long ago."""
        return self._remembered.get(secret, (0.0, None))[1]

    def lately(self, secret: str) -> Token | None:
        """The same, if that is at most `REMEMBERED_SECONDS` ago."""
        return self.last(secret) if self._seconds_left(secret) > 0.0 else None

    async def find(self, secret: str) -> Token | None:
        """What a secret is good for, as it was at most `REMEMBERED_SECONDS` ago."""
        known = self.lately(secret)
        if known is not None:
            return known
        token = await run_sync(self._tokens().find, secret)
        self._remembered.pop(secret, None)
        if token is not None:
            if len(self._remembered) >= _MOST_REMEMBERED:
                self._remembered.clear()
            self._remembered[secret] = (time.monotonic() + REMEMBERED_SECONDS, token)
        return token

    async def until_revoked(self, secret: str) -> None:
        """Return once a secret is good for nothing any more, at most `REMEMBERED_SECONDS` later.

        However many wait for the same, the database is asked once for them all. While it is away,
        nothing is revoked.
        """
        while True:
            # One asks; the next then know.
            async with self._watching:
                try:
                    token = await self.find(secret)
                except StoreUnavailable:
                    token = self.last(secret)
            if token is None:
                return
            left = self._seconds_left(secret)
            await asyncio.sleep(left if left > 0.0 else REMEMBERED_SECONDS)

    def _seconds_left(self, secret: str) -> float:
        """In which it need not be looked up."""
        until, _ = self._remembered.get(secret, (0.0, None))
        return until - time.monotonic()
