"""Masking of passwords in URLs"""

from __future__ import annotations

import re
from typing import Final
from urllib.parse import unquote_plus

HARMLESS: Final = frozenset(
    {
        *("user", "host", "hostaddr", "port", "dbname", "service", "application_name"),
        *("sslmode", "connect_timeout", "target_session_attrs"),
    }
)
"""Query parameters of a database URL that are shown; others may contain a secret or its path."""

_HIDDEN: Final = "***"

_HOST: Final = r"(?:\[[\w.:%]+\]|[\w.%-]*)(?::\d+)?"

_ADDRESS: Final = re.compile(rf"{_HOST}(?:,{_HOST})*(?:/[^:@]*)?")


def masked_url(url: str) -> str:
    scheme, separator, rest = url.partition("://")
    if not separator or scheme.startswith("sqlite"):
        return url
    head, _, query = rest.partition("?")
    user_info, at, address = head.rpartition("@")
    # An @ after the ? may belong to a password that contains a ?.
    if "@" in query or not _ADDRESS.fullmatch(address):
        return f"{scheme}://{_HIDDEN}"
    user, colon, _ = user_info.partition(":")
    if at and scheme in ("http", "https"):
        user = _HIDDEN  # A token may be given as the user.
    hidden = f":{_HIDDEN}" if colon else ""
    shown = [part for part in query.split("&") if _name(part) in HARMLESS]
    if query and len(shown) < query.count("&") + 1:
        shown.append(_HIDDEN)
    return f"{scheme}://{user}{hidden}{at}{address}{'?' if query else ''}{'&'.join(shown)}"


def _name(parameter: str) -> str:
    name, equals, _ = parameter.partition("=")
    return unquote_plus(name) if equals else ""
