"""Which faults come when: drawn from a seed, and nothing else. Pure."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Planned:
    """A fault to come.

    Attributes:
        kind: Its name.
        pause: Since the one before was recovered from [s].
        draw: From [0, 1): chooses among a kind's victims.
        length: From [0, 1): how long it lasts, within what its kind allows.
    """

    kind: str
    pause: float
    draw: float
    length: float


def plan(seed: int, count: int, kinds: Sequence[str], *, pause: float = 1.0) -> list[Planned]:
    """Draw a campaign: every kind comes as often as any other, give or take one.

    seed 1, 5 faults, kinds a and b  ->  b a b a a, the same at every call

    Args:
        seed: Of all that is drawn.
        count: Faults.
        kinds: Their names.
        pause: The longest between two faults [s].

    Returns:
        The faults in order.
    """
    drawn = random.Random(seed)  # noqa: S311
    names = [kinds[index % len(kinds)] for index in range(count)]
    drawn.shuffle(names)
    return [
        Planned(name, drawn.uniform(0.0, pause), drawn.random(), drawn.random()) for name in names
    ]
