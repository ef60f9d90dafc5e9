"""Importance of variables over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS, Outcome, Status

pytestmark = pytest.mark.slow

DESIGNS = 200


@pytest.fixture
def searched(store: Store) -> Job:
    """A job whose energy goes with P alone, whose torque with I alone, and which fails for large I.

    The best design has the largest P of all: it lies at the upper bound.
    """
    spec = JobSpec(
        controller="pi",
        scenarios=("normal-fast",),
        optimizer=PsoSettings(particles=DESIGNS),
        iterations=2,
    )
    job, _ = store.create_job(spec)
    claim = store.claim("test", lease_seconds=60.0, job_id=job.id)
    assert claim is not None
    space = spec.design_space()
    share = np.random.default_rng(1).random((DESIGNS, len(space.box.low)))
    share[0] = [1.0, 0.5]
    p, i = share.T
    ask = Ask(0, space.box.low + share * (space.box.high - space.box.low), {})
    store.begin(claim, ask)
    objectives = np.full((DESIGNS, len(RESULTS)), 10.0)
    objectives[:, 3] = 50.0 - 10.0 * p
    objectives[:, 0] = 5.0 + i
    failed = i > 0.8
    objectives[failed] = np.nan
    statuses = np.where(failed, Status.FELL, Status.OK).astype(np.uint8)
    store.commit(
        claim,
        CompletedIteration(
            iteration=0,
            designs=space.designs(ask.positions),
            outcomes=(Outcome(objectives, statuses),),
            fitness=np.where(failed, np.inf, 20.0 - p),
            evaluate_seconds=1.0,
        ),
        None,
    )
    return store.job(job.id)


def importance(client: httpx2.Client, job: Job) -> Any:
    answer = client.get(f"/v1/jobs/{job.id}/importance")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_each_output_goes_with_the_variable_that_decides_it(
    client: httpx2.Client, searched: Job
) -> None:
    view = importance(client, searched)
    p, i = view["variables"]
    assert (p["name"], i["name"]) == ("P", "I")
    assert view["designs"] + view["failed"] == view["sampled"] == DESIGNS
    assert view["failed"] > 10
    for mine, other, output in ((p, i, "energy"), (i, p, "torque")):
        assert mine["objectives"][output]["value"] > 0.9
        assert other["objectives"][output]["value"] < 0.1
    assert p["fitness"]["value"] > 0.9
    # What fails has no fitness; that it fails is an output of its own.
    assert i["failing"]["value"] > 0.7
    assert p["failing"]["value"] < 0.1
    # It never changes.
    assert p["objectives"]["acceleration"] is None


def test_a_winner_at_a_bound_is_reported_with_bounds_that_can_be_simulated(
    client: httpx2.Client, searched: Job
) -> None:
    view = importance(client, searched)
    p, i = view["variables"]
    assert (view["iteration"], view["particle"]) == (0, 0)
    assert (p["at"], i["at"], i["widened"]) == ("high", None, None)
    assert p["winner"] == p["high"] < p["widened"]["high"]
    assert p["widened"]["low"] == p["low"]
    spec = client.get(f"/v1/jobs/{searched.id}").json()["spec"]
    wider = {key: p[key] for key in ("name", "unit")} | p["widened"]
    again = client.post("/v1/jobs", json=spec | {"variables": [wider, "I"]})
    assert again.status_code == 202, again.text


def test_of_few_designs_no_share_is_reported(client: httpx2.Client, job: Job, commit: Any) -> None:
    commit(job, 2)
    view = importance(client, job)
    assert (view["designs"], view["failed"]) == (6, 2)
    assert {v["fitness"] for v in view["variables"]} == {None}


def test_a_job_without_designs_or_of_another_kind_is_refused(
    client: httpx2.Client, store: Store, job: Job
) -> None:
    answer = client.get(f"/v1/jobs/{job.id}/importance")
    assert answer.status_code == 409
    assert "no design yet" in answer.json()["detail"]
    certificate, _ = store.create_job(
        CertificateSpec(kind="certificate", design={"P": 0.4, "I": 0.1}, controller="pi")
    )
    answer = client.get(f"/v1/jobs/{certificate.id}/importance")
    assert answer.status_code == 422
    assert "certificate" in answer.text
