"""Small jobs, asks and results, from which the tests of the store are made."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS, Outcome, Status

LEASE = 30.0


class Clock:
    """A clock that stands until it is advanced."""

    def __init__(self) -> None:
        self.now = datetime(2030, 1, 2, 3, 4, 5, 678901, tzinfo=UTC)

    def __call__(self, _transaction: object) -> datetime:
        return self.now

    def advance(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)


def spec(*, name: str = "", iterations: int = 3, particles: int = 2) -> JobSpec:
    return JobSpec.model_validate(
        {
            "name": name,
            "controller": "pi",
            "scenarios": ["1", "2"],
            "optimizer": {"particles": particles},
            "iterations": iterations,
        }
    )


def ask(iteration: int, *, particles: int = 2) -> Ask:
    generator = np.random.default_rng(iteration)
    return Ask(
        iteration, generator.random((particles, 2)), {"schema_version": 1, "iteration": iteration}
    )


def completed(
    iteration: int, fitness: Sequence[float] = (2.0, 3.0), *, seconds: float = 0.5
) -> CompletedIteration:
    """fitness of +inf marks a particle that fell in the second of two scenarios."""
    n = len(fitness)
    generator = np.random.default_rng(1000 + iteration)
    failed = ~np.isfinite(fitness)
    well = Outcome(generator.random((n, len(RESULTS))), np.full(n, Status.OK, dtype=np.uint8))
    objectives = generator.random((n, len(RESULTS)))
    objectives[failed] = np.nan
    statuses = np.where(failed, Status.FELL, Status.OK).astype(np.uint8)
    outcomes = (well, Outcome(objectives, statuses))
    designs = generator.random((n, 2))
    return CompletedIteration(iteration, designs, outcomes, np.array(fitness), seconds)


def begun(store: Store, notify_url: str | None = None, **options: object) -> Claim:
    """A new job, claimed by `runner-a`, its first ask stored."""
    store.create_job(spec(**options), notify_url=notify_url)  # type: ignore[arg-type]
    claim = store.claim("runner-a", lease_seconds=LEASE)
    assert claim is not None
    store.begin(claim, ask(0))
    return claim
