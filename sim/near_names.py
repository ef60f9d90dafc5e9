"""Suggestions for unknown names."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

_LONGEST_NAME: Final = 100
"""Longest name to compare; comparing takes time by its length."""

_ALIKE: Final = 0.7
"""Least share of characters that a suggestion has in common with a name."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    if len(name) > _LONGEST_NAME or name.isdigit():
        return None
    plain = {one.lower(): one for one in known}
    near = get_close_matches(name.lower(), plain, n=1, cutoff=_ALIKE)
    return plain[near[0]] if near else None


def instead_of(name: str, known: Iterable[str], listed: Iterable[str] | None = None) -> str:
    names = list(known)
    near = nearest(name, names)
    if near is not None:
        return f"did you mean {near!r}?"
    return f"known are {', '.join(names if listed is None else listed) or 'none'}"
