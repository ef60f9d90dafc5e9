"""Outages: which errors are of the machine, how long to wait, what to say."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from gaitswarm.services.optimizer.errors import Unavailable
from gaitswarm.sim.errors import KernelBuildError

_OF_THE_MACHINE: Final = frozenset(
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
"""Numbers of system errors that end when somebody makes room, or a service is back."""

_SAID_BY_COMPILERS: Final = tuple(
    os.strerror(number)
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EAGAIN, errno.EMFILE)
)

_SAID_BY_LOADERS: Final = (
    "failed to map segment",
    *(os.strerror(number) for number in (errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)),
)
"""In the ImportError of a compiled module that the system could not load."""

_TAKEN_UP: Final = 5.0
"""Seconds after which an attempt counts as one that has reached what was away: those that do not
fail sooner."""


@dataclass(frozen=True, slots=True)
class Backoff:
    """Exponential backoff: `first` [s], doubled at each attempt up to `longest` [s].

    Attributes:
        first: The first delay [s].
        longest: No delay is longer [s].
        attempts: How often a failure is answered by another try before giving up. A job never
            gives up.
    """

    first: float = 1.0
    longest: float = 60.0
    attempts: int = 8

    def pause(self, failures: int) -> float:
        """How long to wait before the next attempt, however many there were.

        Args:
            failures: In a row, so far (>= 1).

        Returns:
            Seconds to wait.
        """
        # The exponent is bounded, so that a long row of attempts cannot overflow.
        return float(min(self.first * 2.0 ** min(failures - 1, 60), self.longest))

    def delay(self, failures: int) -> float | None:
        """How long to wait before the next attempt, if there is to be one.

        Args:
            failures: In a row, so far (>= 1).

        Returns:
            Seconds to wait; None: give up.
        """
        return None if failures > self.attempts else self.pause(failures)


def is_infrastructure(error: BaseException) -> bool:
    """Whether an error is of the machine, its memory, disks, processes or services.

    Such an error says nothing of the job: the same work may succeed later, so it is tried again.
    Any other is the job's own fault or a bug, and would come again.
    """
    return any(_is_of_the_machine(link) for link in _causes(error)) or (
        isinstance(error, KernelBuildError)
        and (
            any(isinstance(link, OSError) for link in _causes(error))
            or any(phrase in str(error) for phrase in _SAID_BY_COMPILERS)
        )
    )


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__


def _is_of_the_machine(error: BaseException) -> bool:
    if isinstance(error, OSError):
        return error.errno in _OF_THE_MACHINE
    if isinstance(error, ImportError):
        return any(phrase in str(error) for phrase in _SAID_BY_LOADERS)
    # What `Thread.start` raises where the system refuses another thread.
    no_thread = isinstance(error, RuntimeError) and "can't start new thread" in str(error)
    return no_thread or isinstance(error, (Unavailable, MemoryError))


class Outage:
    """What is known of something that may be away. Thread-safe.

    failed("refused")                  ->  True: news, to be logged
    attempted(); failed("refused")     ->  False
    ended()                            ->  seconds since the first failure
    ended()                            ->  None
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._reason: str | None = None
        self._since = 0.0
        self._failures = 0
        self._attempt_since: float | None = None

    @property
    def reason(self) -> str | None:
        """Why it is away; None if it is not, or an attempt seems to have reached it."""
        with self._lock:
            begun = self._attempt_since
            if begun is not None and self._clock() - begun > _TAKEN_UP:
                return None
            return self._reason

    @property
    def failures(self) -> int:
        """Attempts in a row that failed."""
        return self._failures

    def failed(self, reason: str) -> bool:
        """Note a failure."""
        with self._lock:
            is_news = self._reason is None
            if is_news:
                self._since = self._clock()
            self._reason, self._attempt_since = reason, None
            self._failures += 1
            return is_news

    def attempted(self) -> None:
        """Note that an attempt begins."""
        with self._lock:
            self._attempt_since = self._clock()

    def ended(self) -> float | None:
        """Note a success."""
        with self._lock:
            was_away = self._reason is not None
            self._reason, self._attempt_since, self._failures = None, None, 0
            return self._clock() - self._since if was_away else None
