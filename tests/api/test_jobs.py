"""Jobs over HTTP: submit, list, look at, command."""

from __future__ import annotations

from collections.abc import Iterator

import httpx2
import pytest
from sqlalchemy import Engine, event

from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import Commit

pytestmark = pytest.mark.slow

SPEC = {"name": "mine", "scenarios": ["normal-fast", "2"], "iterations": 7, "seed": 3}


def test_a_submitted_job_is_accepted_and_found_at_its_location(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json=SPEC)

    assert answer.status_code == 202
    assert answer.json()["state"] == "queued"
    found = client.get(answer.headers["Location"])
    assert found.status_code == 200
    assert found.json()["id"] == answer.json()["id"]
    assert found.json()["spec"]["seed"] == 3


def test_presets_are_written_out_when_a_job_is_submitted(client: httpx2.Client) -> None:
    spec = client.post("/v1/jobs", json=SPEC).json()["spec"]

    assert [s["name"] for s in spec["scenarios"]] == ["normal-fast", "normal-slow"]
    assert spec["scenarios"][1]["cycle_time"] == 2.2
    assert spec["preference"]["exponent"] == [0.1, 0.7, 0.3, 0.3, 0.1]


def test_the_same_key_and_body_make_one_job(client: httpx2.Client, store: Store) -> None:
    first = client.post("/v1/jobs", json=SPEC, headers={"Idempotency-Key": "k1"})
    again = client.post("/v1/jobs", json=SPEC, headers={"Idempotency-Key": "k1"})

    assert (first.status_code, again.status_code) == (202, 200)
    assert again.json()["id"] == first.json()["id"]
    assert again.headers["Location"] == first.headers["Location"]
    assert len(store.jobs().items) == 1


