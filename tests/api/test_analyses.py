"""Limited concurrency of analyses; other requests do not wait for them."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import httpx2

from gaitswarm.jobs.operation import OPERATIONS
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from tests.api.conftest import Commit, Serve

WHOLE_HISTORIES = {
    *("get_distribution", "get_particles", "rank_designs", "find_front"),
    *("get_importance", "compare_jobs", "list_convergences"),
    *("get_preference_for", "get_certificate", "get_targets", "get_parameters"),
    "get_evidence",
}


class Waiting(JobService):
    """Answers questions about whole histories when it is let to."""

    begun = threading.Event()
    go_on = threading.Event()

    def columns(self, job: Job) -> EvaluationColumns:
        self.begun.set()
        assert self.go_on.wait(20.0)
        return super().columns(job)


def test_analyses_wait_for_capacity_and_are_rejected_when_the_queue_is_full(
    serve: Serve, service: JobService, job: Job, commit: Commit
) -> None:
    commit(job, 2)
    waiting = Waiting(service.store)
    waiting.begun.clear()
    waiting.go_on.clear()
    server = serve(waiting, api_compute_workers=1, api_compute_queue=1)
    path = f"{server.url}/v1/jobs/{job.id}/distribution"

    def ask() -> int:
        return httpx2.get(path, timeout=20.0, verify=False).status_code

    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(ask)
        assert waiting.begun.wait(20.0)
        second = threads.submit(ask)
        try:
            refused = None
            for _ in range(200):
                # Until the second one has come to wait, this one takes its place.
                try:
                    refused = httpx2.get(path, timeout=0.2, verify=False)
                    break
                except httpx2.ReadTimeout:
                    continue
            assert refused is not None
            assert refused.status_code == 503
            assert "too many requests" in refused.json()["detail"]
            assert refused.headers["Retry-After"]
            # Others are answered at once: no thread of theirs, and no event loop, is taken.
            for other in ("/v1/healthz", "/v1/jobs", f"/v1/jobs/{job.id}"):
                assert server.client.get(other).status_code == 200
        finally:
            waiting.go_on.set()
        assert first.result() == 200
        assert second.result() in (200, 503)


def test_operations_that_read_whole_histories_are_limited() -> None:
    assert {operation.id for operation in OPERATIONS if operation.heavy} >= WHOLE_HISTORIES
