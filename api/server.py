"""The HTTP server: one process, one event loop, around one application."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable
from types import FrameType

import uvicorn
from fastapi import FastAPI

from gaitswarm.api.connections import ConnectionLimits, limited_protocol

_BACKLOG = 512
_USUAL = ConnectionLimits()

Drain = Callable[[threading.Event], None]
"""Called in a thread before the server stops; its event is set when it is to return at once."""


class ApiServer:
    """Listens from construction on, answers while `run` runs.

    url: where it listens, known at once even for port 0.
    """

    def __init__(
        self,
        app: FastAPI,
        *,
        host: str,
        port: int,
        shutdown_seconds: int = 5,
        drain: Drain = lambda _: None,
        limits: ConnectionLimits = _USUAL,
        log_level: str = "warning",
    ) -> None:
        """Begin to listen."""
        config = uvicorn.Config(
            app,
            lifespan="on",
            # Its messages go where those of the process go, in the same format.
            log_config=None,
            log_level=log_level,
            timeout_graceful_shutdown=shutdown_seconds,
            server_header=False,
            http=limited_protocol(limits),  # type: ignore[arg-type] # as uvicorn calls it
            ws="none",
            h11_max_incomplete_event_size=limits.header_bytes,
            timeout_keep_alive=limits.idle_seconds,
            forwarded_allow_ips=list(limits.trusted_proxies),
        )
        self._server = _Server(config, drain)
        ipv6 = ":" in host
        self._socket = socket.create_server(
            (host, port),
            family=socket.AF_INET6 if ipv6 else socket.AF_INET,
            backlog=_BACKLOG,
            dualstack_ipv6=ipv6 and socket.has_dualstack_ipv6(),
        )
        bound_host, bound_port = self._socket.getsockname()[:2]
        self.url = f"http://{f'[{bound_host}]' if ipv6 else bound_host}:{bound_port}"

    def run(self) -> None:
        """Serve until `stop`, or until SIGINT or SIGTERM where this is the main thread.

        First all is drained, while requests are answered. Then connections are no longer accepted,
        open requests end, event streams at once. A second signal ends all of that. Returns
        normally, so that the caller can close what it opened.
        """
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()

    def stop(self) -> None:
        """Let `run` return soon. For any thread."""
        self._server.should_exit = True


class _Server(uvicorn.Server):
    """uvicorn, which by itself knows nothing of drains and of streams that do not end."""

    def __init__(self, config: uvicorn.Config, drain: Drain) -> None:
        super().__init__(config)
        self._drain = drain
        self._at_once = threading.Event()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self.lifespan.state["draining"].set()
        drained = asyncio.create_task(asyncio.to_thread(self._drain, self._at_once))
        while not (await asyncio.wait([drained], timeout=1.0))[0]:
            # The `Date` of answers goes on meanwhile.
            await self.on_tick(0)
        await drained
        # The lifespan ends after the last answer; streams must hear of it before.
        self.lifespan.state["stopping"].set()
        await super().shutdown(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002 - uvicorn's
        # uvicorn's own keeps the signal, to raise it again when all is done: that would end the
        # process before its owner has closed the runner and the store.
        if self.should_exit:
            self.force_exit = True
            self._at_once.set()
        self.should_exit = True
