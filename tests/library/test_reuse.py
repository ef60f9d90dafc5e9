"""`gaitswarm.optimize(reuse=True)` takes the same job that ran before."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

import gaitswarm
from gaitswarm.jobs.database import earlier_job
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_store

pytestmark = pytest.mark.slow

SPEC = gaitswarm.job_spec(
    controller="pi", scenarios="1", particles=2, iterations=1, name="reused", seed=1
)


@pytest.fixture
def service(database: Path) -> Iterator[JobService]:
    with closing(open_store(str(database))) as store:
        yield JobService(store)


def test_a_finished_job_is_not_run_again(database: Path) -> None:
    first = gaitswarm.optimize(SPEC, db=database, reuse=True)
    iterations: list[object] = []
    again = gaitswarm.optimize(SPEC, db=database, reuse=True, on_iteration=iterations.append)
    assert (again.job.id, again.best, iterations) == (first.job.id, first.best, [])
    assert gaitswarm.optimize(SPEC, db=database).job.id != first.job.id


def test_an_unfinished_job_is_resumed(database: Path) -> None:
    with gaitswarm.open(database) as jobs:
        paused = jobs.pause(jobs.submit(SPEC).id)
    result = gaitswarm.optimize(SPEC, db=database, reuse=True)
    assert (result.job.id, result.job.state) == (paused.id, "succeeded")


def test_the_same_job_has_the_same_name_and_specification_and_was_not_cancelled(
    database: Path, service: JobService
) -> None:
    job = service.job(gaitswarm.optimize(SPEC, db=database).job.id)
    assert earlier_job(service, SPEC) == job
    assert earlier_job(service, SPEC.model_copy(update={"name": "another"})) is None
    assert earlier_job(service, SPEC.model_copy(update={"iterations": 2})) is None
    unwanted, _ = service.submit(SPEC.model_copy(update={"name": "unwanted"}))
    service.store.command(unwanted.id, Command.CANCEL)
    assert earlier_job(service, unwanted.spec) is None


def test_a_job_of_other_code_is_not_the_same(database: Path, service: JobService) -> None:
    job = service.job(gaitswarm.optimize(SPEC, db=database).job.id)
    other = service.provenance(job.spec).model_copy(update={"optimizer_digest": "another"})
    assert earlier_job(JobService(service.store, lambda _: other), job.spec) is None
