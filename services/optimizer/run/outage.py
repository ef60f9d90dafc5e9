"""Outages: classification of errors, and backoff"""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from gaitswarm.services.optimizer.errors import Unavailable
from gaitswarm.sim.errors import KernelBuildError

_TRANSIENT_ERRNOS: Final = frozenset(
    {
        # Space and files.
        *(errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ESTALE),
        *(errno.EMFILE, errno.ENFILE, errno.EBUSY, errno.EACCES, errno.EPERM),
        # Processes and memory.
        *(errno.EAGAIN, errno.ENOMEM),
        # The network.
        *(errno.ECONNREFUSED, errno.ECONNRESET, errno.EPIPE, errno.ETIMEDOUT),
        *(errno.EHOSTUNREACH, errno.ENETUNREACH),
    }
)
"""System errors that end when resources or a service become available again."""

_COMPILER_MESSAGES: Final = tuple(
    os.strerror(number)
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EAGAIN, errno.EMFILE)
)

_LOADER_MESSAGES: Final = (
    "failed to map segment",
    *(os.strerror(number) for number in (errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)),
)
"""Texts of the ImportError of a compiled module that the system could not load."""

_CONNECTED_SECONDS: Final = 5.0
"""Duration after which an attempt counts as connected [s]; failures are faster."""


class Backoff(NamedTuple):
    """Exponential backoff: `first` [s], doubled at each attempt up to `longest` [s].

    Attributes:
        first: first pause [s].
        longest: upper bound on pauses [s].
        attempts: number of retries of `delay`. Jobs retry indefinitely.
    """

    first: float = 1.0
    longest: float = 60.0
    attempts: int = 8

    def pause(self, failures: int) -> float:
        """Return the pause before the next attempt [s].

        Args:
            failures: In a row, so far (>= 1).
        """
        # The exponent is bounded, so that many attempts cannot overflow.
        return float(min(self.first * 2.0 ** min(failures - 1, 60), self.longest))

    def delay(self, failures: int) -> float | None:
        """Return the pause before the next attempt [s]; None to give up.

        Args:
            failures: In a row, so far (>= 1).
        """
        return None if failures > self.attempts else self.pause(failures)


def is_infrastructure(error: BaseException) -> bool:
    """Return whether an error is caused by the machine or its services, so that work is retried."""
    return any(_is_transient(link) for link in _causes(error)) or (
        isinstance(error, KernelBuildError)
        and (
            any(isinstance(link, OSError) for link in _causes(error))
            or any(phrase in str(error) for phrase in _COMPILER_MESSAGES)
        )
    )


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__


def _is_transient(error: BaseException) -> bool:
    if isinstance(error, OSError):
        return error.errno in _TRANSIENT_ERRNOS
    if isinstance(error, ImportError):
        return any(phrase in str(error) for phrase in _LOADER_MESSAGES)
    # Raised by `Thread.start` if the system refuses another thread.
    no_thread = isinstance(error, RuntimeError) and "can't start new thread" in str(error)
    return no_thread or isinstance(error, (Unavailable, MemoryError))


class Outage:
    """Availability of a service, from the first failure to `ended`. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._reason: str | None = None
        self._since = 0.0
        self.failures = 0  # consecutive
        self._attempt_since: float | None = None

    @property
    def reason(self) -> str | None:
        """Why it is unavailable; None if it is not, or if an attempt seems to have connected."""
        with self._lock:
            begun = self._attempt_since
            if begun is not None and self._clock() - begun > _CONNECTED_SECONDS:
                return None
            return self._reason

    def failed(self, reason: str) -> bool:
        """Record a failure; return whether it is the first."""
        with self._lock:
            is_news = self._reason is None
            if is_news:
                self._since = self._clock()
            self._reason, self._attempt_since = reason, None
            self.failures += 1
            return is_news

    def attempted(self) -> None:
        with self._lock:
            self._attempt_since = self._clock()

    def ended(self) -> float | None:
        """Record a success; return the duration of the outage [s], if there was one."""
        with self._lock:
            was_away = self._reason is not None
            self._reason, self._attempt_since, self.failures = None, None, 0
            return self._clock() - self._since if was_away else None
