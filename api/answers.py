"""Answers in JSON that are encoded and compressed once for all who ask the same.

Everybody who may ask at all is answered the same: who may is checked before, for every request.
"""

from __future__ import annotations

import threading
import zlib
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable
from hashlib import blake2b
from typing import Final

from fastapi import Request, Response
from pydantic_core import to_json

from gaitswarm.services.optimizer.jobs.job import Job, JobState

LEAST_COMPRESSED: Final = 1024
"""Bytes of the shortest answer that is compressed."""

_LEVEL: Final = 1
"""Of compression: the usual 6 takes three times as long, and saves a tenth of the answer."""

_LARGEST: Final = 32 << 20
"""Bytes of all answers and parts of answers that are remembered."""

_PAGES: Final = 1000
"""Pages of which is noted when they were read."""

_ENTRY: Final = 500
"""Bytes that each takes beside its own."""


class Encoded:
    """JSON as it is sent. Thread-safe.

    Attributes:
        plain: The text, in UTF-8.
        key: By which an answer is found whose text is all that is known of it; else None.
    """

    __slots__ = ("_compressed", "_job", "key", "plain")

    def __init__(self, plain: bytes, job: Job | None = None, key: Hashable | None = None) -> None:
        """Take on a text."""
        self.plain = plain
        self.key = key
        self._job = job
        self._compressed: bytes | None = None

    @property
    def compressed(self) -> bytes:
        """The same by gzip."""
        if self._compressed is None:
            compressor = zlib.compressobj(_LEVEL, zlib.DEFLATED, 16 + zlib.MAX_WBITS)
            self._compressed = compressor.compress(self.plain) + compressor.flush()
        return self._compressed

    def answer(self, request: Request) -> Response:
        """Answer with it."""
        if len(self.plain) < LEAST_COMPRESSED or not _accepts_gzip(request):
            return Response(self.plain, media_type="application/json")
        headers = {"Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
        return Response(self.compressed, media_type="application/json", headers=headers)


def _accepts_gzip(request: Request) -> bool:
    """As for the answers of all other routes."""
    return "gzip" in request.headers.get("accept-encoding", "")


class Answers:
    """Answers, and parts of them; of too many, those asked for longest ago go. Thread-safe."""

    def __init__(self, largest: int = _LARGEST) -> None:
        self._largest = largest
        self._size = 0
        self._known: OrderedDict[Hashable, Encoded] = OrderedDict()
        self._pages: OrderedDict[Hashable, tuple[Hashable, Hashable]] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def size(self) -> int:
        """Bytes of all that is remembered."""
        return self._size

    def of_job(self, what: str, job: Job, make: Callable[[], bytes]) -> Encoded:
        """Encode what follows from a job alone.

        The store gives the same object for a job of which nothing has changed. What is told of a
        job that runs depends on the time as well, and is not remembered.
        """
        if job.state is JobState.RUNNING:
            return Encoded(make())
        found = self.find_of_job(what, job)
        return found or self._add((what, id(job)), Encoded(make(), job))

    def find_of_job(self, what: str, job: Job) -> Encoded | None:
        """Look for what follows from a job alone."""
        return None if job.state is JobState.RUNNING else self._find((what, id(job)))

    def of_history(self, key: Hashable, make: Callable[[], bytes]) -> Encoded:
        """Encode what never changes: whole iterations that are committed."""
        return self._find(key) or self._add(key, Encoded(make()))

    def find_of_history(self, key: Hashable) -> Encoded | None:
        """Look for what never changes."""
        return self._find(key)

    def note_page(self, key: Hashable, version: Hashable, page: Encoded) -> None:
        """Note what is answered as long as nothing is committed."""
        with self._lock:
            self._pages[key] = (version, page.key)
            self._pages.move_to_end(key)
            if len(self._pages) > _PAGES:
                self._pages.popitem(last=False)

    def find_page(self, key: Hashable, version: Hashable) -> Encoded | None:
        """Look for what was noted."""
        noted = self._pages.get(key)
        return None if noted is None or noted[0] != version else self._find(noted[1])

    def same(self, plain: bytes) -> Encoded:
        """Find an answer by its text, so that it is compressed once."""
        key = blake2b(plain, digest_size=16).digest()
        return self._find(key) or self._add(key, Encoded(plain, key=key))

    def _find(self, key: Hashable) -> Encoded | None:
        with self._lock:
            found = self._known.get(key)
            if found is not None:
                self._known.move_to_end(key)
            return found

    def _add(self, key: Hashable, encoded: Encoded) -> Encoded:
        with self._lock:
            first = self._known.setdefault(key, encoded)
            if first is encoded:
                self._size += len(encoded.plain) + _ENTRY
            while self._size > self._largest:
                _, oldest = self._known.popitem(last=False)
                self._size -= len(oldest.plain) + _ENTRY
            return first


def page_of(items: Iterable[bytes], following: str | None) -> bytes:
    """Put a page together."""
    return b'{"items":[' + b",".join(items) + b'],"next":' + to_json(following) + b"}"
