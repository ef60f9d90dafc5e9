"""A store as large as one gets, with results made up by formula: for benchmarks and tests.

    python -m benchmarks.large_store jobs.db [--jobs 1000] [--iterations 4000]

One job `long` of 25 particles in the six preset scenarios, and short ones around it. A real swarm
searches; only the walks are a formula. Everything is written through the store's own functions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.sim.outcome import N_MEASUREMENTS, Outcome, Status

PARTICLES: Final = 25
_LEASE: Final = 3600.0
_CONTROLLERS: Final = ("fuzzy-pi", "pi", "pid", "p")
_TYPICAL: Final = np.array([8.7, 1.8, 16.0, 42.0, 6.4, -0.004])
"""Objectives f1..f6 of a good design, in their units."""


def long_spec(iterations: int = 4000) -> JobSpec:
    """Nine variables, six scenarios, six objectives."""
    return JobSpec.model_validate(
        {
            "name": "long",
            "optimizer": {"name": "pso", "particles": PARTICLES},
            "iterations": iterations,
        }
    )


def short_spec(number: int) -> JobSpec:
    """One of many that differ in name, controller and seed."""
    return JobSpec.model_validate(
        {
            "name": f"short {number:04d}",
            "controller": _CONTROLLERS[number % len(_CONTROLLERS)],
            "scenarios": ["1", "2"],
            "optimizer": {"name": "pso", "particles": 2},
            "iterations": 2,
            "seed": number,
        }
    )


def fill(store: Store, *, jobs: int = 1000, iterations: int = 4000) -> str:
    """Write `jobs` jobs, the last of them long; the id of that one.

    Of the short ones, half are left queued, a quarter paused, a quarter have succeeded.
    """
    for number in range(jobs - 1):
        job, _ = store.create_job(short_spec(number))
        if number % 4 == 0:
            run(store, job)
        elif number % 4 == 1:
            store.command(job.id, Command.PAUSE)
    job, _ = store.create_job(long_spec(iterations))
    run(store, job)
    return job.id


def run(store: Store, job: Job) -> None:
    """Run a queued job to its end, with walks by formula."""
    claim = store.claim("large-store", lease_seconds=_LEASE, job_id=job.id)
    assert claim is not None
    optimizer = job.spec.create_search()
    following: Ask | None = _ask(optimizer)
    assert following is not None
    store.begin(claim, following)
    while following is not None:
        following = _step(store, claim, optimizer, following)


def _step(store: Store, claim: Claim, optimizer: Optimizer, ask: Ask) -> Ask | None:
    spec = claim.job.spec
    designs = spec.design_space().designs(ask.positions)
    outcomes = walk(ask.positions, optimizer_bounds(claim.job), len(spec.case_names))
    fitness = judge_outcomes(spec, outcomes).fitness
    optimizer.tell(fitness)
    following = _ask(optimizer) if optimizer.iteration < spec.iterations else None
    done = CompletedIteration(ask.iteration, designs, outcomes, fitness, 0.25)
    store.commit(claim, done, following)
    return following


def optimizer_bounds(job: Job) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(low, high) of the searched variables."""
    space = job.spec.design_space()
    return space.box.low, space.box.high


def walk(
    positions: NDArray[np.float64],
    bounds: Sequence[NDArray[np.float64]],
    scenarios: int,
) -> tuple[Outcome, ...]:
    """A bowl with a floor of noise; one design in ten falls in one of the scenarios."""
    low, high = bounds
    share = (positions - low) / (high - low)
    rough = np.modf(np.abs(np.sin(share.sum(axis=1) * 1e4)) * 1e3)[0]
    outcomes = []
    for k in range(scenarios):
        distance = ((share - 0.3 - 0.05 * k) ** 2).mean(axis=1)
        scale = 1.0 + 2.0 * distance[:, None] + 0.1 * rough[:, None] * np.linspace(0.1, 1.0, 6)
        objectives = np.hstack([_TYPICAL * scale, np.ones((len(share), N_MEASUREMENTS))])
        fell = (rough < 0.1) & (np.floor(rough * 1e3).astype(int) % scenarios == k)
        objectives[fell] = np.nan
        statuses = np.where(fell, Status.FELL, Status.OK).astype(np.uint8)
        outcomes.append(Outcome(objectives, statuses))
    return tuple(outcomes)


def _ask(optimizer: Optimizer) -> Ask:
    positions = optimizer.ask()
    return Ask(optimizer.iteration, positions, optimizer.dump())


def main() -> None:
    """Make the store and say how long it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path")
    parser.add_argument("--jobs", type=int, default=1000)
    parser.add_argument("--iterations", type=int, default=4000)
    options = parser.parse_args()
    begun = time.perf_counter()
    store = open_store(options.path)
    job_id = fill(store, jobs=options.jobs, iterations=options.iterations)
    store.close()
    print(f"{job_id} in {options.path} after {time.perf_counter() - begun:.1f} s")


if __name__ == "__main__":
    main()
