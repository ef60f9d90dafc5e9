"""Access to metrics, and the metrics server of a process without an API"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from socket import AF_INET6
from socketserver import ThreadingMixIn
from threading import Thread
from typing import TYPE_CHECKING, Any, Final
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

from gaitswarm.services.monitoring.hosts import HostNames
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.access import secret_digest
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, StoreUnavailable

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store.tokens import Tokens

_log = logging.getLogger(__name__)

_REMEMBERED_SECONDS: Final = 5.0
_MOST_REMEMBERED: Final = 64

REFUSAL: Final = (
    "metrics require a token: let Prometheus send one of scope `read` as `Authorization: Bearer"
    " TOKEN`; create one with `gaitswarm token create NAME --scope read`"
)


class MetricsAccess:
    """Authorization of requests for metrics. Thread-safe.

    While the database is unavailable, tokens that were valid at their last lookup remain valid, as
    metrics are most important then.
    """

    def __init__(
        self,
        tokens: Callable[[], Tokens],
        *,
        required: bool,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._tokens = tokens
        self._required = required
        self._clock = clock
        self._looked_up: dict[str, float] = {}

    def allows(self, authorization: str) -> bool:
        """Look up a request's token. Every scope may read."""
        scheme, _, secret = authorization.partition(" ")
        if scheme.lower() != "bearer":
            return not self._required
        digest, now = secret_digest(secret.strip()), self._clock()
        seen = self._looked_up.get(digest)
        if seen is not None and now - seen < _REMEMBERED_SECONDS:
            return True
        try:
            valid = self._tokens().find(secret.strip()) is not None
        except StoreUnavailable:
            if seen is None:
                raise
            return True
        self._looked_up.pop(digest, None)
        if valid:
            if len(self._looked_up) >= _MOST_REMEMBERED:
                self._looked_up.clear()
            self._looked_up[digest] = now
        return valid


@contextmanager
def metrics_server(
    metrics: Metrics,
    access: MetricsAccess,
    *,
    names: HostNames,
    trouble: Callable[[], str | None],
    host: str,
    port: int,
) -> Iterator[str]:
    """Serve metrics and a liveness probe on a separate port inside the block."""

    def answer(environ: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        def plain(status: HTTPStatus, text: str, *headers: tuple[str, str]) -> Iterable[bytes]:
            media_type = ("Content-Type", "text/plain; charset=utf-8")
            start(f"{status.value} {status.phrase}", [media_type, *headers])
            return [text.encode()]

        unknown = names.refusal(environ.get("HTTP_HOST"))
        if unknown is not None:
            return plain(HTTPStatus.MISDIRECTED_REQUEST, f"{unknown}\n")
        path = environ.get("PATH_INFO")
        if path not in ("/metrics", "/healthz") or environ["REQUEST_METHOD"] != "GET":
            return plain(HTTPStatus.NOT_FOUND, "available: GET /metrics and GET /healthz\n")
        if path == "/healthz":
            problem = trouble()
            if problem is None:
                return plain(HTTPStatus.OK, "ok\n")
            return plain(HTTPStatus.SERVICE_UNAVAILABLE, f"{problem}\n")
        try:
            allowed = access.allows(environ.get("HTTP_AUTHORIZATION", ""))
        except StoreUnavailable as error:
            _log.error("%s: %s", path, error)
            return plain(HTTPStatus.SERVICE_UNAVAILABLE, f"{error.for_clients}\n")
        if not allowed:
            return plain(HTTPStatus.UNAUTHORIZED, f"{REFUSAL}\n", ("WWW-Authenticate", "Bearer"))
        text, media_type = metrics.exposition(environ.get("HTTP_ACCEPT", ""))
        start("200 OK", [("Content-Type", media_type)])
        return [text]

    try:
        server = make_server(
            host, port, answer, _ServerOnIpv6 if ":" in host else _Server, handler_class=_Silent
        )
    except OSError as error:
        raise EvaluatorUnavailable(
            f"cannot serve metrics: {error.strerror}; choose another GAITSWARM_METRICS_PORT"
        ) from error
    thread = Thread(target=server.serve_forever, name="metrics", daemon=True)
    thread.start()
    try:
        name = f"[{host}]" if ":" in host else host
        yield f"http://{name}:{server.server_port}/metrics"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Server(ThreadingMixIn, WSGIServer):
    """Answers each request in its own thread, so that slow readers do not block others."""

    daemon_threads = True


class _ServerOnIpv6(_Server):
    address_family = AF_INET6


class _Silent(WSGIRequestHandler):
    """Does not log every scrape; disconnects slow clients."""

    timeout = 10.0

    def log_message(self, *_message: object) -> None:
        pass
