"""Certificates under the runner: batches, extensions, caches, and what they walk."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.sim.simulate import simulate
from gaitswarm.sim.worlds.walks import WorldWalk
from tests.certificate.examples import PI, small
from tests.examples.jobs import history


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Evaluator]:
    opened = open_evaluator("in-process", cpus=2)
    yield opened
    opened.close()


def run(store: Store, evaluator: Evaluator, spec: CertificateSpec) -> str:
    job, _ = JobService(store).submit(spec)
    ended = run_embedded(store, evaluator, job.id, cache=True)
    assert ended.state is JobState.SUCCEEDED, ended.error
    return job.id


def walked(store: Store, job_id: str) -> EvaluationColumns:
    service = JobService(store)
    return service.columns(service.job(job_id))


def test_the_first_world_is_the_model_and_the_others_are_drawn(
    store: Store, evaluator: Evaluator
) -> None:
    spec = small()
    found = walked(store, run(store, evaluator, spec))
    assert len(found) == 11
    variables = spec.design_space().names
    for k, scenario in enumerate(spec.resolved_scenarios()):
        nominal = simulate(scenario, "pi", tuple(PI), np.array([list(PI.values())]))
        assert found.objectives[0, k].tobytes() == nominal.outcome.objectives[0].tobytes()
        case = WorldWalk(spec.robot, "pi", tuple(PI.items()), scenario, variables)
        world = case.run(np.array([list(spec.world(6).values())]))
        assert found.objectives[7, k].tobytes() == world.objectives[0].tobytes()
    assert len({row.tobytes() for row in found.objectives[:, 0]}) == 11


def test_worlds_do_not_depend_on_the_size_of_batches(store: Store, evaluator: Evaluator) -> None:
    other = small(optimizer={"name": "random", "particles": 11})
    rows = [
        [row[2:] for row in history(store, run(store, evaluator, spec))]
        for spec in (small(), other)
    ]
    assert rows[0] == rows[1]


def test_an_extended_certificate_keeps_its_worlds_and_adds_others(
    store: Store, evaluator: Evaluator
) -> None:
    short = run(store, evaluator, small(worlds=5))
    before = history(store, short)
    job = JobService(store).extend(short, 5)
    assert (job.spec.budget, job.spent) == (20, 2)
    assert run_embedded(store, evaluator, short).state is JobState.SUCCEEDED
    after = history(store, short)
    assert after[: len(before)] == before
    whole = history(store, run(store, evaluator, small(worlds=19)))
    # The last batch of the short one was cut, and the next one went on where it ended.
    assert [row[2:] for row in after] == [row[2:] for row in whole]


def test_more_worlds_simulate_only_new_ones(store: Store, evaluator: Evaluator) -> None:
    run(store, evaluator, small(worlds=5))
    longer = store.job(run(store, evaluator, small(worlds=9, preference="C", name="other")))
    assert longer.progress.evaluations == 10
    assert longer.progress.evaluations_saved == 6


def test_a_fork_continues_with_the_same_worlds_and_another_preference(
    store: Store, evaluator: Evaluator
) -> None:
    parent, service = run(store, evaluator, small()), JobService(store)
    forked, _ = service.fork(parent, ForkRequest(from_iteration=2, preference="B"))
    assert forked.lineage is not None and forked.lineage.carried == "search"
    assert run_embedded(store, evaluator, forked.id).state is JobState.SUCCEEDED
    whole = run(store, evaluator, small(preference="B"))
    assert history(store, forked.id) == history(store, whole)


def test_a_certificate_is_not_forked_into_other_scenarios(
    store: Store, evaluator: Evaluator
) -> None:
    parent = run(store, evaluator, small())
    others: list[dict[str, Any]] = [{"scenarios": ("normal-slow",)}, {"robot": "szabadka2"}]
    for given in others:
        with pytest.raises(InvalidRequest, match="submit a new job instead"):
            JobService(store).fork(parent, ForkRequest(from_iteration=2, **given))
    assert [job.id for job in store.jobs().items] == [parent]


def test_a_search_in_single_precision_walks_the_same_worlds(
    store: Store, evaluator: Evaluator
) -> None:
    single = walked(store, run(store, evaluator, small(worlds=3, precision="single")))
    double = walked(store, run(store, evaluator, small(worlds=3)))
    assert single.designs.tobytes() == double.designs.tobytes()
    assert single.objectives.tobytes() != double.objectives.tobytes()
    np.testing.assert_allclose(single.objectives[:, :, :5], double.objectives[:, :, :5], rtol=0.02)


def test_a_certificate_is_estimated_like_any_job(store: Store) -> None:
    estimate = JobService(store).estimate(small())
    assert (estimate.evaluations, estimate.walks) == (11, 22)
    assert estimate.simulated_seconds == pytest.approx(11 * 2.5)
