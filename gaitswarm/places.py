"""How texts name a design of a job: `8.12` is design 12 of iteration 8, both counted from 0."""

from __future__ import annotations

import re

from gaitswarm.services.optimizer.errors import InvalidRequest


def place_of(iteration: int, particle: int) -> str:
    """The place of a design as texts have it."""
    return f"{iteration}.{particle}"


def read_place(text: str, *, field: str) -> tuple[int, int]:
    """Read what `place_of` wrote."""
    found = re.fullmatch(r"(\d{1,9})\.(\d{1,9})", text, re.ASCII)
    if found is None:
        raise InvalidRequest(
            "must be the iteration and the number of a design in it, such as 24.7", field=field
        )
    return int(found[1]), int(found[2])
