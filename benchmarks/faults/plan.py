"""Schedule of faults, drawn from a seed."""

from __future__ import annotations

import random
from collections.abc import Mapping
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


def plan(
    seed: int, count: int, kinds: Mapping[str, int | None], *, pause: float = 1.0
) -> list[Planned]:
    """Draw a campaign. Kinds without a number come as often as each other, give or take one.

    seed 1, 5 faults, a and b without a number, c once  ->  c b a b a, the same at every call

    Args:
        seed: Of all that is drawn.
        count: Faults.
        kinds: Their names, and how often they come, or None.
        pause: The longest between two faults [s].

    Returns:
        The faults in order.
    """
    drawn = random.Random(seed)  # noqa: S311
    names = [name for name, times in kinds.items() for _ in range(times or 0)][:count]
    others = [name for name, times in kinds.items() if times is None]
    names += [others[index % len(others)] for index in range(count - len(names)) if others]
    drawn.shuffle(names)
    return [
        Planned(name, drawn.uniform(0.0, pause), drawn.random(), drawn.random()) for name in names
    ]
