"""A job whose spec this version cannot read, over HTTP: it is shown with its reason."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import httpx2
import pytest

from gaitswarm.services.optimizer.errors import Unreadable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.views.job import JobView
from tests.api.conftest import Commit

pytestmark = pytest.mark.slow


@pytest.fixture
def unreadable(store: Store, database: Path, job: Job, commit: Commit) -> Job:
    """A job that has committed two iterations, and was then set aside."""
    commit(job, 2)
    with closing(sqlite3.connect(database)) as connection, connection:
        connection.execute(
            "UPDATE jobs SET lease_expires_at = NULL,"
            " spec = json_set(spec, '$.schema_version', 99) WHERE id = ?",
            (job.id,),
        )
    assert store.claim("runner", lease_seconds=60.0) is None
    return store.job(job.id)


def test_it_is_listed_with_what_is_known_of_it(
    client: httpx2.Client, unreadable: Job, store: Store, spec: JobSpec
) -> None:
    sound, _ = store.create_job(spec)
    for query in ({}, {"order": "name"}, {"search": "small"}):
        items = client.get("/v1/jobs", params=query).json()["items"]
        assert {item["id"] for item in items} == {unreadable.id, sound.id}
    (listed,) = [item for item in items if item["id"] == unreadable.id]
    assert (listed["name"], listed["state"], listed["iterations"]) == ("small", "failed", 2)
    assert (listed["kind"], listed["controller"], listed["scenarios"]) == (None, None, [])
    assert (listed["particles"], listed["iterations_planned"]) == (4, 3)


def test_it_is_answered_with_its_reason_and_without_a_spec(
    client: httpx2.Client, unreadable: Job
) -> None:
    answer = client.get(f"/v1/jobs/{unreadable.id}")
    assert answer.status_code == 200
    view = answer.json()
    assert view["spec"] is view["best"] is None
    assert "schema_version" in view["error"] and "resume" in view["error"]
    assert set(view["links"]) == {"self", "cancel", "keep", "delete"}
    assert JobView.model_validate(view).model_dump(mode="json") == view
    with pytest.raises(Unreadable, match="schema_version"):
        _ = JobView.model_validate(view).spec


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "best", None),
        ("GET", "iterations/0/evaluations", None),
        ("GET", "export", None),
        ("GET", "distribution", None),
        ("GET", "particles", None),
        ("GET", "parameters", None),
        ("POST", "ranking", {"preference": "B"}),
        ("POST", "resume", None),
        ("POST", "extend", {"iterations": 9}),
    ],
)
def test_what_needs_the_spec_is_refused_with_the_reason(
    client: httpx2.Client, unreadable: Job, method: str, path: str, body: object
) -> None:
    answer = client.request(method, f"/v1/jobs/{unreadable.id}/{path}", json=body)
    assert answer.status_code == 409
    assert answer.json()["type"].endswith(":unreadable")
    assert "schema_version" in answer.json()["detail"]


def test_what_needs_no_spec_is_answered(client: httpx2.Client, unreadable: Job) -> None:
    here = f"/v1/jobs/{unreadable.id}"
    assert [i["index"] for i in client.get(f"{here}/iterations").json()["items"]] == [0, 1]
    events = client.get(f"{here}/events").text
    assert events.count("event: iteration") == 2 and "schema_version" in events
    assert client.post(f"{here}/cancel").json()["state"] == "cancelled"
