"""Metrics: named as Prometheus wants them, without labels that grow, and true of a real job."""

from __future__ import annotations

import re
from contextlib import closing
from pathlib import Path

import pytest

from gaitswarm.services.monitoring.metrics import Metrics, QueueCollector
from gaitswarm.services.optimizer.errors import LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.worker.dispatch import Chunk, killed_workers
from gaitswarm.sim.outcome import Status
from tests.examples.processes import eventually
from tests.examples.servers import Server
from tests.monitoring.scraped import Scrape, of, scraped
from tests.optimizer.formula import HERE, SPEC, FormulaEvaluator
from tests.store.examples import Clock
from tests.worker.requests import request

WALKS = 6
"""Of SMALL_SPEC: three designs, two iterations, one scenario of a second."""

LABELS = {
    *("state", "kind", "status", "cause", "operation", "method", "route", "workers", "version"),
    "le",
}
"""Each has as many values as the code has words for it, whatever users do."""


def test_names_contain_the_unit(walked: tuple[str, Scrape]) -> None:
    own = [f for f in walked[1].families if not f.name.startswith("process_")]
    assert len(own) > 15
    for family in own:
        assert re.fullmatch(r"gaitswarm(_[a-z]+)+", family.name), family.name
        assert family.documentation, family.name
        assert family.type != "unknown", family.name
        if family.type == "counter":
            assert {s.name for s in family.samples} <= {f"{family.name}_total"}
        else:
            assert not family.name.endswith(("_total", "_count")), family.name
        if family.type == "histogram":
            assert family.name.endswith("_seconds")
        assert not re.search(r"_(ms|milliseconds|minutes|kb|mb)(_|$)", family.name)


def test_no_label_grows_with_jobs_paths_or_people(walked: tuple[str, Scrape]) -> None:
    job_id, scrape = walked
    for family in scrape.families:
        for sample in family.samples:
            assert set(sample.labels) <= LABELS, sample
            assert job_id not in str(sample.labels)
    routes = {labels["route"] for labels in scrape.labels("gaitswarm_http_requests_total")}
    assert {"/v1/jobs", "/v1/jobs/{job_id}/events", "none"} <= routes


def test_counters_match_a_finished_job(walked: tuple[str, Scrape]) -> None:
    scrape = walked[1]
    assert scrape.value("gaitswarm_iterations_committed_total", kind="tuning") == 2
    assert scrape.value("gaitswarm_jobs_ended_total", kind="tuning", state="succeeded") == 1
    walks = {
        labels["status"]: scrape.value("gaitswarm_walks_total", **labels)
        for labels in scrape.labels("gaitswarm_walks_total")
    }
    assert set(walks) == {status.label for status in Status}
    assert sum(walks.values()) == WALKS
    assert scrape.value("gaitswarm_simulated_seconds_total") == pytest.approx(WALKS * 1.0)
    assert scrape.value("gaitswarm_iteration_evaluation_seconds_count") == 2
    commits = "gaitswarm_database_operation_duration_seconds"
    assert scrape.value(f"{commits}_count", operation="commit") == 2
    assert scrape.value(f"{commits}_sum", operation="commit") > 0
    assert scrape.value("gaitswarm_worker_slots", workers="threads") == 1
    assert scrape.value("gaitswarm_worker_slots_used", workers="threads") == 0
    assert scrape.value("gaitswarm_worker_tasks_waiting", workers="threads") == 0
    asked = {"method": "POST", "route": "/v1/jobs"}
    assert scrape.value("gaitswarm_http_requests_total", status="202", **asked) == 1
    assert scrape.value("gaitswarm_http_request_duration_seconds_count", **asked) == 1


def test_a_stream_records_the_lag_of_its_events(
    walked: tuple[str, Scrape],
) -> None:
    scrape = walked[1]
    assert scrape.value("gaitswarm_event_stream_lag_seconds_count") == 2
    assert scrape.value("gaitswarm_event_stream_lag_seconds_sum") < 2 * 10.0


def test_streams_count_while_they_are_open(service: JobService, store: Store) -> None:
    job, _ = store.create_job(SPEC)
    metrics = Metrics()
    server = Server(service, metrics=metrics)
    try:
        with server.client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
            # The stream ends with the last reference to its lines.
            lines = answer.iter_lines()
            # Before its first event, a stream may send a comment.
            assert any(line.startswith("event:") for line in lines)
            assert of(metrics).value("gaitswarm_event_streams") == 1
            del lines
        eventually(lambda: of(metrics).value("gaitswarm_event_streams") == 0)
    finally:
        server.close()


@pytest.fixture
def service(store: Store) -> JobService:
    return JobService(store)


