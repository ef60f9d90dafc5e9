"""Instances of tests that are left to `make test-all`."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase


def left_out(ids: Iterable[str], *shown: str, without: str | Iterable[str] = ()) -> list[str]:
    """What the mark `variants` leaves out of `make test`, of the instances of one test.

    Args:
        ids: those of all instances, in their order.
        shown: patterns, as of file names, of those that `make test` runs; where there are none
            and nothing is `without`, it runs the first.
        without: patterns of those that it leaves out, all others being run.

    Returns:
        the ids that are left out, never all and never none.

    Raises:
        ValueError: if a pattern fits no instance, or all are left out, or none is.
    """
    ids = list(ids)
    unwanted = [without] if isinstance(without, str) else list(without)
    if bool(shown) and bool(unwanted):
        raise ValueError("variants takes names to be run, or those to be left out, not both")
    for pattern in (*shown, *unwanted):
        if not any(_is_one_of(each, [pattern]) for each in ids):
            raise ValueError(f"variants names {pattern!r}, but the instances are {ids}")
    if unwanted:
        more = [each for each in ids if _is_one_of(each, unwanted)]
    else:
        more = [each for each in ids if not _is_one_of(each, shown or ids[:1])]
    if not 0 < len(more) < len(ids):
        raise ValueError(f"variants leaves out {len(more)} of {len(ids)} instances: {ids}")
    return more


def _is_one_of(name: str, patterns: Iterable[str]) -> bool:
    # Brackets are those of values, and no set of characters.
    return any(fnmatchcase(name, pattern.replace("[", "[[]")) for pattern in patterns)
