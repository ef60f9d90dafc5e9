"""Webhooks that notify about ended jobs, as in https://www.standardwebhooks.com"""

from __future__ import annotations

import asyncio
import base64
import binascii
import hashlib
import hmac
import json
import logging
import threading
import time
from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

import httpx2

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.notification import Notification, refused_url
from gaitswarm.services.worker.dispatch import in_daemon

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_DEADLINE: Final = 10.0
"""Longest attempt, from the connection to the response's headers [s]."""

_AT_ONCE: Final = 32
"""Attempts that are under way at the same time."""

_LEASE_SECONDS: Final = 60.0
"""Longer than any attempt, unless its process died."""

_POLL_SECONDS: Final = 1.0

_STORE_PAUSE: Final = 10.0
"""Pause after a failure of the store [s]."""

T = TypeVar("T")

_log = logging.getLogger(__name__)


def signature(secret: str, message_id: str, timestamp: int, body: bytes) -> str:
    signed = b".".join((message_id.encode(), str(timestamp).encode(), body))
    digest = hmac.new(_key(secret), signed, hashlib.sha256).digest()
    return f"v1,{base64.b64encode(digest).decode()}"


def _key(secret: str) -> bytes:
    if secret.startswith("whsec_"):
        try:
            return base64.b64decode(secret.removeprefix("whsec_"), validate=True)
        except binascii.Error:
            pass
    return secret.encode()


class _Daemons(ThreadPoolExecutor):
    """Makes each call in a daemon thread: no stop waits for a host's address that is not found."""

    def submit(self, call: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        return in_daemon("notification", call, *args, **kwargs)


class Notifier:
    """Sends due notifications from its own thread, from start() to stop(), each at least once.

    Several processes may run one: each notification is leased by one at a time.
    """

    def __init__(self, store: Store, hosts: Collection[str], secret: str | None) -> None:
        self._store = store
        self._hosts = hosts
        self._secret = secret
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="notifier", daemon=True)

    def start(self) -> None:
        """Start sending. Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """Abandon current attempts, which are repeated when their leases end. Idempotent."""
        if self._thread.is_alive():
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def _run(self) -> None:
        self._loop.set_default_executor(_Daemons())
        with closing(self._loop):
            self._loop.run_until_complete(self._send())

    async def _send(self) -> None:
        stopped = asyncio.create_task(self._stop.wait())
        attempts: set[asyncio.Task[None]] = set()
        # Ignore proxies and credentials in the environment.
        async with httpx2.AsyncClient(
            timeout=None, follow_redirects=False, trust_env=False
        ) as client:
            while not self._stop.is_set():
                pause = _POLL_SECONDS
                try:
                    due = await self._next() if len(attempts) < _AT_ONCE else None
                except StoreUnavailable as error:
                    _log.warning("cannot send notifications: %s", error)
                    due, pause = None, _STORE_PAUSE
                if due is not None:
                    attempt = asyncio.create_task(self._attempt(client, due))
                    attempts.add(attempt)
                    attempt.add_done_callback(attempts.discard)
                    continue
                awaited = {stopped, *attempts}
                await asyncio.wait(awaited, timeout=pause, return_when=asyncio.FIRST_COMPLETED)
            for attempt in attempts:
                attempt.cancel()
            await asyncio.gather(*attempts, return_exceptions=True)

    async def _next(self) -> Notification | None:
        return await asyncio.to_thread(self._store.outbox.take, lease_seconds=_LEASE_SECONDS)

    async def _attempt(self, client: httpx2.AsyncClient, due: Notification) -> None:
        """Make one attempt and record its result."""
        try:
            refused = refused_url(due.url, self._hosts)
            error = refused or await self._post(client, due)
            settle = self._store.outbox.settle
            await asyncio.to_thread(settle, due, error, final=refused is not None)
        except StoreUnavailable as failure:
            error = f"cannot be recorded: {failure}"
        except Exception:  # noqa: BLE001 - one notification must not block the others
            _log.exception("cannot send notification %s", due.id)
            return
        if error is not None:
            _log.warning("job %s: notification %s: %s", due.job_id, due.id, error)

    async def _post(self, client: httpx2.AsyncClient, due: Notification) -> str | None:
        """Return the error, for people; None on success."""
        body = json.dumps(due.document, separators=(",", ":")).encode()
        now = int(time.time())
        headers = {
            "Content-Type": "application/json",
            "User-Agent": "gaitswarm",
            "webhook-id": due.id,
            "webhook-timestamp": str(now),
        }
        if self._secret is not None:
            headers["webhook-signature"] = signature(self._secret, due.id, now, body)
        try:
            # The response's body, of unknown size, is not read.
            async with (
                asyncio.timeout(_DEADLINE),
                client.stream("POST", due.url, content=body, headers=headers) as answer,
            ):
                status = answer.status_code
        except TimeoutError:
            return f"the receiver did not answer within {_DEADLINE:g} s"
        except (httpx2.HTTPError, httpx2.InvalidURL) as error:
            return f"sending failed: {type(error).__name__}"
        return None if 200 <= status < 300 else f"the receiver answered {status}"
