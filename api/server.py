"""The HTTP server: one process, one event loop, around one application."""

from __future__ import annotations

import contextlib
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Final, cast

import uvicorn
from fastapi import FastAPI

from api.context import ApiContext

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


class ApiServer:
    """Listens from construction on, answers while `run` runs.

    url: where it listens, known at once even for port 0.
    Raises OSError if the address cannot be bound.
    """

    def __init__(self, app: FastAPI, *, host: str, port: int, log_level: str = "warning") -> None:
        context = cast(ApiContext, app.state.context)
        config = uvicorn.Config(
            app,
            log_level=log_level,
            timeout_graceful_shutdown=context.settings.api_shutdown_seconds,
            server_header=False,
        )
        self._server = _Server(config, context)
        self._socket = _listen(host, port)
        bound_host, bound_port = self._socket.getsockname()[:2]
        shown = f"[{bound_host}]" if ":" in bound_host else bound_host
        self.url = f"http://{shown}:{bound_port}"

    def run(self) -> None:
        """Serve until `stop`, or until SIGINT or SIGTERM where this is the main thread.

        Open requests end first, event streams at once. Returns normally, so that the caller can
        close what it opened.
        """
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()

    def stop(self) -> None:
        """Let `run` return soon. For any thread."""
        self._server.should_exit = True


def serve(
    app: FastAPI,
    *,
    host: str,
    port: int,
    announce: Callable[[str], None] | None = None,
    log_level: str = "warning",
) -> None:
    """Serve until a signal; announce: called with the URL before the first request is taken."""
    server = ApiServer(app, host=host, port=port, log_level=log_level)
    if announce is not None:
        announce(server.url)
    server.run()


class _Server(uvicorn.Server):
    def __init__(self, config: uvicorn.Config, context: ApiContext) -> None:
        super().__init__(config)
        self._context = context

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._context.stopping.set()
        await super().shutdown(sockets)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        # uvicorn raises the signal again afterwards, which would end the process before its
        # owner has closed the runner and the store.
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, self.handle_exit) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(512)
    except OSError:
        listener.close()
        raise
    return listener
