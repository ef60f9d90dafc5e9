"""To which servers a token is sent: those it was meant for, where nobody reads it on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final
from urllib.parse import SplitResult, urlsplit

from gaitswarm.errors import InvalidRequest
from gaitswarm.jobs.server.attempts import server_url
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.settings import Settings, is_loopback

_PORTS: Final = {"http": 80, "https": 443}


def with_token(
    url: str, headers: Mapping[str, str] | None, token: str | None, settings: Settings
) -> dict[str, str]:
    """Headers with a token, unless they have an Authorization of their own.

    The environment's token belongs to the environment's server, if it names one, and is sent to no
    other. No token goes over plain HTTP beyond this machine, unless the settings say so.

    Args:
        url: of the server.
        headers: of whoever asks.
        token: for this server; None for that of the settings.
        settings: with the environment's token and server.

    Returns:
        The headers that are sent.

    Raises:
        InvalidRequest: it is not a URL, or anybody on the way could read the token; says what to
            do.
    """
    asked, sent = urlsplit(server_url(url)), dict(headers or {})
    if any(name.lower() == "authorization" for name in sent):
        return sent
    secret = token
    own = settings.server
    if secret is None and (own is None or _origin(asked) == _origin(urlsplit(server_url(own)))):
        secret = settings.token
    if not secret:
        return sent
    guarded = asked.scheme == "https" or is_loopback(asked.hostname or "")
    if not guarded and not settings.token_over_http:
        raise InvalidRequest(
            f"a token would go to {masked_url(url)} as plain text, which anybody on the way can"
            " read; use an https:// URL (docs/security.md has a proxy for it) or a tunnel, or set"
            " GAITSWARM_TOKEN_OVER_HTTP=true where the network is trusted",
            field="server",
        )
    sent["Authorization"] = f"Bearer {secret}"
    return sent


def _origin(url: SplitResult) -> tuple[str, str | None, int | None]:
    return url.scheme, url.hostname, url.port or _PORTS.get(url.scheme)
