"""Jobs that begin with iterations of another one: what they take over, and how they go on."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import (
    Conflict,
    InvalidRequest,
    NotFound,
    ProvenanceChanged,
)
from gaitswarm.services.optimizer.jobs.fork import Fork, ForkRequest, Lineage, TakenHistory
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.time_left import time_left
from gaitswarm.services.optimizer.run.runner import run_embedded
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.sim.outcome import Status
from tests.examples.jobs import history
from tests.optimizer.formula import HERE, SINGLE, SPEC, TradeOff

PARTICLES = SPEC.optimizer.particles

REPLAYED = ["de", "random"]


SPEED = {"bias": [0.0] * 5, "exponent": [0.0, 0.0, 0.0, 0.0, 1.0]}
"""A preference for nothing else."""


def service(store: Store) -> JobService:
    return JobService(store)


def run(store: Store, job: Job) -> Job:
    done = run_embedded(store, TradeOff(), job.id)
    assert done.state is JobState.SUCCEEDED, done.error
    return done


def parent(store: Store, spec: JobSpec = SPEC, **given: Any) -> Job:
    asked = JobSpec.model_validate(spec.model_dump() | given)
    return run(store, service(store).submit(asked)[0])


@pytest.fixture(scope="module")
def finished(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with the job that most tests fork."""
    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("parent") / "jobs.db"))
    with closing(open_store(str(path))) as store:
        parent(store)
    return path


@pytest.fixture
def database(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(finished, tmp_path / "jobs.db"))


@pytest.fixture
def job(store: Store) -> Job:
    """The only job, which has run `SPEC`."""
    (only,) = store.jobs().items
    return store.job(only.id)


def fork(store: Store, job: Job, iteration: int, **given: Any) -> Job:
    request = ForkRequest.model_validate({"from_iteration": iteration, **given})
    return service(store).fork(job.id, request)[0]


def edit(database: Path, statement: str, *values: str) -> None:
    with closing(sqlite3.connect(database)) as connection, connection:
        connection.execute(statement, values)


def objectives(store: Store, job: Job, iterations: int) -> list[bytes]:
    rows = store.evaluations_between(job.id, 0, iterations)
    return [row.design.tobytes() + row.objectives.tobytes() for row in rows]


@pytest.mark.variants("3-pso", "3-hype")
@pytest.mark.parametrize("method", ["pso", "hype", *REPLAYED])
@pytest.mark.parametrize("iteration", [1, 3, 6])
def test_a_fork_with_the_same_settings_continues_bit_for_bit_as_its_parent(
    store: Store, method: str, iteration: int
) -> None:
    optimizer = {"name": method, "particles": PARTICLES}
    job = parent(store, optimizer=optimizer)
    # The parent's own further path, where it has spent its budget.
    if iteration == job.progress.iterations:
        given = {"iterations": SPEC.iterations + 3}
        forked = run(store, fork(store, job, iteration, **given))
        store.extend(job.id, SPEC.iterations + 3)
        run(store, job)
    else:
        forked = run(store, fork(store, job, iteration))
    assert history(store, forked.id) == history(store, job.id)
    assert forked.progress.best_fitness == store.job(job.id).progress.best_fitness


def test_a_search_that_takes_too_long_to_restore_is_refused(store: Store, job: Job) -> None:
    hasty = JobService(store, longest_fork=0.0)
    request = ForkRequest(from_iteration=3)
    with pytest.raises(
        Conflict, match=r"limit of 0 s \(at iteration \d of 3\); fork at an earlier"
    ):
        hasty.fork(job.id, request)
    assert [listed.id for listed in store.jobs().items] == [job.id]
    # A fork that starts from designs has nothing to bring anywhere.
    another = ForkRequest.model_validate({"from_iteration": 3, "optimizer": "cma-es"})
    assert hasty.fork(job.id, another)[0].lineage is not None


