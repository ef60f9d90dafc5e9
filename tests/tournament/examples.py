"""Tournaments with made-up results, as a runner would have committed them."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.outcome import Outcome, Status
from tests.tournament.problems import tournament

CHECKPOINTS = (1, 10, 40)


def entrant(label: str, method: str, **changes: Any) -> TournamentSpec:
    """A method's part, of four runs on two problems."""
    terms = {"method": method, "checkpoints": CHECKPOINTS, "iterations": 4}
    return tournament(name=f"tournament: {label}" if label else "", **(terms | changes))


def submitted(service: JobService, spec: TournamentSpec, runs: list[float] | None = None) -> Job:
    """A job whose runs came to these values on both problems after 10 of 40 evaluations.

    Before, they were at 5; a value of 1e-3 or less reaches the target, at evaluation 10.
    """
    job, _ = service.submit(spec)
    store = service.store
    if runs:
        claim = store.claim("test", lease_seconds=60.0, job_id=job.id)
        assert claim is not None
        for index, value in enumerate(runs):
            if index == 0:
                store.begin(claim, _ask(0))
            last = index + 1 == spec.iterations
            store.commit(claim, _completed(spec, index, value), None if last else _ask(index + 1))
    return service.job(job.id)


def _ask(index: int) -> Ask:
    return Ask(index, np.array([[float(index)]]), {"iteration": index})


def _completed(spec: TournamentSpec, index: int, value: float) -> CompletedIteration:
    reached = 10.0 if value <= 1e-3 else np.nan
    row = np.array([[5.0, value, value, 10.0, reached]])
    outcome = Outcome(row, np.array([Status.OK], dtype=np.uint8))
    return CompletedIteration(
        iteration=index,
        designs=np.array([[float(index)]]),
        outcomes=tuple(outcome for _ in spec.problems),
        fitness=np.array([value]),
        evaluate_seconds=0.1,
    )
