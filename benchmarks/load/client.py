"""A client that takes little time itself: requests are made up beforehand, answers only counted."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final
from urllib.parse import urlsplit

_MOST_CONNECTIONS: Final = 48
"""Beside the streams; one address may have 256 in all."""

_PATIENCE: Final = 60.0
"""For answers that are due when the last request has been sent [s]."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a request.

    Attributes:
        kind: Of the request.
        seconds: From the time at which it was due until all of the answer was there [s].
        status: Of HTTP; 0 if the connection broke.
        length: Of the body [B].
    """

    kind: str
    seconds: float
    status: int
    length: int


@dataclass(frozen=True, slots=True)
class Target:
    """A server's address, and requests for it."""

    host: str
    port: int

    @classmethod
    def of(cls, url: str) -> Target:
        """The server at a URL."""
        parts = urlsplit(url)
        return cls(str(parts.hostname), int(parts.port or 80))

    def request(self, path: str, accept: str = "application/json") -> bytes:
        """A GET as a browser sends it, as far as the server looks at it."""
        return (
            f"GET {path} HTTP/1.1\r\nHost: {self.host}:{self.port}\r\nAccept: {accept}\r\n"
            "Accept-Encoding: gzip\r\n\r\n"
        ).encode()


async def ask_at_rate(
    target: Target, requests: Sequence[tuple[str, bytes]], *, per_second: float, seconds: float
) -> list[Answer]:
    """Send requests when they are due, whether others have been answered or not.

    Args:
        target: Whom to ask.
        requests: Kind and text of each, in turn; from the beginning again after the last.
        per_second: How many are due a second [1/s].
        seconds: For how long [s].

    Returns:
        The answers.
    """
    idle: list[Connection] = []
    answers: list[Answer] = []
    free = asyncio.Semaphore(_MOST_CONNECTIONS)
    begun = time.perf_counter()

    async def ask(kind: str, text: bytes, due: float) -> None:
        async with free:
            status, length = 0, 0
            while status == 0:
                kept = bool(idle)
                connection = idle.pop() if kept else Connection(target)
                with suppress(OSError, EOFError):
                    status, length = await connection.ask(text)
                    idle.append(connection)
                # As browsers do: the server ends a connection that was idle for long.
                if not kept:
                    break
            answers.append(Answer(kind, time.perf_counter() - due, status, length))

    async with asyncio.timeout(seconds + _PATIENCE), asyncio.TaskGroup() as group:
        for number in range(round(per_second * seconds)):
            due = begun + number / per_second
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            kind, text = requests[number % len(requests)]
            group.create_task(ask(kind, text, due))
    for connection in idle:
        connection.close()
    return answers


class Connection:
    """One that is kept alive."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def ask(self, text: bytes) -> tuple[int, int]:
        """Status and length of the answer. Raises OSError or EOFError if the connection ends."""
        if self._streams is None:
            self._streams = await asyncio.open_connection(self._target.host, self._target.port)
        reader, writer = self._streams
        writer.write(text)
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        _, _, rest = head.partition(b"\r\ncontent-length:")
        length = int(rest.partition(b"\r\n")[0])
        await reader.readexactly(length)
        return int(head.split(b" ", 2)[1]), length

    def close(self) -> None:
        if self._streams is not None:
            self._streams[1].close()


@dataclass
class Streams:
    """Event streams that are open.

    Attributes:
        iterations: Events of committed iterations that came, of all streams.
        ended: Streams that the server has ended.
    """

    iterations: int = 0
    ended: int = 0
    _transports: list[asyncio.Transport] = field(default_factory=list)

    async def open(self, target: Target, paths: Sequence[str]) -> None:
        """Open a stream for each path, and wait until all have begun.

        Args:
            target: Whom to ask.
            paths: Of the streams.
        """
        loop, streams = asyncio.get_running_loop(), list[_Stream]()
        for path in paths:
            transport, stream = await loop.create_connection(
                lambda: _Stream(self), target.host, target.port
            )
            self._transports.append(transport)
            streams.append(stream)
            transport.write(target.request(path, "text/event-stream"))
        async with asyncio.timeout(_PATIENCE):
            await asyncio.gather(*(stream.begun.wait() for stream in streams))

    def close(self) -> None:
        """Close them all."""
        for transport in self._transports:
            transport.abort()
        self._transports.clear()


class _Stream(asyncio.Protocol):
    def __init__(self, streams: Streams) -> None:
        self._streams = streams
        self.begun = asyncio.Event()

    def data_received(self, data: bytes) -> None:
        # An event is written at once, and its name is at its beginning.
        self._streams.iterations += data.count(b"event: iteration")
        self.begun.set()

    def eof_received(self) -> None:
        self._streams.ended += 1