def test_a_fork_begins_with_the_iterations_before_the_one_that_is_named(
    store: Store, job: Job
) -> None:
    forked = fork(store, job, 2)
    assert forked.state is JobState.QUEUED
    assert (forked.progress.iterations, forked.progress.evaluations) == (2, 2 * PARTICLES)
    assert history(store, forked.id) == [row for row in history(store, job.id) if row[0] < 2]
    listed, expected = (store.iterations(i.id, limit=2).items for i in (forked, job))
    for taken, own in zip(listed, expected, strict=True):
        assert (taken.best, taken.median, taken.best_so_far) == (
            own.best,
            own.median,
            own.best_so_far,
        )
    best = store.best(forked.id)
    assert best is not None
    assert best.fitness == forked.progress.best_fitness == listed[-1].best_so_far


def test_lineage_says_what_was_taken_over(store: Store, job: Job) -> None:
    lineage = fork(store, job, 2).lineage
    assert lineage is not None
    assert (lineage.parent, lineage.from_iteration, lineage.carried) == (job.id, 2, "search")
    assert (lineage.changed, lineage.reason, lineage.evaluations) == ((), "", 2 * PARTICLES)
    assert job.lineage is None


def test_forks_are_found_by_their_parent(store: Store, job: Job) -> None:
    forks = [fork(store, job, k) for k in (1, 2)]
    fork(store, run(store, forks[0]), 3)
    for order in (JobOrder.CREATED, JobOrder.NAME):
        found = store.jobs(parent=job.id, order=order).items
        assert {one.id for one in found} == {one.id for one in forks}
    assert store.jobs(parent="\0").items == ()


def test_a_fork_stays_when_its_parent_goes(store: Store, job: Job, database: Path) -> None:
    forked, whole = fork(store, job, 3), history(store, job.id)
    for table in ("reevaluations", "evaluations", "iterations"):
        edit(database, f"DELETE FROM {table} WHERE job_id = ?", job.id)  # noqa: S608
    edit(database, "DELETE FROM jobs WHERE id = ?", job.id)
    with pytest.raises(NotFound):
        store.job(job.id)
    assert history(store, run(store, forked).id) == whole


def test_a_fork_whose_iterations_are_gone_when_it_is_stored_is_not_stored_at_all(
    store: Store,
    job: Job,
) -> None:
    lineage = Lineage(parent=job.id, from_iteration=7, carried="search")
    taken = TakenHistory(state={}, fitness=None, provenance=job.provenance)
    with pytest.raises(Conflict, match="has not the 7 iterations any more"):
        store.create_job(SPEC, fork=Fork(lineage, taken))
    assert [found.id for found in store.jobs().items] == [job.id]


def test_a_fork_of_a_fork_and_of_an_extended_job_go_on_as_the_first_would(
    store: Store, job: Job
) -> None:
    store.extend(job.id, 9)
    job = run(store, job)
    first = run(store, fork(store, job, 4, iterations=12))
    second = run(store, fork(store, first, 8))
    assert history(store, second.id) == history(store, first.id)
    assert history(store, run(store, fork(store, job, 8)).id) == history(store, job.id)


@pytest.mark.variants
@pytest.mark.parametrize("method", ["pso", "random"])
def test_another_preference_rejudges_the_history_and_the_search(store: Store, method: str) -> None:
    job = parent(store, optimizer={"name": method, "particles": PARTICLES})
    forked = fork(store, job, 4, preference=SPEED)
    assert forked.lineage is not None
    assert (forked.lineage.carried, forked.lineage.changed) == ("search", ("preference",))
    rows = store.evaluations_between(forked.id, 0, 4)
    assert objectives(store, forked, 4) == objectives(store, job, 4)
    failed = np.stack([row.statuses for row in rows]) != Status.OK
    judged = forked.spec.judge(np.stack([row.objectives for row in rows]), failed).fitness
    assert [row.fitness for row in rows] == judged.tolist()
    best = store.best(forked.id)
    assert best is not None
    assert best.fitness == judged.min() == forked.progress.best_fitness
    done = run(store, forked)
    assert done.progress.evaluations == SPEC.budget