def test_a_repeated_request_is_the_same_after_its_preference_has_changed(
    client: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = {**SPEC, "preference": "A"}
    first = client.post("/v1/jobs", json=request, headers={"Idempotency-Key": "k1"})
    monkeypatch.setitem(PREFERENCES, "A", PREFERENCES["B"])
    again = client.post("/v1/jobs", json=request, headers={"Idempotency-Key": "k1"})

    assert (first.status_code, again.status_code) == (202, 200)
    assert again.json()["id"] == first.json()["id"]


def test_the_same_key_with_another_body_is_a_conflict(client: httpx2.Client, store: Store) -> None:
    client.post("/v1/jobs", json=SPEC, headers={"Idempotency-Key": "k1"})
    other = client.post("/v1/jobs", json={**SPEC, "seed": 4}, headers={"Idempotency-Key": "k1"})

    assert other.status_code == 409
    assert other.json()["type"] == "urn:gaitswarm:problem:idempotency-conflict"
    assert len(store.jobs().items) == 1


def test_progress_rates_and_estimate_follow_from_committed_iterations(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 2)

    view = client.get(f"/v1/jobs/{job.id}").json()

    assert view["state"] == "running"
    assert (view["iterations"], view["iterations_planned"]) == (2, 3)
    assert (view["evaluations"], view["evaluations_planned"]) == (8, 12)
    assert view["compute_seconds"] == 1.0
    assert view["evaluations_per_second"] == 8.0
    assert view["simulations_per_second"] == 16.0
    assert 0.0 <= view["eta_seconds"] <= 0.5
    assert view["eta_basis"].startswith("at the pace of the last iterations")
    assert view["best_fitness"] == view["best"]["fitness"] == 100.0


def test_a_job_that_has_not_begun_has_no_estimate_and_no_best(
    client: httpx2.Client, job: Job
) -> None:
    view = client.get(f"/v1/jobs/{job.id}").json()

    assert view["iterations"] == view["evaluations"] == 0
    assert view["best"] is view["eta_seconds"] is view["evaluations_per_second"] is None
    assert view["eta_basis"] == "unknown: the job is queued"


def test_a_failed_job_says_why(client: httpx2.Client, store: Store, job: Job) -> None:
    claim = store.claim("test", lease_seconds=60.0)
    assert claim is not None
    store.release(claim, JobState.FAILED, error="the robot's legs came off")

    view = client.get(f"/v1/jobs/{job.id}").json()

    assert view["state"] == "failed"
    assert view["error"] == "the robot's legs came off"
    assert "resume" in view["links"]


def test_an_unknown_job_is_not_found(client: httpx2.Client) -> None:
    answer = client.get("/v1/jobs/bcdfghjkmnpq")

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert "bcdfghjkmnpq" in answer.json()["detail"]
    assert answer.json()["instance"] == "/v1/jobs/bcdfghjkmnpq"


def test_pages_list_every_job_once_newest_first(
    client: httpx2.Client, store: Store, spec: JobSpec
) -> None:
    made = [store.create_job(spec)[0].id for _ in range(7)]

    listed, after = [], None
    while True:
        query = {"limit": 3} | ({"after": after} if after else {})
        page = client.get("/v1/jobs", params=query).json()
        listed += [item["id"] for item in page["items"]]
        after = page["next"]
        if after is None:
            break

    assert listed == made[::-1]


def test_jobs_are_listed_by_state(client: httpx2.Client, store: Store, spec: JobSpec) -> None:
    kept, dropped = (store.create_job(spec)[0].id for _ in range(2))
    client.post(f"/v1/jobs/{dropped}/cancel")

    def ids(state: str) -> list[str]:
        answer = client.get("/v1/jobs", params={"state": state})
        return [item["id"] for item in answer.json()["items"]]

    assert ids("queued") == [kept]
    assert ids("cancelled") == [dropped]
    assert ids("failed") == []


@pytest.fixture
def statements() -> Iterator[list[str]]:
    """First words of what is sent to any database while a test runs."""
    sent: list[str] = []

    def note(connection: object, cursor: object, statement: str, *_: object) -> None:
        sent.append(statement.split(maxsplit=1)[0])

    event.listen(Engine, "before_cursor_execute", note)
    yield sent
    event.remove(Engine, "before_cursor_execute", note)


def test_a_page_of_jobs_takes_one_query(
    client: httpx2.Client, store: Store, spec: JobSpec, statements: list[str]
) -> None:
    for _ in range(20):
        store.create_job(spec)
    statements.clear()

    assert len(client.get("/v1/jobs").json()["items"]) == 20
    assert statements == ["BEGIN", "SELECT"]


def test_pausing_and_resuming_a_queued_job(client: httpx2.Client, job: Job) -> None:
    paused = client.post(f"/v1/jobs/{job.id}/pause")
    assert (paused.status_code, paused.json()["state"]) == (202, "paused")
    assert "resume" in paused.json()["links"]

    resumed = client.post(f"/v1/jobs/{job.id}/resume")
    assert (resumed.status_code, resumed.json()["state"]) == (202, "queued")


def test_a_running_job_is_pausing_until_its_iteration_is_committed(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    claim = commit(job, 1)

    assert client.post(f"/v1/jobs/{job.id}/pause").json()["state"] == "pausing"
    commit(job, 1, claim=claim)
    assert client.get(f"/v1/jobs/{job.id}").json()["state"] == "paused"


def test_a_second_pause_is_a_conflict_that_names_the_way_out(
    client: httpx2.Client, job: Job
) -> None:
    client.post(f"/v1/jobs/{job.id}/pause")

    answer = client.post(f"/v1/jobs/{job.id}/pause")

    assert answer.status_code == 409
    assert "resume" in answer.json()["detail"]
    assert client.get(f"/v1/jobs/{job.id}").json()["state"] == "paused"


def test_a_job_shows_what_its_numbers_depend_on_since_which_iteration(
    client: httpx2.Client,
) -> None:
    job = client.post("/v1/jobs", json=SPEC).json()

    (record,) = job["provenance"]
    assert record["from_iteration"] == 0
    assert record["provenance"] == job_provenance(JobSpec(**SPEC)).model_dump(mode="json")
    assert client.get(f"/v1/jobs/{job['id']}").json()["provenance"] == job["provenance"]


@pytest.mark.parametrize("body", [None, {}, {"accept_changes": False}, {"accept_changes": True}])
def test_changes_are_accepted_only_by_a_body_that_says_so(
    client: httpx2.Client, store: Store, job: Job, body: dict[str, bool] | None
) -> None:
    client.post(f"/v1/jobs/{job.id}/pause")
    resumed = client.post(f"/v1/jobs/{job.id}/resume", json=body)

    assert (resumed.status_code, resumed.json()["state"]) == (202, "queued")
    assert store.job(job.id).accepts_changes is (body == {"accept_changes": True})


def test_an_unknown_field_of_a_resumption_is_named(client: httpx2.Client, job: Job) -> None:
    client.post(f"/v1/jobs/{job.id}/pause")
    refused = client.post(f"/v1/jobs/{job.id}/resume", json={"accept": True})

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "accept"
    assert client.get(f"/v1/jobs/{job.id}").json()["state"] == "paused"


@pytest.mark.parametrize("command", ["pause", "resume", "cancel"])
def test_nothing_can_be_asked_of_a_cancelled_job(
    client: httpx2.Client, job: Job, command: str
) -> None:
    assert client.post(f"/v1/jobs/{job.id}/cancel").json()["state"] == "cancelled"

    answer = client.post(f"/v1/jobs/{job.id}/{command}")

    assert answer.status_code == 409
    assert "cancelled" in answer.json()["detail"]


def test_links_lead_to_the_allowed_commands(client: httpx2.Client, job: Job) -> None:
    links = client.get(f"/v1/jobs/{job.id}").json()["links"]

    assert set(links) == {"self", "pause", "cancel", "extend", "keep", "priority"}
    assert client.post(links["pause"]).status_code == 202


def test_a_summary_says_what_the_job_is(client: httpx2.Client, job: Job) -> None:
    (item,) = client.get("/v1/jobs").json()["items"]

    assert (item["kind"], item["controller"], item["particles"]) == ("tuning", "fuzzy-pi", 4)
    assert item["scenarios"] == ["normal-fast", "turn-right-fast"]


def test_the_list_is_searched_and_sorted(client: httpx2.Client) -> None:
    for name in ("b walk", "other", "A Walk"):
        client.post("/v1/jobs", json={**SPEC, "name": name})

    def names(**parameters: str) -> list[str]:
        return [j["name"] for j in client.get("/v1/jobs", params=parameters).json()["items"]]

    assert names(search="WALK") == ["A Walk", "b walk"]
    assert names(order="name") == ["A Walk", "b walk", "other"]
    refused = client.get("/v1/jobs", params={"order": "age"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "order"


def test_a_job_that_succeeded_is_extended_and_queued_again(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    link = client.get(f"/v1/jobs/{job.id}").json()["links"]["extend"]

    answer = client.post(link, json={"iterations": 5})

    assert answer.status_code == 202
    view = answer.json()
    assert (view["state"], view["iterations"], view["iterations_planned"]) == ("queued", 3, 5)
    assert view["finished_at"] is None


@pytest.mark.parametrize("iterations", [0, 3, 1_000_001, "many"])
def test_a_budget_that_makes_no_sense_is_refused_by_name(
    client: httpx2.Client, job: Job, commit: Commit, iterations: object
) -> None:
    commit(job, 3)

    answer = client.post(f"/v1/jobs/{job.id}/extend", json={"iterations": iterations})

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "iterations"


def test_a_job_has_a_priority_which_its_link_changes(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json=SPEC, headers={"Job-Priority": "-4"})
    assert answer.json()["priority"] == -4
    link = answer.json()["links"]["priority"]

    changed = client.put(link, json={"priority": 6})

    assert (changed.status_code, changed.json()["priority"]) == (200, 6)
    assert client.get("/v1/jobs").json()["items"][0]["priority"] == 6
    client.post(answer.json()["links"]["cancel"])
    ended = client.put(link, json={"priority": 0})
    assert ended.status_code == 409 and "it has ended" in ended.json()["detail"]


@pytest.mark.parametrize("priority", [11, -11, 0.5, "many", None])
def test_what_is_no_priority_is_refused_by_name(
    client: httpx2.Client, job: Job, priority: object
) -> None:
    refused = client.put(f"/v1/jobs/{job.id}/priority", json={"priority": priority})
    assert refused.status_code == 422
    assert [error["field"] for error in refused.json()["errors"]] == ["priority"]

    refused = client.post("/v1/jobs", json=SPEC, headers={"Job-Priority": str(priority)})
    assert refused.status_code == 422
    assert [error["field"] for error in refused.json()["errors"]] == ["Job-Priority"]


def test_a_cancelled_job_cannot_be_extended(client: httpx2.Client, job: Job) -> None:
    view = client.post(f"/v1/jobs/{job.id}/cancel").json()

    assert "extend" not in view["links"]
    answer = client.post(f"/v1/jobs/{job.id}/extend", json={"iterations": 9})
    assert answer.status_code == 409
    assert "cancelled" in answer.json()["detail"]
