"""Answers that are remembered: the same as those that are not, and never older than the job."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx2
import pytest

from gaitswarm.api.answers import Answers
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.access import Scope
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.store.sql_store import SqlStore
from gaitswarm.views import (
    BestView,
    CatalogueView,
    EvaluationView,
    IterationView,
    JobSummaryView,
    JobView,
    PageView,
    evaluation_views,
)
from tests.api.conftest import Commit, Serve
from tests.store.test_job_reading import statements


def test_remembered_answers_are_the_views_byte_for_byte(
    client: httpx2.Client, store: SqlStore, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    ended, best = store.job(job.id), store.best(job.id)
    page = store.iterations(job.id, limit=2)
    listed = [IterationView.from_iteration(iteration) for iteration in page.items]
    designs = evaluation_views(store.evaluations(job.id, 1), ended.spec)
    assert best is not None
    here = f"/v1/jobs/{job.id}"
    expected = {
        "/v1/jobs": PageView[JobSummaryView](items=[JobSummaryView.from_job(ended)], next=None),
        here: JobView.from_job_and_best(ended, best),
        f"{here}/best": BestView.from_evaluation(best, ended.spec),
        f"{here}/iterations?limit=2": PageView[IterationView](items=listed, next=page.next),
        f"{here}/iterations/1/evaluations": CatalogueView[EvaluationView](items=designs),
    }
    for path, view in expected.items():
        for encoding in ("gzip", "identity", "gzip"):
            answer = client.get(path, headers={"Accept-Encoding": encoding})
            assert answer.content == view.model_dump_json(by_alias=True).encode(), path
            assert answer.headers["content-type"] == "application/json"
            if len(answer.content) >= 1024:
                assert answer.headers["vary"] == "Accept-Encoding"
                assert answer.headers.get("content-encoding", "identity") == encoding


def test_a_remembered_job_is_read_anew_whatever_changes(
    client: httpx2.Client, store: SqlStore, job: Job, commit: Commit
) -> None:
    here = f"/v1/jobs/{job.id}"

    def told() -> list[dict[str, Any]]:
        shared = JobSummaryView.model_fields
        (listed,), full = client.get("/v1/jobs").json()["items"], client.get(here).json()
        (found,) = client.get("/v1/jobs", params={"search": job.id}).json()["items"]
        assert listed == {name: full[name] for name in shared} == found
        return [listed, full]

    changes: list[Callable[[], object]] = [
        lambda: store.command(job.id, Command.PAUSE),
        lambda: store.label(job.id, LabelsChange(note="look here", tags=("thesis",))),
        lambda: store.label(job.id, LabelsChange(name="renamed")),
        lambda: store.keep(job.id, True),
        lambda: store.prioritize(job.id, 3),
        lambda: store.extend(job.id, 4),
        lambda: store.command(job.id, Command.RESUME),
        lambda: commit(job, 3),
    ]
    before = told()
    assert told() == before
    for number, change in enumerate(changes):
        change()
        after = told()
        assert after[0] != before[0], number
        before = after
    assert before[1]["name"] == "renamed" and before[1]["best"]["fitness"] == 99.0
    assert client.get(f"{here}/best").json()["fitness"] == 99.0


def test_pages_of_a_job_that_goes_on_grow(client: httpx2.Client, job: Job, commit: Commit) -> None:
    here = f"/v1/jobs/{job.id}/iterations"

    def listed(**query: int) -> tuple[list[int], str | None]:
        page = client.get(here, params=query).json()
        return [item["index"] for item in page["items"]], page["next"]

    claim = commit(job, 1)
    assert listed() == ([0], None) == listed(limit=1)
    commit(job, 1, claim=claim)
    assert (listed(), listed(limit=1)) == (([0, 1], None), ([0], "0"))
    commit(job, 1, claim=claim)
    assert (listed(), listed(limit=1)) == (([0, 1, 2], None), ([0], "0"))
    assert listed(after=1, limit=1) == ([2], None)


def test_nothing_is_remembered_for_those_who_may_not_ask_or_of_a_job_that_is_gone(
    serve: Serve, store: SqlStore, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    client = serve(api_access="token").client
    secret = store.tokens.create("reader", Scope.READ)[1]
    header = {"Authorization": f"Bearer {secret}"}
    here = f"/v1/jobs/{job.id}"
    paths = (here, f"{here}/best", f"{here}/iterations?limit=1", f"{here}/iterations/0/evaluations")
    for path in ("/v1/jobs", *paths):
        assert client.get(path, headers=header).status_code == 200
        assert client.get(path).status_code == 401
    store.delete_job(job.id)
    for path in paths:
        assert client.get(path, headers=header).status_code == 404, path


@pytest.mark.parametrize("length", [200, 2000])
def test_answers_that_were_asked_for_longest_ago_are_forgotten_first(length: int) -> None:
    answers, made = Answers(largest=3 * (length + 500)), list[str]()

    def ask(key: str) -> None:
        answers.of_history(key, lambda: made.append(key) or b"x" * length)  # type: ignore[func-returns-value]

    for key in ("a", "b", "c", "a", "d", "a", "b"):
        ask(key)
    assert made == ["a", "b", "c", "d", "b"]
    assert answers.size == 3 * (length + 500)


def test_a_job_is_told_by_its_own_object(store: SqlStore, spec: JobSpec) -> None:
    answers = Answers()
    jobs = [store.job(store.create_job(spec)[0].id) for _ in range(3)]
    told = [answers.of_job("id", job, job.id.encode).plain.decode() for job in (*jobs, *jobs)]
    assert told == [job.id for job in (*jobs, *jobs)]
    assert answers.of_job("id", store.job(jobs[0].id), lambda: b"anew").plain != b"anew"


def test_the_short_way_answers_as_the_routes_do(
    client: httpx2.Client, store: SqlStore, job: Job, spec: JobSpec, commit: Commit
) -> None:
    commit(job, 3)
    waiting = store.create_job(spec)[0]
    paths = [
        *("/v1/jobs", "/v1/jobs?limit=1", "/v1/jobs?order=name&search=small&archived=false"),
        *("/v1/jobs?limit=0", "/v1/jobs?limit=x", "/v1/jobs?after=", "/v1/jobs?after=none"),
        *("/v1/jobs?state=queued", "/v1/jobs?state=", "/v1/jobs?limit=1&limit=2", "/v1/jobs?x=%00"),
        *(f"/v1/jobs?search={'a' * length}" for length in (200, 201)),
    ]
    for one in (job.id, waiting.id, "b" * 12, "b" * 65):
        here = f"/v1/jobs/{one}"
        paths += [here, f"{here}/best", f"{here}/iterations"]
        paths += [f"{here}/iterations?after=0&limit=1", f"{here}/iterations?after=-1&limit=1001"]
        paths += [f"{here}/iterations/{index}/evaluations" for index in ("1", "01", "9", "x", "-1")]
    for path in paths:
        # A parameter that there is not takes the long way, and changes nothing.
        long_way = f"{path}{'&' if '?' in path else '?'}unknown=1"
        for encoding in ("gzip", "identity"):
            accepted = {"Accept-Encoding": encoding}
            short, long = (client.get(p, headers=accepted) for p in (path, long_way))
            assert (short.status_code, short.content) == (long.status_code, long.content), path
            for answer in (short, long):
                for header in ("date", "x-request-id"):
                    del answer.headers[header]
            assert short.headers == long.headers, path


def test_the_short_way_is_counted_under_the_same_routes(
    serve: Serve, store: SqlStore, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    metrics = Metrics()
    server = serve(metrics=metrics)
    here = f"/v1/jobs/{job.id}"
    paths = ("/v1/jobs", here, f"{here}/best", f"{here}/iterations")
    for path in (*paths, f"{here}/iterations/0/evaluations"):
        for query in ("", "?unknown=1"):
            assert server.client.get(f"{path}{query}").status_code == 200
    found = {
        sample.labels["route"]: sample.value
        for metric in metrics.http_requests.collect()
        for sample in metric.samples
        if sample.name.endswith("_total")
    }
    assert len(found) == 5 and set(found.values()) == {2.0}, found


def test_what_is_asked_again_is_neither_read_by_statements_nor_made_anew(
    client: httpx2.Client, store: SqlStore, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    here = f"/v1/jobs/{job.id}"
    paths = [
        *("/v1/jobs", "/v1/jobs?search=small", here, f"{here}/best"),
        *(f"{here}/iterations?limit=1", f"{here}/iterations/0/evaluations"),
    ]
    before = [client.get(path).content for path in paths]
    with statements() as sent:
        assert [client.get(path).content for path in paths] == before
    assert sent == []
    store.label(job.id, LabelsChange(note="look here"))
    with statements() as sent:
        after = [client.get(path).content for path in paths]
    assert [a != b for a, b in zip(after, before, strict=True)] == [True] * 3 + [False] * 3
    assert sent


def test_a_list_with_a_job_that_runs_is_read_anew(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    client.get("/v1/jobs")
    with statements() as sent:
        client.get("/v1/jobs")
    assert sent