def test_a_rejudged_swarm_continues_from_its_place_towards_other_bests(
    store: Store,
    job: Job,
) -> None:
    forked = fork(store, job, 4, preference=SPEED)
    claim = store.claim("runner", lease_seconds=30.0, job_id=forked.id)
    assert claim is not None and claim.answered is not None
    state = claim.answered.ask.state
    asked = [link.positions for link in store.links(job.id, 0, 4)]
    feedback = [row.fitness for row in store.evaluations_between(forked.id, 0, 3)]
    by_particle = np.array(feedback).reshape(3, PARTICLES)
    assert state["positions"] == asked[3].tolist()
    best = by_particle.argmin(axis=0)
    by_parent = [row.fitness for row in store.evaluations_between(job.id, 0, 3)]
    assert (best != np.array(by_parent).reshape(3, PARTICLES).argmin(axis=0)).any()
    assert state["best_positions"] == [asked[k][j].tolist() for j, k in enumerate(best)]
    finite = np.isfinite(by_particle.min(axis=0))
    assert [f is not None for f in state["best_fitness"]] == finite.tolist()


@pytest.mark.variants
@pytest.mark.parametrize("method", ["de", "cma-es"])
def test_a_method_that_cannot_be_rejudged_starts_from_the_best_designs_by_the_preference(
    store: Store, method: str
) -> None:
    job = parent(store, optimizer={"name": method, "particles": PARTICLES}, iterations=12)
    forked = fork(store, job, job.progress.iterations, preference=SPEED, start_count=3)
    assert forked.lineage is not None
    assert (forked.lineage.carried, forked.lineage.evaluations) == ("designs", 0)
    assert method in forked.lineage.reason
    assert forked.progress.iterations == 0
    columns = service(store).columns(job)
    judged = forked.spec.judge(columns.objectives, columns.failed).fitness
    shown = job.spec.design_space().shown(columns.designs[judged.argmin()].tolist())
    assert forked.spec.start[0] == shown  # type: ignore[index]
    assert len(forked.spec.start) == 3  # type: ignore[arg-type]
    assert run(store, forked).progress.evaluations == job.spec.budget


@pytest.mark.variants("scenarios", "method")
@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"scenarios": ["normal-slow"]}, "scenarios"),
        ({"robot": "szabadka2"}, "robot"),
        ({"optimizer": {"name": "de", "particles": 4}}, "search method"),
        ({"optimizer": {"name": "pso", "particles": 4, "social": 1.0}}, "settings"),
        ({"scenarios": ["normal-slow"], "preference": "B"}, "scenarios"),
    ],
    ids=["scenarios", "robot", "method", "settings", "both"],
)
def test_where_outcomes_or_search_do_not_hold_the_fork_starts_from_the_best_designs(
    store: Store, job: Job, given: dict[str, Any], reason: str
) -> None:
    forked = fork(store, job, 3, **given)
    assert forked.lineage is not None
    assert forked.lineage.carried == "designs"
    assert reason in forked.lineage.reason
    columns = service(store).columns(job)
    best = columns.designs[columns.fitness[: 3 * PARTICLES].argmin()]
    assert forked.spec.start[0] == job.spec.design_space().shown(best.tolist())  # type: ignore[index]
    done = run(store, forked)
    first = store.evaluations_between(done.id, 0, 1)[0]
    assert first.design.tolist() == best.tolist()


def test_a_search_in_single_precision_is_forked_with_its_designs_in_double(
    store: Store,
) -> None:
    job = parent(store, SINGLE)
    same = run(store, fork(store, job, 3))
    assert history(store, same.id) == history(store, job.id)
    assert store.reevaluations(same.id) != ()
    assert [(k, reevaluation.fitness) for k, reevaluation in store.reevaluations(same.id)] == [
        (k, reevaluation.fitness) for k, reevaluation in store.reevaluations(job.id)
    ]
    assert same.progress.best_particle == job.progress.best_particle
    other = fork(store, job, 3, preference="B").lineage
    assert other is not None and "in double" in other.reason


