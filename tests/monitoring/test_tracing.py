"""Spans of a real job: who is whose parent, what they say, and that they cost nothing when off."""

from __future__ import annotations

from pathlib import Path

import pytest
from opentelemetry.sdk.trace import ReadableSpan
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode

from gaitswarm.services.monitoring.tracing import Tracing
from gaitswarm.services.optimizer.errors import LeaseLost
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import ObservedEvaluator, open_runtime
from tests.examples.jobs import SMALL_SPEC
from tests.examples.processes import eventually, loaded_by
from tests.optimizer.formula import HERE, SPEC, FormulaEvaluator


@pytest.fixture
def exporter() -> InMemorySpanExporter:
    return InMemorySpanExporter()


@pytest.fixture
def tracing(exporter: InMemorySpanExporter) -> Tracing:
    return Tracing(SimpleSpanProcessor(exporter))


def named(exporter: InMemorySpanExporter, name: str) -> list[ReadableSpan]:
    return [span for span in exporter.get_finished_spans() if span.name == name]


def parent_of(span: ReadableSpan) -> int | None:
    return None if span.parent is None else span.parent.span_id


def id_of(span: ReadableSpan) -> int:
    context = span.get_span_context()
    assert context is not None
    return context.span_id


def test_a_job_has_its_iterations_and_these_their_tasks(
    database: Path, tracing: Tracing, exporter: InMemorySpanExporter
) -> None:
    with open_runtime(str(database), evaluator="in-process", cpus=1, tracing=tracing) as opened:
        store = opened.service.store
        job_id = store.create_job(SPECS.validate_python(SMALL_SPEC), owner="ann")[0].id
        eventually(lambda: bool(named(exporter, "job")))
        assert store.job(job_id).state is JobState.SUCCEEDED
    (job,) = named(exporter, "job")
    iterations, tasks = named(exporter, "iteration"), named(exporter, "task")
    assert job.parent is None
    assert job.attributes is not None
    assert job.attributes["gaitswarm.job.id"] == job_id
    assert job.attributes["gaitswarm.job.state"] == "succeeded"
    assert [parent_of(span) for span in iterations] == [id_of(job)] * 2
    assert [(span.attributes or {})["gaitswarm.iteration"] for span in iterations] == [0, 1]
    assert {parent_of(span) for span in tasks} == set(map(id_of, iterations))
    assert sum(int(str((s.attributes or {})["gaitswarm.task.walks"])) for s in tasks) == 6
    spans = exporter.get_finished_spans()
    assert {span.status.status_code for span in spans} == {StatusCode.UNSET}
    for inner in (*iterations, *tasks):
        (outer,) = [span for span in spans if id_of(span) == parent_of(inner)]
        assert (outer.start_time or 0) <= (inner.start_time or 0)
        assert (inner.end_time or 0) <= (outer.end_time or 0)
    assert "ann" not in "".join(span.to_json() for span in spans)
    assert job.resource.attributes["service.name"] == "gaitswarm"


def test_a_job_that_fails_and_its_iteration_say_why(
    store: Store, tracing: Tracing, exporter: InMemorySpanExporter
) -> None:
    store.observers.append(tracing)
    store.create_job(SPEC)
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    evaluator = ObservedEvaluator(
        FormulaEvaluator([None, ZeroDivisionError("of the test")]), tracing.observed
    )
    run_claim(claim, RunContext(store, evaluator, provenance=lambda _: HERE))
    (job,) = named(exporter, "job")
    first, second = named(exporter, "iteration")
    assert first.status.status_code is StatusCode.UNSET
    for span in (job, second):
        assert span.status.status_code is StatusCode.ERROR
        assert "ZeroDivisionError: of the test" in str(span.status.description)


def test_a_job_that_is_lost_ends_its_span(
    store: Store, tracing: Tracing, exporter: InMemorySpanExporter
) -> None:
    store.observers.append(tracing)
    job, _ = store.create_job(SPEC)
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    store.command(job.id, Command.CANCEL)
    with pytest.raises(LeaseLost):
        store.renew(claim, lease_seconds=30.0)
    (span,) = named(exporter, "job")
    assert span.status.status_code is StatusCode.ERROR
    assert (span.attributes or {})["gaitswarm.job.state"] == "lost"


@pytest.mark.slow
def test_nothing_is_imported_unless_a_collector_is_named(tmp_path: Path) -> None:
    database = str(tmp_path / "jobs.db")
    options = ["serve", "--db", database, "--port", "0", "--evaluator", "in-process"]
    served = (
        "from unittest.mock import patch\n"
        "from gaitswarm.cli.main import run\n"
        f"with patch('gaitswarm.api.server.ApiServer.run'): assert run({options!r}) == 0"
    )
    found = loaded_by(
        served, ["opentelemetry.sdk", "gaitswarm.services.monitoring.tracing", "sqlalchemy"]
    )
    assert found == {"sqlalchemy"}
