"""Jobs whose search learns from objective vectors, and the replay of these"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from gaitswarm.services.optimizer.analysis.fork import retraced
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import Aggregate
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, judge
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.run.runner import run_embedded
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.calibration.conftest import spec as calibration
from tests.examples.jobs import history
from tests.optimizer.formula import HERE, SPEC, TradeOff

Floats = NDArray[np.float64]

HYPE: dict[str, Any] = {"name": "hype", "particles": 4, "population": 6, "offspring": 6}
"""Generations that are asked for in pieces."""


class KilledError(Exception):
    """The process was killed after a commit."""


def spec(**given: Any) -> JobSpec:
    return JobSpec.model_validate(SPEC.model_dump() | {"optimizer": HYPE} | given)


def run(store: Store, wanted: JobSpec) -> Job:
    claim = JobService(store, provenance=lambda _: HERE).submit_embedded(wanted)
    done = run_embedded(store, TradeOff(), claim, accepts_changes=True)
    assert done.state is JobState.SUCCEEDED, done.error
    return done


def run_through_kills(store: Store, job_id: str) -> Job:
    """A life for every iteration."""

    def kill(done: CompletedIteration, state: JobState) -> None:
        raise KilledError

    while not store.job(job_id).state.terminal:
        claim = store.claim("runner", lease_seconds=30.0, job_id=job_id)
        assert claim is not None
        with pytest.raises(KilledError):
            run_claim(claim, RunContext(store, TradeOff(), on_commit=kill))
    return store.job(job_id)


def by_iteration(store: Store, job: Job, column: Floats) -> list[Floats]:
    sizes = [len(link.positions) for link in store.links(job.id, 0, job.progress.iterations)]
    return np.split(column, np.cumsum(sizes)[:-1])


def test_the_search_learns_geometric_means_of_each_objective_without_biases(store: Store) -> None:
    job = run(store, spec(preference="A"))
    columns = store.evaluation_columns(job.id, 0, 100)
    assert columns is not None
    assert columns.failed.any()
    vectors = np.exp(np.log(columns.objectives[:, :, :5]).mean(axis=1))
    vectors[columns.failed.any(axis=1)] = math.inf
    feedback = spec().search_feedback(columns.objectives, columns.failed, columns.fitness)
    np.testing.assert_allclose(feedback, vectors, rtol=1e-12)
    links = store.links(job.id, 0, job.progress.iterations)
    asked = [link.positions for link in links]
    retraced(job.spec, [job.spec.iterations], asked, by_iteration(store, job, feedback))
    worse = by_iteration(
        store, job, feedback[:, ::-1] * np.arange(1.0, len(feedback) + 1.0)[:, None]
    )
    with pytest.raises(ValueError, match="asks for other designs"):
        retraced(job.spec, [job.spec.iterations], asked, worse)


def test_the_path_depends_on_no_preference_and_the_best_is_the_one_by_the_jobs(
    store: Store,
) -> None:
    jobs = {name: run(store, spec(preference=name)) for name in ("A", "C")}
    designs = {name: [row[2:5] for row in history(store, job.id)] for name, job in jobs.items()}
    assert designs["A"] == designs["C"]
    for name, job in jobs.items():
        columns = store.evaluation_columns(job.id, 0, 100)
        assert columns is not None
        judged = judge(columns.objectives, columns.failed, PREFERENCES[name]).fitness  # type: ignore[index]
        best = store.best(job.id)
        assert best is not None
        assert best.fitness == judged.min() == job.progress.best_fitness
    assert jobs["A"].progress.best_fitness != jobs["C"].progress.best_fitness


@pytest.mark.variants
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_job_killed_after_every_iteration_equals_one_that_never_was(
    store: Store, precision: str
) -> None:
    wanted = spec(precision=precision)
    whole = run(store, wanted)
    killed = run_through_kills(store, store.create_job(wanted)[0].id)
    assert history(store, killed.id) == history(store, whole.id)
    reevaluated = [
        [(k, one.fitness) for k, one in store.reevaluations(j.id)] for j in (killed, whole)
    ]
    assert reevaluated[0] == reevaluated[1]
    assert bool(reevaluated[0]) == (precision == "single")
    assert killed.progress.best_fitness == whole.progress.best_fitness


def test_an_extended_job_equals_one_with_the_greater_budget_from_the_start(store: Store) -> None:
    job = run(store, spec())
    store.extend(job.id, SPEC.iterations + 2)
    extended = run_embedded(store, TradeOff(), job.id)
    assert extended.progress.evaluations == (SPEC.iterations + 2) * HYPE["particles"]
    assert history(store, job.id) == history(
        store, run(store, spec(iterations=SPEC.iterations + 2)).id
    )


def test_a_fork_under_another_preference_continues_bit_for_bit_as_its_parent(store: Store) -> None:
    service = JobService(store)
    job, _ = service.submit(spec(iterations=7))
    run_embedded(store, TradeOff(), job.id)
    request = ForkRequest.model_validate({"from_iteration": 4, "preference": "C"})
    forked, _ = service.fork(job.id, request)
    assert forked.lineage is not None
    assert (forked.lineage.carried, forked.lineage.changed) == ("search", ("preference",))
    run_embedded(store, TradeOff(), forked.id)
    assert [row[:5] for row in history(store, forked.id)] == [
        row[:5] for row in history(store, job.id)
    ]


def test_start_designs_are_judged_first_and_are_members(store: Store) -> None:
    designs = ({"P": 0.25, "I": 0.125}, {"P": 0.75, "I": 0.5})
    job = run(store, spec(start=designs, iterations=9))
    space, rows = job.spec.design_space(), store.evaluations_between(job.id, 0, 100)
    assert [space.shown(row.design.tolist()) for row in rows[:2]] == list(designs)
    assert job.progress.evaluations == job.spec.budget
    cold = run(store, spec(iterations=7))
    assert [row[2] for row in history(store, job.id)][6:] != [
        row[2] for row in history(store, cold.id)
    ][6:]


@pytest.mark.parametrize("aggregate", ["mean", "worst", "quantile", "cvar"])
def test_in_worlds_an_objective_is_worth_what_a_preference_for_it_alone_would_say(
    aggregate: Aggregate,
) -> None:
    worlds = {"count": 4, "aggregate": aggregate, "level": 0.5}
    random = np.random.default_rng(1)
    objectives = random.lognormal(size=(6, 8, 6))
    failed = np.zeros((6, 8), dtype=np.bool_)
    failed[0] = True
    failed[1, 3] = True
    robust = spec(worlds=worlds)
    feedback = robust.search_feedback(objectives, failed, np.zeros(6))
    assert feedback.shape == (6, 5)
    for m in range(5):
        alone = {"bias": [0.0] * 5, "exponent": np.eye(5)[m].tolist()}
        expected = spec(worlds=worlds, preference=alone).judge(objectives, failed).fitness
        np.testing.assert_array_equal(feedback[:, m], expected)
    assert np.isinf(feedback[0]).all()
    # One walk in four may fail where a quantile does not see it.
    assert np.isinf(feedback[1]).all() == (aggregate != "quantile")


def test_an_objective_that_is_missing_or_infinite_makes_a_failed_design() -> None:
    objectives = np.ones((3, 2, 6))
    objectives[1, 0, 2] = math.inf
    objectives[2, 1, 4] = math.nan
    for worlds in (None, {"count": 2, "aggregate": "mean"}):
        cases = objectives if worlds is None else np.repeat(objectives, 2, axis=1)
        feedback = spec(worlds=worlds).search_feedback(
            cases, np.zeros(cases.shape[:2], bool), np.ones(3)
        )
        assert feedback.tolist() == [[1.0] * 5, [math.inf] * 5, [math.inf] * 5]


def test_a_kind_of_job_without_objectives_to_trade_refuses_the_method_by_name() -> None:
    document = json.loads(calibration().model_dump_json())
    with pytest.raises(ValidationError, match="optimizer: hype is multi-objective"):
        SPECS.validate_python(document | {"optimizer": "hype"})
