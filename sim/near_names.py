"""Names that are none: which one may have been meant, or which there are."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Final

_LONGEST_NAME: Final = 100
"""That is compared with the known ones; comparing takes time by its length."""

_ALIKE: Final = 0.7
"""Share of their characters that a name and the one that may be meant have in common, at least."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The name that may have been meant."""
    if len(name) > _LONGEST_NAME or name.isdigit():
        return None
    plain = {one.lower(): one for one in known}
    near = get_close_matches(name.lower(), plain, n=1, cutoff=_ALIKE)
    return plain[near[0]] if near else None


def instead_of(name: str, known: Iterable[str], listed: Iterable[str] | None = None) -> str:
    """What to write in place of a name that is none."""
    names = list(known)
    near = nearest(name, names)
    if near is not None:
        return f"did you mean {near!r}?"
    return f"known are {', '.join(names if listed is None else listed) or 'none'}"
