"""Small jobs, and all that is remembered of one."""

from __future__ import annotations

from typing import Any, Final

from gaitswarm.services.optimizer.store import Store
from tests.examples.walks import SHORT_WALK

SMALL_SPEC: Final[dict[str, Any]] = {
    "name": "small",
    "scenarios": [SHORT_WALK],
    "optimizer": {"name": "pso", "particles": 3},
    "iterations": 2,
    "seed": 7,
}
"""Six walks of a second, as a document."""

LONG_SPEC: Final[dict[str, Any]] = {
    "name": "long",
    "controller": "pi",
    "scenarios": ["normal-fast", "slope-fast"],
    "optimizer": {"name": "pso", "particles": 120},
    "iterations": 1000,
    "seed": 7,
}
"""An iteration takes some seconds of one processor."""

Bits = tuple[int, int, bytes, bytes, bytes, float]
"""An evaluation, and nothing that is measured: iteration, particle, design, objectives, statuses,
fitness."""


def history(store: Store, job_id: str) -> list[Bits]:
    """Every evaluation of a job, to the bit."""
    return [
        (
            evaluation.iteration,
            evaluation.particle,
            evaluation.design.tobytes(),
            evaluation.objectives.tobytes(),
            evaluation.statuses.tobytes(),
            evaluation.fitness,
        )
        for evaluation in store.evaluations_between(job_id, 0, 1_000_000)
    ]
