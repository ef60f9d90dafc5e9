"""HTTP servers: the API with draining at shutdown, and the metrics of a process without it."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

import uvicorn
from fastapi import FastAPI
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from gaitswarm.api.access import METRICS_PATH, AccessMiddleware, TokenGuesses
from gaitswarm.api.app import metrics_route
from gaitswarm.api.middleware import OriginMiddleware
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.settings import Settings

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store.tokens import Tokens

_BACKLOG = 512

Drain = Callable[[threading.Event], None]
"""Called in a thread before the server stops; must return at once when its event is set."""


class ApiServer:
    """Server that listens from construction on, also at port 0, and answers while `run` runs."""

    def __init__(
        self,
        app: FastAPI,
        settings: Settings,
        *,
        drain: Drain = lambda _: None,
        log_level: str = "warning",
    ) -> None:
        config = uvicorn.Config(
            app,
            lifespan="on",
            # Log records go to the handlers of the process, in its format.
            log_config=None,
            log_level=log_level,
            timeout_graceful_shutdown=settings.api_shutdown_seconds,
            timeout_keep_alive=settings.api_idle_seconds,
            limit_concurrency=settings.api_max_connections,
            server_header=False,
            http="h11",
            ws="none",
            forwarded_allow_ips=list(settings.api_trusted_proxies),
        )
        self._server = _Server(config, drain)
        self._socket, self.url = _listen(settings.api_host, settings.api_port)

    def run(self) -> None:
        """Serve until `stop`, or until SIGINT or SIGTERM in the main thread."""
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()

    def stop(self) -> None:
        """Make `run` return soon. Thread-safe."""
        self._server.should_exit = True


def _listen(host: str, port: int) -> tuple[socket.socket, str]:
    ipv6 = ":" in host
    listening = socket.create_server(
        (host, port),
        family=socket.AF_INET6 if ipv6 else socket.AF_INET,
        backlog=_BACKLOG,
        dualstack_ipv6=ipv6 and socket.has_dualstack_ipv6(),
    )
    # Inherited by accepted connections; without it a body waits 40 ms for the client's ACK.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    bound_host, bound_port = listening.getsockname()[:2]
    return listening, f"http://{f'[{bound_host}]' if ipv6 else bound_host}:{bound_port}"


class _Server(uvicorn.Server):
    """uvicorn with a drain phase before its shutdown."""

    def __init__(self, config: uvicorn.Config, drain: Drain) -> None:
        super().__init__(config)
        self._drain = drain
        self._at_once = threading.Event()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self.lifespan.state["draining"].set()
        drained = asyncio.create_task(asyncio.to_thread(self._drain, self._at_once))
        while not (await asyncio.wait([drained], timeout=1.0))[0]:
            # Keeps the Date header current.
            await self.on_tick(0)
        await drained
        # The lifespan ends after the last response; event streams must end before.
        self.lifespan.state["stopping"].set()
        await super().shutdown(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002 - uvicorn's
        # uvicorn would raise the signal again after shutdown, and end the process before its owner
        # has closed the runner and the store.
        if self.should_exit:
            self.force_exit = True
            self._at_once.set()
        self.should_exit = True


@contextmanager
def metrics_server(
    metrics: Metrics,
    tokens: Callable[[], Tokens],
    settings: Settings,
    trouble: Callable[[], str | None],
) -> Iterator[str]:
    """Serve metrics and a liveness probe of a process without an API, inside the block."""

    def healthz(_request: Request) -> Response:
        problem = trouble()
        return PlainTextResponse(f"{problem or 'ok'}\n", 503 if problem else 200)

    host = settings.metrics_host
    app = Starlette(routes=[metrics_route(metrics), Route("/healthz", healthz)])
    app.add_middleware(
        AccessMiddleware,
        tokens=tokens,
        guesses=TokenGuesses(),
        required=settings.metrics_need_token,
    )
    app.add_middleware(OriginMiddleware, host=host, allowed=settings.api_allowed_hosts)
    try:
        listening, url = _listen(host, settings.metrics_port or 0)
    except OSError as error:
        raise EvaluatorUnavailable(
            f"cannot serve metrics: {error.strerror}; choose another GAITSWARM_METRICS_PORT"
        ) from error
    config = uvicorn.Config(app, lifespan="off", log_config=None, log_level="warning", ws="none")
    server = uvicorn.Server(config)
    with listening:
        thread = threading.Thread(target=server.run, args=([listening],), name="metrics")
        thread.start()
        try:
            yield url + METRICS_PATH
        finally:
            server.should_exit = True
            thread.join()
