"""The names that a server goes by. A browser is not answered that calls it by another one.

A page of another site can have its name resolve to this server's address (DNS rebinding), and is
then of the same origin to a browser; but it cannot help naming itself in the header Host. An
address is nobody's name, and programs that send no Host are no browsers.
"""

from __future__ import annotations

import socket
from collections.abc import Iterable
from ipaddress import ip_address


class HostNames:
    """Names of one server, beside its addresses."""

    def __init__(self, host: str, allowed: Iterable[str]) -> None:
        own = ("localhost", host, socket.gethostname())
        self._names = frozenset(name.lower() for name in (*own, *allowed))

    def refusal(self, host: str | None) -> str | None:
        """Why a request is not answered."""
        if host is None or self._knows(host.lower()):
            return None
        return (
            f"this server does not go by the name {host!r}; if it should, add the name to"
            " GAITSWARM_API_ALLOWED_HOSTS where it is started"
        )

    def _knows(self, host: str) -> bool:
        name = _name(host)
        return not self._names.isdisjoint((host, name)) or _is_address(name)


def _name(host: str) -> str:
    """Of `name:port`, `[address]:port`, or one of both without port."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