def test_the_queue_is_counted_by_state_and_kind_on_request(
    service: JobService, store: Store
) -> None:
    paused = store.create_job(SPEC)[0]
    store.create_job(SPEC)
    cancelled = store.create_job(SPEC)[0]
    store.command(paused.id, Command.PAUSE)
    store.command(cancelled.id, Command.CANCEL)
    server = Server(service)
    try:
        scrape = scraped(server.client)
    finally:
        server.close()
    found = {
        (labels["state"], labels["kind"]): scrape.value("gaitswarm_queue_jobs", **labels)
        for labels in scrape.labels("gaitswarm_queue_jobs")
    }
    assert found == {("queued", "tuning"): 1, ("paused", "tuning"): 1}
    assert scrape.value("gaitswarm_jobs", state="cancelled") == 1
    assert scrape.value("gaitswarm_jobs", state="failed") == 0
    assert {labels["state"] for labels in scrape.labels("gaitswarm_jobs")} == set(JobState)
    assert scrape.value("gaitswarm_database_up") == 1


def test_the_longest_wait_is_that_of_the_job_queued_first(database: Path) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    assert store.queue().longest_wait == 0.0
    store.create_job(SPEC)
    clock.advance(40.0)
    store.create_job(SPEC)
    clock.advance(2.0)
    assert store.queue().longest_wait == 42.0
    store.close()


def test_a_lease_that_is_taken_over_counts_once_on_either_side(database: Path) -> None:
    clock, loser, winner = Clock(), Metrics(), Metrics()
    slow, quick = (open_store(str(database), clock=clock) for _ in range(2))
    slow.observers.append(loser)
    quick.observers.append(winner)
    slow.create_job(SPEC)
    late = slow.claim("late", lease_seconds=30.0)
    assert late is not None
    clock.advance(31.0)
    taken = quick.claim("other", lease_seconds=30.0)
    assert taken is not None and taken.taken_from == "late"
    for _ in range(3):
        with pytest.raises(LeaseLost):
            slow.renew(late, lease_seconds=30.0)
    with pytest.raises(LeaseLost):
        slow.release(late, JobState.QUEUED)
    assert of(loser).value("gaitswarm_lease_losses_total") == 1
    assert of(winner).value("gaitswarm_lease_takeovers_total") == 1
    assert of(winner).value("gaitswarm_lease_losses_total") == 0
    # A cancellation is no takeover.
    quick.command(taken.job.id, Command.CANCEL)
    with pytest.raises(LeaseLost):
        quick.renew(taken, lease_seconds=30.0)
    assert of(winner).value("gaitswarm_lease_losses_total") == 0
    assert of(winner).value("gaitswarm_jobs_ended_total", state="cancelled", kind="tuning") == 1
    slow.close()
    quick.close()


@pytest.mark.parametrize(
    ("cause", "error", "provenance"),
    [
        ("simulation", ZeroDivisionError("of the test"), HERE),
        ("internal", None, None),
        ("killed_worker", killed_workers(request(2), Chunk((0,), 0, 1, 1.0)), HERE),
        ("provenance", None, HERE.model_copy(update={"optimizer_digest": "another"})),
    ],
)
def test_failed_jobs_are_counted_by_cause(
    store: Store, cause: str, error: Exception | None, provenance: JobProvenance | None
) -> None:
    def computed(_spec: object) -> JobProvenance:
        if provenance is None:
            raise ZeroDivisionError("of the test")
        return provenance

    metrics = Metrics()
    store.observers.append(metrics)
    store.create_job(SPEC, provenance=HERE)
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    evaluator = FormulaEvaluator([error])
    failed = run_claim(claim, RunContext(store, evaluator, provenance=computed))
    assert failed.state is JobState.FAILED
    assert of(metrics).value("gaitswarm_job_failures_total", cause=cause) == 1
    assert of(metrics).value("gaitswarm_jobs_ended_total", state="failed", kind="tuning") == 1
    metrics.registry.register(QueueCollector(lambda: store))
    assert of(metrics).value("gaitswarm_failed_jobs", cause=cause) == 1


def test_quarantined_jobs_are_counted_among_the_failed_ones(database: Path) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    store.create_job(SPEC)
    assert store.claim("one", lease_seconds=30.0) is not None
    clock.advance(31.0)
    assert store.claim("two", lease_seconds=30.0, quarantine_after=1) is None
    metrics = Metrics()
    metrics.registry.register(QueueCollector(lambda: store))
    assert of(metrics).value("gaitswarm_failed_jobs", cause="quarantine") == 1
    store.close()


def test_operations_without_a_database_are_counted(database: Path) -> None:
    metrics = Metrics()
    with closing(open_store(str(database))) as store:
        store.observers.append(metrics)
        store.create_job(SPEC)
        database.unlink()
        with pytest.raises(StoreUnavailable):
            store.create_job(SPEC)
    assert of(metrics).value("gaitswarm_database_errors_total", operation="create_job") == 1
    seconds = "gaitswarm_database_operation_duration_seconds_count"
    assert of(metrics).value(seconds, operation="create_job") == 2
