"""Tells others that jobs have ended: POSTs notifications until they are taken.

Headers and signature are those of Standard Webhooks (https://www.standardwebhooks.com).
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import json
import logging
import threading
import time
from collections.abc import Collection
from typing import Final

import httpx2

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.notification import Notification, refused_url
from gaitswarm.services.optimizer.store.port.base import Store

_TIMEOUT: Final = 10.0
"""Longest silence of a receiver [s]."""

_LEASE_SECONDS: Final = 60.0
"""An attempt is over by then, or whoever made it has gone."""

_POLL_SECONDS: Final = 1.0

_STORE_PAUSE: Final = 10.0
"""Seconds until a store that did not answer is asked again."""

_log = logging.getLogger(__name__)


def signature(secret: str, message_id: str, timestamp: int, body: bytes) -> str:
    """Sign a notification."""
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


class Notifier:
    """Sends what is due from a thread of its own, from start() to stop().

    Any number of processes may have one: each notification is one's at a time. A notification is
    delivered at least once; a receiver knows by `webhook-id` what it has had.
    """

    def __init__(self, store: Store, hosts: Collection[str], secret: str | None) -> None:
        self._store = store
        self._hosts = hosts
        self._secret = secret
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifier", daemon=True)

    def start(self) -> None:
        """Begin to send. Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """End after the attempt under way. Idempotent."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        # No proxy and no credentials of this process's environment.
        with httpx2.Client(timeout=_TIMEOUT, follow_redirects=False, trust_env=False) as client:
            while not self._stop.is_set():
                try:
                    pause = 0.0 if self._send_next(client) else _POLL_SECONDS
                except StoreUnavailable as error:
                    _log.warning("no notification can be sent: %s", error)
                    pause = _STORE_PAUSE
                except Exception:  # noqa: BLE001 - one notification must not keep all others
                    _log.exception("a notification cannot be sent")
                    pause = _STORE_PAUSE
                self._stop.wait(pause)

    def _send_next(self, client: httpx2.Client) -> bool:
        """Make one attempt, if any is due; whether there was one."""
        due = self._store.outbox.take(lease_seconds=_LEASE_SECONDS)
        if due is None:
            return False
        refused = refused_url(due.url, self._hosts)
        error = refused or self._post(client, due)
        self._store.outbox.settle(due, error, final=refused is not None)
        if error is not None:
            _log.warning("job %s: notification %s: %s", due.job_id, due.id, error)
        return True

    def _post(self, client: httpx2.Client, due: Notification) -> str | None:
        """What went wrong, for people; None if it was taken."""
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
            # What a receiver answers is not read: there may be much of it.
            with client.stream("POST", due.url, content=body, headers=headers) as answer:
                status = answer.status_code
        except (httpx2.HTTPError, httpx2.InvalidURL) as error:
            return f"it could not be sent: {type(error).__name__}"
        return None if 200 <= status < 300 else f"the receiver answered {status}"
