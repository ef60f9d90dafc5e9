"""Revoked tokens: rejected within seconds, also in open event streams."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import takewhile
from threading import Lock
from typing import cast

import pytest

from gaitswarm.api import access
from gaitswarm.api.access import TokenCache
from gaitswarm.services.optimizer.access import Scope, Token
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.tokens import Tokens
from tests.api.conftest import Serve

STREAMS = 40


def test_lookups_are_cached_as_long_as_documented() -> None:
    assert access.CACHE_SECONDS == 5.0


@pytest.mark.slow
def test_event_stream_ends_when_its_token_is_revoked(
    serve: Serve, store: Store, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "CACHE_SECONDS", 1.0)
    client = serve(api_access="token").client
    with ExitStack() as stack:

        def stream(name: str) -> Iterator[str]:
            secret = store.tokens.create(name, Scope.READ)[1]
            opened = client.stream(
                "GET", f"/v1/jobs/{job.id}/events", headers={"Authorization": f"Bearer {secret}"}
            )
            return stack.enter_context(opened).iter_lines()

        leaked, other = stream("leaked"), stream("other")
        assert "queued" in next_event(leaked) and "queued" in next_event(other)
        time.sleep(2.5)
        store.command(job.id, Command.PAUSE)
        assert "paused" in next_event(leaked) and "paused" in next_event(other)

        store.tokens.revoke("leaked")
        until = time.monotonic() + 10.0
        # Nothing happens to the job meanwhile; a stream that goes on has a comment now and then.
        said = list(takewhile(lambda _: time.monotonic() < until, leaked))
        assert ": the token was revoked" in said
        store.command(job.id, Command.RESUME)
        assert "queued" in next_event(other)


def next_event(lines: Iterator[str]) -> str:
    """Data of the next event."""
    return next(line for line in lines if line.startswith("data:"))


class CountedTokens:
    """Tokens in a database that may be away."""

    def __init__(self) -> None:
        self.away = self.revoked = False
        self.asked = 0
        self._counting = Lock()

    def find(self, _secret: str) -> Token | None:
        with self._counting:
            self.asked += 1
        if self.away:
            raise StoreUnavailable("the database is away")
        return None if self.revoked else cast(Token, object())


def test_one_lookup_serves_all_streams_and_outages_revoke_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(access, "CACHE_SECONDS", 0.5)
    tokens = CountedTokens()

    async def run() -> None:
        cache = TokenCache(lambda: cast(Tokens, tokens))
        assert await cache.find("secret")
        waiting = [asyncio.ensure_future(cache.until_revoked("secret")) for _ in range(STREAMS)]
        await asyncio.sleep(1.3)
        assert 2 <= tokens.asked < STREAMS
        tokens.away = True
        await asyncio.sleep(0.8)
        assert not any(task.done() for task in waiting)
        tokens.away, tokens.revoked = False, True
        await asyncio.wait_for(asyncio.gather(*waiting), timeout=20.0)

    asyncio.run(run())
