"""Limits of connections: how many there are, and how long and large what they send may be.

The rest is uvicorn's own protocol; it has time-outs for connections between two requests only.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from ipaddress import ip_address, ip_network
from typing import Any, Final, cast

import h11
from fastapi import Response
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.server import ServerState

from gaitswarm.api.problems import headers_too_large, problem, too_many_requests
from gaitswarm.settings import Settings

_log = logging.getLogger("gaitswarm.api")

_LINGER_SECONDS: Final = 5.0
"""For a client to read why its connection ends."""


@dataclass(frozen=True, slots=True)
class ConnectionLimits:
    """What one server takes from all its clients.

    Attributes:
        connections: that may be open.
        of_client: the same for one address, but of a trusted proxy.
        header_bytes: size of a request's head [B].
        head_seconds: for a client to send a head, from its first byte or the connection on [s].
        body_seconds: for a client to send a body, from the end of the head on [s].
        idle_seconds: for which a connection stays open between two requests [s].
        trusted_proxies: addresses and networks whose word is taken for who asks and by which
            scheme.
    """

    connections: int = 512
    of_client: int = 256
    header_bytes: int = 32_768
    head_seconds: float = 10.0
    body_seconds: float = 60.0
    idle_seconds: int = 15
    trusted_proxies: tuple[str, ...] = ("127.0.0.1", "::1")

    @classmethod
    def of(cls, settings: Settings) -> ConnectionLimits:
        """Those of the settings."""
        return cls(
            connections=settings.api_max_connections,
            of_client=settings.api_max_client_connections,
            header_bytes=settings.api_max_header_bytes,
            head_seconds=settings.api_head_seconds,
            body_seconds=settings.api_body_seconds,
            idle_seconds=settings.api_idle_seconds,
            trusted_proxies=settings.api_trusted_proxies,
        )

    def trusts(self, host: str) -> bool:
        """Whether connections from an address are those of a trusted proxy."""
        try:
            address = ip_address(host)
        except ValueError:
            return False
        return any(address in ip_network(proxy) for proxy in self.trusted_proxies)


def limited_protocol(limits: ConnectionLimits) -> Callable[..., asyncio.Protocol]:
    """The protocol of one server's connections."""
    clients: Counter[str] = Counter()

    def make(
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> asyncio.Protocol:
        return LimitedProtocol(config, server_state, app_state, limits=limits, clients=clients)

    return make


class LimitedProtocol(H11Protocol):
    """A connection that is refused where there are too many, and ended where its client dawdles.

    | the client owes | for longer than | it gets |
    | --- | --- | --- |
    | the first head, or the rest of one | `head_seconds` | 408; the end, if nothing has come |
    | the rest of a body | `body_seconds` | 408; the end, if an answer has begun |
    | another request | `idle_seconds` | the end |

    What trickles in prolongs nothing.
    """

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        *,
        limits: ConnectionLimits,
        clients: Counter[str],
    ) -> None:
        """As uvicorn's own."""
        super().__init__(config, server_state, app_state)
        self._limits = limits
        self._clients = clients
        self._counted: str | None = None
        self._ended = False
        self._head_bytes = 0
        self._owes: str | None = None
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take on a connection, unless there are too many."""
        super().connection_made(transport)
        # asyncio does so only for sockets that say that they are of TCP, which ours do not. An
        # answer's body would wait for the client to acknowledge its head, which takes 40 ms.
        connection = transport.get_extra_info("socket")
        if connection is not None and connection.family in (socket.AF_INET, socket.AF_INET6):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        host = self.client[0] if self.client else ""
        if host and not self._limits.trusts(host):
            self._counted = host
            self._clients[host] += 1
        refusal = self._one_too_many()
        if refusal is None:
            self._expect()
            return
        # Not to be lingered over: those who are refused must not become more and more.
        self._refuse(refusal)
        self.transport.close()

    def _one_too_many(self) -> Response | None:
        if len(self.connections) > self._limits.connections:
            detail = "too many connections are open; try again later"
            return problem("/", "unavailable", detail, headers={"Retry-After": "5"})
        if self._counted is not None and self._clients[self._counted] > self._limits.of_client:
            detail = "too many connections are open from this address; close some"
            return too_many_requests("/", 5.0, detail)
        return None

    def data_received(self, data: bytes) -> None:
        """Go on with a request."""
        if self._ended or self.transport.is_closing():
            return
        if self.conn.their_state is h11.IDLE:
            self._head_bytes += len(data)
        super().data_received(data)
        self._expect()

    def on_response_complete(self) -> None:
        """Wait for the next request, or for what is left of the body."""
        super().on_response_complete()
        self._expect()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        if self._counted is not None:
            self._clients[self._counted] -= 1
            if not self._clients[self._counted]:
                del self._clients[self._counted]
            self._counted = None
        self._until(None, 0.0)
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002 - uvicorn's words
        """Answer what is no request, or has too large a head."""
        if self._head_bytes > self._limits.header_bytes:
            self._refuse(headers_too_large(self._limits.header_bytes))
        else:
            detail = "this is no request of HTTP/1.1"
            self._refuse(problem("/", "malformed-request", detail))

    @property
    def _request(self) -> RequestResponseCycle | None:
        """The request under way, or the last one; None before the first."""
        return cast(RequestResponseCycle | None, self.cycle)

    def _expect(self) -> None:
        """Begin to wait for what the client owes, unless it was awaited already."""
        state = self.conn.their_state
        idle = self.timeout_keep_alive_task is not None
        if self._ended or self.transport.is_closing() or (state is h11.IDLE and idle):
            self._until(None, 0.0)
        elif state is h11.IDLE:
            self._until("head", self._limits.head_seconds)
        elif state is h11.SEND_BODY:
            self._until("body", self._limits.body_seconds)
        else:
            self._until(None, 0.0)
        if state is not h11.IDLE:
            self._head_bytes = 0

    def _until(self, owes: str | None, seconds: float) -> None:
        if owes == self._owes:
            return
        if self._deadline is not None:
            self._deadline.cancel()
        self._owes = owes
        self._deadline = None if owes is None else self.loop.call_later(seconds, self._too_late)

    def _too_late(self) -> None:
        if self._owes == "head" and not self._head_bytes:
            # Browsers connect in advance, and would take an answer for that to their next request.
            self._end()
            return
        detail = f"the {self._owes} of the request took too long to come; send it at once"
        path = self.scope["path"] if self._owes == "body" else "/"
        self._refuse(problem(path, "too-slow", detail))

    def _refuse(self, answer: Response) -> None:
        """Answer, if it is not too late for an answer, and end the connection."""
        client, status = self.client[0] if self.client else "a client", answer.status_code
        _log.info("a connection of %s is ended with status %d", client, status)
        cycle = self._request
        mid_request = self._owes == "body" or (cycle is not None and not cycle.response_complete)
        if cycle is None or not cycle.response_started or not mid_request:
            head = [f"HTTP/1.1 {status} {HTTPStatus(status).phrase}", "connection: close"]
            head += [f"{name}: {value}" for name, value in answer.headers.items()]
            self.transport.write("\r\n".join([*head, "", ""]).encode() + bytes(answer.body))
        self._end()

    def _end(self) -> None:
        """End the connection once its client has read what was written, or has had time to.

        Closed at once, with something unread, it would be reset: the answer would be lost.
        """
        self._ended = True
        self._until(None, 0.0)
        if self._request is not None:
            self._request.disconnected = True
            self._request.message_event.set()
        self.flow.resume_reading()
        self.transport.write_eof()
        self.loop.call_later(_LINGER_SECONDS, self.transport.abort)
