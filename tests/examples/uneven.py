"""A job whose iterations are of one to three designs, as a method may ask for them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pytest

import gaitswarm
from gaitswarm.services.optimizer.search.optimizer import Proposals, Replayed
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.search.space import Space
from tests.examples.walks import SHORT_WALK

UNEVEN_SPEC: Final[dict[str, Any]] = {
    "name": "uneven",
    "controller": "pi",
    "scenarios": [SHORT_WALK],
    "optimizer": {"name": "random", "particles": 3},
    "iterations": 4,
    "seed": 4242,
}
"""A budget of four times three designs, which take six iterations."""

SIZES: Final = [1, 2, 3, 1, 2, 3]
"""Designs of each of them."""


def _uneven(
    settings: gaitswarm.RandomSearchSettings, space: Space, _budget: int, random: RandomNumbers
) -> Proposals:
    while True:
        for size in range(1, settings.particles + 1):
            yield space.evenly(random.uniform(size, space.dimension))


@contextmanager
def uneven_iterations() -> Iterator[None]:
    """Inside, the method `random` asks for one design, then two, up to `particles`, and again."""

    def create(settings: Any, space: Space, budget: int, seed: int) -> Replayed:
        return Replayed(_uneven, settings, space, budget, seed)

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(METHODS, "random", replace(METHODS["random"], create=create))
        yield


def run_uneven(db: Path, **options: Any) -> gaitswarm.OptimizationResult:
    """Run the job to its end."""
    with uneven_iterations():
        return gaitswarm.optimize(UNEVEN_SPEC, db=db, **options)