def test_a_fork_within_other_bounds_searches_there_from_the_best_designs(
    store: Store, job: Job
) -> None:
    forked = fork(store, job, 3, bounds={"P": [0.01, 3.0]}, preference=SPEED)
    before, after = ({v.name: v for v in j.spec.design_space().variables} for j in (job, forked))
    assert (after["P"].low, after["P"].high) == (0.01, 3.0)
    assert after["I"] == before["I"]
    assert forked.lineage is not None
    assert forked.lineage.reason == "the parent searched within other bounds"
    # Bounds alter no results, so the best are those by the new preference.
    columns = service(store).columns(job)
    judged = forked.spec.judge(columns.objectives, columns.failed).fitness[: 3 * PARTICLES]
    shown = job.spec.design_space().shown(columns.designs[judged.argmin()].tolist())
    assert forked.spec.start[0] == shown  # type: ignore[index]

    # Within narrower bounds, only designs inside are a start.
    low = float(np.median(columns.designs[: 3 * PARTICLES, 0]))
    narrow = fork(store, job, 3, bounds={"P": [low, 3.0]})
    starts = [float(design["P"]) for design in narrow.spec.start]  # type: ignore[call-overload]
    assert min(starts) >= low


@pytest.mark.variants("given0-*", "given4-*")
@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"from_iteration": 7}, "from_iteration"),
        ({"from_iteration": 6}, "iterations"),
        ({"from_iteration": 3, "iterations": 3}, "iterations"),
        ({"from_iteration": 3, "preference": "B", "iterations": 2}, "iterations"),
        ({"from_iteration": 3, "scenarios": ["1", "normal-fast"]}, "scenarios"),
        ({"from_iteration": 3, "bounds": {"Q": [0, 1]}}, "bounds: the job does not search 'Q'"),
        ({"from_iteration": 3, "bounds": {"P": [1, 0]}}, "bounds.P"),
        ({"from_iteration": 3, "bounds": {"P": [-1, 1]}}, "variables"),
    ],
)
def test_an_invalid_fork_is_refused_by_field_and_nothing_is_stored(
    store: Store, job: Job, given: dict[str, Any], field: str
) -> None:
    with pytest.raises(InvalidRequest) as refused:
        service(store).fork(job.id, ForkRequest.model_validate(given))
    assert refused.value.field == field or str(refused.value).startswith(field)
    assert [found.id for found in store.jobs().items] == [job.id]


def test_a_fork_of_other_code_is_refused_unless_that_is_accepted(store: Store, job: Job) -> None:
    other = JobService(store, provenance=lambda _: HERE)
    with pytest.raises(ProvenanceChanged, match="other code of search and judgement"):
        other.fork(job.id, ForkRequest(from_iteration=2))
    forked, _ = other.fork(job.id, ForkRequest(from_iteration=2, accept_changes=True))
    assert forked.accepts_changes
    assert forked.provenance == job.provenance[:1]


def test_a_job_of_failed_designs_has_nothing_to_start_from(
    store: Store, job: Job, database: Path
) -> None:
    edit(database, "UPDATE evaluations SET fitness = 9e999")
    with pytest.raises(Conflict, match="there is none to start from"):
        fork(store, job, 2, robot="szabadka2")


def test_the_same_key_makes_one_fork(store: Store, job: Job) -> None:
    request = ForkRequest(from_iteration=2)
    first, new = service(store).fork(job.id, request, idempotency_key="k")
    again, repeated = service(store).fork(job.id, request, idempotency_key="k")
    assert (new, repeated, again.id) == (True, False, first.id)


def test_rates_count_what_the_fork_has_walked_itself(store: Store, job: Job) -> None:
    forked = fork(store, job, 5)
    assert (forked.progress.compute_seconds, forked.progress.evaluations_walked) == (0.0, 0)
    assert time_left(forked, forked.created_at).evaluations_per_second is None
    done = run(store, forked)
    rate = time_left(done, done.updated_at).evaluations_per_second
    assert rate == pytest.approx(PARTICLES / done.progress.compute_seconds)
