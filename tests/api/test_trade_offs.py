"""Trade-offs over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.calibration import IdentificationSpec
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import Commit

pytestmark = pytest.mark.slow


def asked(client: httpx2.Client, job: Job, what: str, **parameters: Any) -> httpx2.Response:
    path = f"/v1/jobs/{job.id}/{what}"
    if what == "front":
        return client.post(path, json=parameters)
    return client.get(path, params=parameters)


def test_a_front_leaves_out_designs_that_failed_and_equal_ones(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 2)
    view = asked(client, job, "front").json()
    assert (view["designs_judged"], view["failed"], view["size"]) == (6, 2, 1)
    (design,) = view["designs"]
    assert (design["iteration"], design["particle"]) == (0, 1)
    assert list(design["objectives"].values()) == pytest.approx([11.0] * 5)
    assert set(design["normalised"].values()) == {0.0}
    assert design["marks"] == [
        *(f"least {objective['name']}" for objective in view["objectives"]),
        *(f"best under {name}" for name in "ABC"),
    ]
    # Alone it dominates the whole box.
    assert view["hypervolume"] == pytest.approx(1.0)
    assert [step["index"] for step in view["iterations"]] == [0, 1]
    assert view["reference"]["energy"] > view["nadir"]["energy"]


def test_a_running_job_has_a_front_that_continues(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    claim = commit(job, 1)
    assert len(asked(client, job, "front").json()["iterations"]) == 1
    commit(job, 1, claim=claim)
    assert len(asked(client, job, "front").json()["iterations"]) == 2


def test_a_design_that_is_dominated_gets_its_best_rank(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    view = asked(client, job, "preference-for", iteration=0, particle=3).json()
    assert (view["wins"], view["certain"], view["on_front"]) == (False, True, False)
    assert [fit["biases_of"] for fit in view["fits"]].count(["job", "A"]) == 1
    for fit in view["fits"]:
        assert fit["rank"] == 3
        assert fit["margin"] < 0.0
        assert (fit["rival"]["iteration"], fit["rival"]["particle"]) == (0, 1)
    first = asked(client, job, "preference-for", iteration=0, particle=1).json()
    assert (first["wins"], first["on_front"], first["fits"][0]["rank"]) == (True, True, 1)


@pytest.mark.parametrize(
    ("what", "parameters", "status", "said"),
    [
        ("front", {"most": 0}, 422, "most"),
        ("front", {"most": 10_001}, 422, "most"),
        ("front", {"constraints": ["sped>=1"]}, 422, "constraints.0.quantity"),
        ("front", {"constraints": ["speed>=1e9"]}, 409, "keeps the constraints"),
        ("preference-for", {"iteration": 0}, 422, "particle"),
        ("preference-for", {"iteration": 0, "particle": 4}, 404, "has no design 0.4"),
        ("preference-for", {"iteration": 0, "particle": 0}, 409, "fails in a scenario"),
    ],
)
def test_what_cannot_be_answered_is_a_problem(
    client: httpx2.Client,
    job: Job,
    commit: Commit,
    what: str,
    parameters: dict[str, Any],
    status: int,
    said: str,
) -> None:
    commit(job, 1)
    answer = asked(client, job, what, **parameters)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert said in answer.text


def test_a_job_of_which_every_design_failed_has_no_front(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1, failed=True)
    answer = asked(client, job, "front")
    assert answer.status_code == 409
    assert "has no design yet that succeeds in all scenarios" in answer.json()["detail"]


@pytest.mark.parametrize("what", ["front", "preference-for"])
def test_only_tunings_have_a_front(client: httpx2.Client, store: Store, what: str) -> None:
    spec = IdentificationSpec(
        kind="identification", recordings=("0" * 32,), variables=("battery_voltage",)
    )
    job, _ = store.create_job(spec)
    place = {} if what == "front" else {"iteration": 0, "particle": 0}
    answer = asked(client, job, what, **place)
    assert answer.status_code == 422
    assert "only a job that tunes a drive has objectives to trade" in answer.text
