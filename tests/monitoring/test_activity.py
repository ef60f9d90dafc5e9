"""Activity of the jobs that a process runs: bounded, by job, and served over HTTP"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.services.monitoring import activity as kept
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.log_context import log_context
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, TaskReport
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import ObservedEvaluator
from gaitswarm.sim.outcome import Outcome
from tests.examples.servers import Server


class Worker:
    """An evaluator that reports given tasks, and fails if given an error."""

    slots = 1

    def __init__(self, *reports: TaskReport, error: Exception | None = None) -> None:
        self.reports, self.error = reports, error

    def evaluate(
        self, request: EvaluationRequest, _should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        for report in self.reports:
            assert request.on_task is not None
            request.on_task(report)
        if self.error is not None:
            raise self.error
        return ()

    def close(self) -> None: ...


@pytest.fixture(scope="module")
def request_() -> EvaluationRequest:
    provenance = job_provenance(JobSpec()).simulation
    return EvaluationRequest("job", (), np.zeros((3, 2)), provenance, iteration=4)


def test_iterations_tasks_and_workers_are_recorded(request_: EvaluationRequest) -> None:
    activity = Activity(clock=lambda: 1000.0)
    reports: list[TaskReport] = []
    good = TaskReport(24, 2.0, 1.5, "node-1")
    bad = TaskReport(24, 3.0, error="it died")
    watched = ObservedEvaluator(Worker(good, bad, good), activity.observed)
    watched.evaluate(replace(request_, on_task=reports.append), lambda: False)

    assert reports == [good, bad, good]
    found = activity.of("job")
    assert found is not None
    (iteration,) = found.iterations
    assert (iteration.iteration, iteration.designs, iteration.seconds) == (4, 3, 0.0)
    assert [(t.worker, t.begun_at.timestamp(), t.error) for t in found.tasks] == [
        ("node-1", 998.0, None),
        ("", 997.0, "it died"),
        ("node-1", 998.0, None),
    ]
    unanswered, node = found.workers.values()
    assert (node.name, node.tasks, node.walks, node.failures) == ("node-1", 2, 48, 0)
    assert (unanswered.name, unanswered.tasks, unanswered.walks, unanswered.failures) == (
        "",
        1,
        0,
        1,
    )
    assert unanswered.error == "it died"
    assert activity.of("other") is None


def test_an_iteration_that_fails_says_why(request_: EvaluationRequest) -> None:
    activity = Activity()
    watched = ObservedEvaluator(Worker(error=ValueError("no such robot")), activity.observed)
    with pytest.raises(ValueError, match="no such robot"):
        watched.evaluate(request_, lambda: False)
    found = activity.of("job")
    assert found is not None
    assert found.iterations[0].error == "ValueError: no such robot"


def test_records_are_bounded(request_: EvaluationRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "_JOBS", 2)
    activity = Activity()
    report = TaskReport(1, 0.1, 0.1, "node")
    for number in range(3):
        of_job = replace(request_, job_id=f"job {number}")
        for _ in range(2500):
            activity.task(of_job, report)
    assert activity.of("job 0") is None
    found = activity.of("job 2")
    assert found is not None
    assert (len(found.tasks), found.workers["node"].tasks) == (2000, 2500)


def test_only_messages_of_a_job_are_recorded() -> None:
    activity, log = Activity(), logging.getLogger("tests.activity")
    with activity.recorded_log():
        log.warning("of no job")
        with log_context(job="job", iteration=7):
            log.warning("node %s is slow", "x" * 5000)
    with log_context(job="job"):
        log.warning("later")
    found = activity.of("job")
    assert found is not None
    (message,) = found.messages
    assert (message.level, message.iteration) == ("WARNING", 7)
    assert message.text.startswith("node xxx") and len(message.text) == 2000


def test_a_server_returns_its_records_or_why_there_are_none(
    store: Store, request_: EvaluationRequest
) -> None:
    job, _ = store.create_job(JobSpec(iterations=2))
    activity = Activity()
    server = Server(JobService(store), activity=activity)
    try:
        client = server.client
        here = f"/v1/jobs/{job.id}/activity"
        assert "has not run the job" in client.get(here).json()["reason"]
        assert client.get("/v1/jobs/nowhere/activity").status_code == 404
        activity.task(replace(request_, job_id=job.id), TaskReport(5, 0.2, 0.1, "node"))
        with activity.recorded_log(), log_context(job=job.id):
            logging.getLogger("tests.activity").warning("slow")
            logging.getLogger("tests.activity").error("lost")
        found = client.get(here, params={"level": "ERROR"}).json()
        assert found["reason"] is None
        assert [task["worker"] for task in found["tasks"]] == ["node"]
        assert [message["text"] for message in found["messages"]] == ["lost"]
        assert client.get(here, params={"level": "LOUD"}).status_code == 422
    finally:
        server.close()
