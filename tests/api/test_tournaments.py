"""Tournaments over HTTP: listed, judged, shown problem by problem."""

from __future__ import annotations

import httpx2

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.service import JobService
from tests.tournament.examples import entrant, submitted


def test_a_tournament_is_found_and_judged_by_any_of_its_jobs(
    client: httpx2.Client, service: JobService
) -> None:
    assert client.get("/v1/tournaments").json() == {"items": []}
    first = submitted(service, entrant("pso", "pso"), [1e-4, 0.2])
    second = submitted(service, entrant("random", "random"), [0.5, 0.6])

    (listed,) = client.get("/v1/tournaments").json()["items"]
    assert (listed["id"], listed["evaluations"]) == (first.id, 40)
    assert [e["job"] for e in listed["entrants"]] == [first.id, second.id]

    found = client.get(f"/v1/tournaments/{second.id}").json()
    assert found["tournament"] == listed
    assert {m: rank["value"] for m, rank in found["mean_ranks"].items()} == {
        "pso": 1.0,
        "random": 2.0,
    }
    told = found["problems"]["D7C0R1I1"]["methods"]
    assert told["pso"]["expected_running_time"]["value"] == 50.0
    assert told["random"]["expected_running_time"]["value"] is None
    assert [profile["precision"] for profile in found["profiles"]] == [0.1, 0.001]

    runs = client.get(f"/v1/tournaments/{first.id}/problems/D7C0R1I1").json()
    assert runs["checkpoints"] == [1, 10, 40]
    assert runs["methods"]["random"]["best"] == [0.5, 0.6]
    assert runs["methods"]["pso"]["solved_after"] == [10.0, None]


def test_what_there_is_not_is_a_problem_that_says_so(
    client: httpx2.Client, service: JobService
) -> None:
    waiting = submitted(service, entrant("pso", "pso"))
    tuning, _ = service.submit(JobSpec(controller="pi"))
    for path, status, words in (
        (f"/{waiting.id}", 409, "has ended yet"),
        (f"/{waiting.id}/problems/D7C0R1I1", 409, "has ended yet"),
        (f"/{waiting.id}/problems/D9", 404, "it has D4C1R0I1, D7C0R1I1"),
        ("/nosuchjob", 404, "nosuchjob"),
        (f"/{tuning.id}", 422, "is of kind tuning"),
        (f"/{waiting.id}?compare_with={tuning.id}", 422, "is of kind tuning"),
    ):
        answer = client.get(f"/v1/tournaments{path}")
        assert (answer.status_code, path) == (status, path)
        assert words in answer.json()["detail"]
