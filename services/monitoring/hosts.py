"""Host names of a server. Requests from browsers under other names are rejected

A page of another site can make its name resolve to this server's address (DNS rebinding), and then
has the same origin for a browser; but the browser sends that name in the Host header. Addresses
cannot be rebound, and programs that send no Host are no browsers.
"""

from __future__ import annotations

import socket
from collections.abc import Iterable
from ipaddress import ip_address


class HostNames:
    """Names of a server, besides its addresses."""

    def __init__(self, host: str, allowed: Iterable[str]) -> None:
        default = ("localhost", host, socket.gethostname())
        self._names = frozenset(name.lower() for name in (*default, *allowed))

    def refusal(self, host: str | None) -> str | None:
        """Return why a request is rejected; None if it is not."""
        if host is None or self._knows(host.lower()):
            return None
        return (
            f"unknown host name {host!r}; to allow it, add it to the server's"
            " GAITSWARM_API_ALLOWED_HOSTS"
        )

    def _knows(self, host: str) -> bool:
        name = _name(host)
        return not self._names.isdisjoint((host, name)) or _is_address(name)


def _name(host: str) -> str:
    """Host part of `name:port`, `[address]:port`, or of either without a port."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
