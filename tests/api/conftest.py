"""A real server before a real store, and jobs with made-up results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import httpx2
import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS, Outcome, Status
from tests.examples.servers import Server

PARTICLES = 4

Serve = Callable[..., Server]
Commit = Callable[..., Claim]


@pytest.fixture
def service(store: Store) -> JobService:
    return JobService(store)


@pytest.fixture
def serve(service: JobService) -> Iterator[Serve]:
    """Start a server of one test's own, with other settings or another service than the usual."""
    with ExitStack() as stack:

        def start(served: JobService = service, **settings: Any) -> Server:
            server = Server(served, **settings)
            stack.callback(server.close)
            return server

        yield start


@pytest.fixture
def client(lasting_server: Server, service: JobService) -> httpx2.Client:
    """A client of a server with the usual settings, on this test's own database."""
    lasting_server.serve(service)
    return lasting_server.client


@pytest.fixture
def spec() -> JobSpec:
    """A small job: two scenarios, four particles, three iterations."""
    return JobSpec(
        name="small",
        scenarios=("normal-fast", "turn-right-fast"),
        optimizer=PsoSettings(particles=PARTICLES),
        iterations=3,
    )


@pytest.fixture
def job(store: Store, spec: JobSpec) -> Job:
    """A queued job."""
    return store.create_job(spec)[0]


@pytest.fixture
def commit(store: Store) -> Commit:
    """Commit iterations of a job as a runner does, with made-up results."""

    def run(
        job: Job, iterations: int, *, claim: Claim | None = None, failed: bool = False
    ) -> Claim:
        held = claim or store.claim("test", lease_seconds=60.0, job_id=job.id)
        assert held is not None
        done = store.job(job.id).progress.iterations
        for index in range(done, done + iterations):
            ask = _ask(job, index)
            if index == 0:
                store.begin(held, ask)
            last = index + 1 == job.spec.iterations
            following = None if last else _ask(job, index + 1)
            store.commit(held, _completed(job, index, failed=failed), following)
        return held

    return run


def _ask(job: Job, index: int) -> Ask:
    box = job.spec.design_space().box
    share = np.random.default_rng(index).random((PARTICLES, len(box.low)))
    return Ask(index, box.low + share * (box.high - box.low), {"iteration": index})


def _completed(job: Job, index: int, *, failed: bool) -> CompletedIteration:
    """The first particle falls in the last scenario; the others are the better, the later."""
    number = np.arange(PARTICLES, dtype=np.float64)
    objectives = np.full((PARTICLES, len(RESULTS)), 10.0) + number[:, None]
    statuses = np.full(PARTICLES, Status.FELL if failed else Status.OK, dtype=np.uint8)
    last = statuses.copy()
    last[0] = Status.FELL
    undefined = objectives.copy()
    undefined[0] = np.nan
    fitness = np.where(last == Status.OK, 100.0 - index + np.arange(PARTICLES), np.inf)
    return CompletedIteration(
        iteration=index,
        designs=job.spec.design_space().designs(_ask(job, index).positions),
        outcomes=(
            *[Outcome(objectives, statuses)] * (len(job.spec.case_names) - 1),
            Outcome(undefined, last),
        ),
        fitness=fitness,
        evaluate_seconds=0.5,
    )
