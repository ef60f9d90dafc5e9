"""How often somebody may ask, and how many event streams they may have open."""

from __future__ import annotations

import time
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ipaddress import IPv6Address, ip_address
from typing import Final

from starlette.types import Scope

from gaitswarm.services.optimizer.errors import TooManyRequests
from gaitswarm.settings import is_loopback

_MOST_REMEMBERED: Final = 4096
"""Askers; of more, whoever asked longest ago begins anew."""

_IPV6_PREFIX: Final = 64
"""Bits of an IPv6 address that tell subscribers apart; each has all addresses of such a network."""


class RequestRate:
    """How often each asker may ask: so many requests at once, and then so many a second.

    For `burst` 3 and a rate of 1 a second:

    | at [s] | `seconds_to_wait` |
    | --- | --- |
    | 0, 0, 0 | 0, 0, 0 |
    | 0 | 1 |
    | 1 | 0 |
    | 1 | 1 |

    Of one event loop.
    """

    def __init__(
        self, per_second: float, burst: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin with nobody remembered."""
        self._interval = 1.0 / per_second
        self._ahead = burst * self._interval
        self._clock = clock
        # When each asker's requests so far would have ended, had they come at the rate.
        self._paid: OrderedDict[str, float] = OrderedDict()

    @property
    def remembered(self) -> int:
        """Askers of whom something is known."""
        return len(self._paid)

    def seconds_to_wait(self, asker: str) -> float:
        """Count a request, unless it is one too many."""
        now = self._clock()
        paid = max(now, self._paid.pop(asker, now)) + self._interval
        # Rounding must not take the last request of a burst away.
        early = paid - now - self._ahead
        if early > 1e-9 * self._ahead:
            self._paid[asker] = paid - self._interval
            return early
        self._paid[asker] = paid
        if len(self._paid) > _MOST_REMEMBERED:
            self._paid.popitem(last=False)
        return 0.0


class OpenStreams:
    """Event streams that are open, by asker. Of one event loop."""

    def __init__(self, most: int) -> None:
        """Begin with none."""
        self._most = most
        self._open: Counter[str] = Counter()

    @contextmanager
    def one_of(self, asker: str) -> Iterator[None]:
        """Count a stream while the block runs."""
        if self._open[asker] >= self._most:
            raise TooManyRequests(
                f"{self._open[asker]} event streams are open already, which is as many as may be;"
                " close one, or ask now and then for the job itself",
                retry_after=5.0,
            )
        self._open[asker] += 1
        try:
            yield
        finally:
            self._open[asker] -= 1
            if not self._open[asker]:
                del self._open[asker]


def address_of(scope: Scope) -> str:
    """The address that a request comes from, as far as it tells subscribers apart."""
    client = scope.get("client")
    host = str(client[0]) if client else ""
    try:
        address = ip_address(host)
    except ValueError:
        return host
    if not isinstance(address, IPv6Address) or address.is_loopback:
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    host_bits = address.max_prefixlen - _IPV6_PREFIX
    return f"{IPv6Address(int(address) >> host_bits << host_bits)}/{_IPV6_PREFIX}"


def is_local(address: str) -> bool:
    """Whether a request comes from this machine."""
    return not address or is_loopback(address)
