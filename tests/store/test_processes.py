"""Several runners at once, and runners that are killed."""

from __future__ import annotations

import random
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice

import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from tests.examples.forked import ForkedCommand
from tests.examples.processes import output
from tests.store import worker_process
from tests.store.examples import LEASE, Clock, ask, spec
from tests.store.worker_process import PARTICLES


def at_once(n: int, act: Callable[[int], None]) -> None:
    """Run `act` in n threads that start together; raises what any of them raised."""
    start = threading.Barrier(n)
    failures: list[BaseException] = []

    def run(index: int) -> None:
        start.wait()
        try:
            act(index)
        except BaseException as error:  # noqa: BLE001 (raised in the test's own thread, below)
            failures.append(error)

    threads = [threading.Thread(target=run, args=(index,)) for index in range(n)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]


@contextmanager
def worker(what: str, url: str) -> Iterator[ForkedCommand]:
    """A worker process that is ready and waits for a line; killed in the end."""
    with ForkedCommand(
        what, url, program=worker_process.main, stdin=subprocess.PIPE, stderr=None
    ) as process:
        try:
            assert output(process.stdout).readline() == "ready\n"
            yield process
        finally:
            process.kill()


def say_go(process: ForkedCommand) -> None:
    output(process.stdin).write("go\n")
    output(process.stdin).flush()


def test_every_job_is_claimed_by_exactly_one_of_many_threads(
    store: Store, database_url: str, clock: Clock
) -> None:
    made = {store.create_job(spec())[0].id for _ in range(24)}
    claimed: list[str] = []
    stores = [store, open_store(database_url, clock=clock)]

    def claim_some(index: int) -> None:
        while len(claimed) < len(made):
            claim = stores[index % 2].claim(f"runner-{index}", lease_seconds=LEASE)
            if claim is not None:
                claimed.append(claim.job.id)

    at_once(6, claim_some)
    stores[1].close()
    assert sorted(claimed) == sorted(made)


@pytest.mark.slow
def test_every_job_is_claimed_by_exactly_one_of_several_processes(
    store: Store, database_url: str, pytestconfig: pytest.Config
) -> None:
    made = {store.create_job(spec())[0].id for _ in range(40)}
    with (
        worker("claim", database_url) as a,
        worker("claim", database_url) as b,
    ):
        say_go(a)
        say_go(b)
        claimed = [line.strip() for p in (a, b) for line in output(p.stdout)]
    assert len(claimed) == len(set(claimed))
    # One that finds every candidate locked for a moment may stop early; none is ever lost.
    while (claim := store.claim("last", lease_seconds=LEASE)) is not None:
        claimed.append(claim.job.id)
    assert set(claimed) == made


def test_of_equal_submissions_at_once_exactly_one_makes_the_job(store: Store) -> None:
    answers: list[tuple[Job, bool]] = []
    at_once(6, lambda _: answers.append(store.create_job(spec(), idempotency_key="k")))
    assert len({job.id for job, _ in answers}) == 1
    assert sorted(new for _, new in answers) == [False] * 5 + [True]


def test_of_equal_commands_at_once_exactly_one_succeeds(store: Store) -> None:
    job, _ = store.create_job(spec())
    answers: list[object] = []

    def pause(_: int) -> None:
        try:
            answers.append(store.command(job.id, Command.PAUSE).state)
        except Conflict:
            answers.append(Conflict)

    at_once(6, pause)
    assert answers.count(JobState.PAUSED) == 1 and answers.count(Conflict) == 5


@pytest.mark.slow
def test_a_runner_killed_in_the_midst_of_commits_loses_nothing_that_was_acknowledged(
    database_url: str, pytestconfig: pytest.Config
) -> None:
    store = open_store(database_url)
    job, _ = store.create_job(spec(iterations=1_000_000, particles=PARTICLES))
    generator = random.Random(7)
    for _ in range(3):
        before = store.job(job.id).progress.iterations
        with worker("commit", database_url) as process:
            say_go(process)
            acknowledged = len(list(islice(output(process.stdout), generator.randint(1, 20))))
            time.sleep(generator.uniform(0.0, 0.01))
            process.kill()
            acknowledged += len(output(process.stdout).readlines())
        # Claiming waits for what the database had begun when the runner died.
        after = store.claim("inspector", lease_seconds=0.0, job_id=job.id)
        assert after is not None
        committed = after.job.progress.iterations - before
        assert acknowledged <= committed <= acknowledged + 1
        assert_consistent(store, after)
    assert_sound(database_url)
    store.close()


def assert_consistent(store: Store, claim: Claim) -> None:
    """Progress, iterations, evaluations, best and the outstanding ask tell one story."""
    job_id, progress = claim.job.id, claim.job.progress
    history = store.iterations(job_id, limit=10_000).items
    found = store.evaluations_between(job_id, 0, progress.iterations + 10)
    assert [iteration.index for iteration in history] == list(range(progress.iterations))
    assert [(e.iteration, e.particle) for e in found] == [
        (k, particle) for k in range(progress.iterations) for particle in range(PARTICLES)
    ]
    assert progress.evaluations == len(found)
    assert progress.best_fitness == min(e.fitness for e in found) == history[-1].best_so_far
    assert claim.ask is not None
    assert claim.ask.iteration == progress.iterations
    assert claim.ask.state == ask(progress.iterations).state


def assert_sound(database_url: str) -> None:
    database = Database(database_url)
    if database.engine.dialect.name == "sqlite":
        with database.read() as connection:
            assert connection.execute(text("PRAGMA integrity_check")).scalar_one() == "ok"
            assert connection.execute(text("PRAGMA foreign_key_check")).all() == []
    database.close()
