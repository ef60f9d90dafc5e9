"""Webhooks: POST notifications about ended jobs until they are accepted

Headers and signature follow Standard Webhooks (https://www.standardwebhooks.com).
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
from typing import TYPE_CHECKING, Final

import httpx2

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.notification import Notification, refused_url

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_TIMEOUT: Final = 10.0
"""Of a receiver [s]."""

_LEASE_SECONDS: Final = 60.0
"""Longer than any attempt, unless its process died."""

_POLL_SECONDS: Final = 1.0

_STORE_PAUSE: Final = 10.0
"""Pause after a failure of the store [s]."""

_log = logging.getLogger(__name__)


def signature(secret: str, message_id: str, timestamp: int, body: bytes) -> str:
    """Return the signature of a notification."""
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
    """Sends due notifications from its own thread, from start() to stop().

    Several processes may run one: each notification is leased by one at a time. Delivery is at
    least once; receivers detect repetitions by `webhook-id`.
    """

    def __init__(self, store: Store, hosts: Collection[str], secret: str | None) -> None:
        self._store = store
        self._hosts = hosts
        self._secret = secret
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifier", daemon=True)

    def start(self) -> None:
        """Start sending. Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """End after the current attempt. Idempotent."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        # Ignore proxies and credentials in the environment.
        with httpx2.Client(timeout=_TIMEOUT, follow_redirects=False, trust_env=False) as client:
            while not self._stop.is_set():
                try:
                    pause = 0.0 if self._send_next(client) else _POLL_SECONDS
                except StoreUnavailable as error:
                    _log.warning("cannot send notifications: %s", error)
                    pause = _STORE_PAUSE
                except Exception:  # noqa: BLE001 - one notification must not block the others
                    _log.exception("cannot send a notification")
                    pause = _STORE_PAUSE
                self._stop.wait(pause)

    def _send_next(self, client: httpx2.Client) -> bool:
        """Make one attempt, if any is due; return whether there was one."""
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
            with client.stream("POST", due.url, content=body, headers=headers) as answer:
                status = answer.status_code
        except (httpx2.HTTPError, httpx2.InvalidURL) as error:
            return f"sending failed: {type(error).__name__}"
        return None if 200 <= status < 300 else f"the receiver answered {status}"
