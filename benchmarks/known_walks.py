"""Cost of looking up stored results, in a large store.

    python -m benchmarks.known_walks [--rows 100000] [--rounds 200] [--json]

Iterations of the chapter-4 job, of 25 designs without stored results. What the cache adds to each
is timed part by part: making keys, asking the store for them, and a commit that keeps them, which
takes turns with a commit that does not. Walks are a formula, and not timed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from benchmarks.large_store import optimizer_bounds, walk
from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.optimizer.run.coordinator import walk_keys
from gaitswarm.services.optimizer.store import Store, open_store

T = TypeVar("T")

_PARTICLES: Final = 25
_FILLED: Final = 1000
"""Designs of an iteration of the job that fills the store."""


class _Job:
    """A job of random designs, committed iteration by iteration.

    seconds: what each part took, by name.
    """

    def __init__(self, store: Store, particles: int, seed: int) -> None:
        document = {"optimizer": {"name": "pso", "particles": particles}, "iterations": 1_000_000}
        spec = JobSpec.model_validate(document)
        store.create_job(spec)
        claim = store.claim("benchmark", lease_seconds=3600.0)
        assert claim is not None
        self._store: Store = store
        self._claim: Claim = claim
        self._spec = claim.job.spec
        self._random = np.random.default_rng(seed)
        self._provenance = job_provenance(self._spec).simulation
        self._ask = self._next(0)
        self.seconds: dict[str, list[float]] = {}
        store.begin(claim, self._ask)

    def step(self, *, keeps_keys: bool) -> None:
        """Commit an iteration, with its keys or without them."""
        ask, space = self._ask, self._spec.design_space()
        designs = space.designs(ask.positions)
        bounds = optimizer_bounds(self._claim.job)
        outcomes = walk(ask.positions, bounds, len(self._spec.case_names))
        fitness = judge_outcomes(self._spec, outcomes).fitness
        keys: tuple[bytes, ...] = ()
        if keeps_keys:
            simulated = space.simulated(designs)
            keys = self._timed("keys", lambda: walk_keys(self._spec, self._provenance, simulated))
            assert not self._timed("query", lambda: self._store.known(keys))
        done = CompletedIteration(ask.iteration, designs, outcomes, fitness, 0.25, keys=keys)
        self._ask = self._next(ask.iteration + 1)
        name = "commit with keys" if keeps_keys else "commit"
        self._timed(name, lambda: self._store.commit(self._claim, done, self._ask))

    def _next(self, iteration: int) -> Ask:
        space = self._spec.design_space()
        share = self._random.random((self._spec.optimizer.particles, len(space.box.low)))
        return Ask(iteration, space.box.low + share * (space.box.high - space.box.low), {})

    def _timed(self, name: str, action: Callable[[], T]) -> T:
        begun = time.perf_counter()
        result = action()
        self.seconds.setdefault(name, []).append(time.perf_counter() - begun)
        return result


def measure(rows: int, rounds: int) -> dict[str, float]:
    """Medians [s] of each part, and of what the cache adds to an iteration."""
    with tempfile.TemporaryDirectory() as folder:
        store = open_store(str(Path(folder, "jobs.db")))
        filled = _Job(store, _FILLED, seed=1)
        for _ in range(max(1, rows // _FILLED)):
            filled.step(keeps_keys=True)
        job = _Job(store, _PARTICLES, seed=2)
        for number in range(2 * rounds):
            job.step(keeps_keys=number % 2 == 0)
        store.close()
    medians = {name: statistics.median(values) for name, values in job.seconds.items()}
    pairs = zip(job.seconds["commit with keys"], job.seconds["commit"], strict=True)
    index = statistics.median(with_keys - without for with_keys, without in pairs)
    return medians | {"index": index, "added": medians["keys"] + medians["query"] + index}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = measure(options.rows, options.rounds)
    if options.json:
        print(json.dumps(found))
        return
    for name, seconds in found.items():
        print(f"{name:18} {1e3 * seconds:7.2f} ms")


if __name__ == "__main__":
    main()
