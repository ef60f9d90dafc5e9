"""A job's best compared with its reference: computed once, then listed and sorted by."""

from __future__ import annotations

import json
from unittest.mock import patch

import httpx2
import pytest

from gaitswarm.cli.tables import jobs_table
from gaitswarm.services.optimizer.analysis import reference as references
from gaitswarm.services.optimizer.analysis.reference import (
    note_reference,
    walked_reference,
    with_reference,
)
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, Reference
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS
from gaitswarm.views.job import JobSummaryView
from tests.api.conftest import Commit
from tests.examples.walks import quadruped_files

BRIEF = {"name": "brief", "cycle_time": 0.5, "cycles": 1.0, "radius": 0.16, "hip_height": 0.15}
"""A scenario of a single short cycle."""


def tuning(**changes: object) -> JobSpec:
    asked = {"scenarios": [BRIEF], "optimizer": {"particles": 4}, "iterations": 3}
    return JobSpec.model_validate(asked | changes)


def test_the_published_design_is_judged_as_the_jobs_own_and_kept(
    client: httpx2.Client, store: Store, commit: Commit, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = tuning(preference="B")
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    here = f"/v1/jobs/{job.id}/verdict"
    early = client.get(here).json()
    assert early["reference"] is None and "no design is feasible" in early["reason"]
    assert store.job(job.id).reference is None

    commit(job, 1)
    found = client.get(here).json()
    published = {"controller": "fuzzy-pi", "scenarios": [BRIEF], "preference": "B"}
    design = client.get("/v1/controllers").json()["items"][0]["published"]["B"]
    walk = client.post("/v1/simulations", json={**published, "design": design}).json()
    assert found["reference"] == {
        "name": "B",
        "kind": "published",
        "fitness": walk["fitness"],
    }
    assert found["gain"] == 1.0 - found["best_fitness"] / walk["fitness"]
    assert found["reason"] is None
    energies = [view["scenarios"]["brief"] for view in found["quantities"] if view["unit"] == "J/m"]
    assert [energy["reference"] for energy in energies] == [
        pytest.approx(walk["scenarios"]["brief"]["objectives"]["energy"])
    ]
    assert (len(found["quantities"]), sum(found["figures"].values())) == (6, 5)
    assert found["sentences"][0].startswith("Compared with published B, ")

    monkeypatch.setattr(references, "walked_reference", None)
    assert client.get(here).json() == found
    (listed,) = client.get("/v1/jobs").json()["items"]
    assert (listed["reference"], listed["gain"]) == (found["reference"], found["gain"])


def test_another_reference_is_compared_with_and_not_stored(
    client: httpx2.Client, store: Store, commit: Commit
) -> None:
    spec = tuning()
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    here = f"/v1/jobs/{job.id}/verdict"
    by_default = client.get(here).json()
    published = client.get("/v1/controllers").json()["items"][0]["published"]["C"]
    energies = {}
    for against, name, kind, words in (
        ("published:C", "C", "published", "published C"),
        (job.id, job.id, "job", f"the best design of job {job.id}"),
        (json.dumps(published), "given design", "design", "the given design"),
    ):
        found = client.get(here, params={"against": against}).json()
        assert (found["reference"]["name"], found["reference"]["kind"]) == (name, kind)
        assert found["sentences"][0].startswith(f"Compared with {words}, ")
        assert found["gain"] == 1.0 - found["best_fitness"] / found["reference"]["fitness"]
        (energy,) = (view for view in found["quantities"] if view["unit"] == "J/m")
        energies[kind] = energy["scenarios"]["brief"]["reference"]
    assert energies["published"] == energies["design"] != energies["job"]
    assert client.get(here).json() == by_default


@pytest.mark.parametrize(
    ("against", "message"),
    [
        ("published:Z", "no published design 'Z' of fuzzy-pi; known are A, B, C"),
        ("job:k2q7zr5dm9xw", "there is no job 'k2q7zr5dm9xw'"),
        ('{"P": 1}', "unknown variable 'P'"),
        ('{"FI1R": [1]}', "is no design"),
        ("{", "is no design"),
    ],
)
def test_an_unknown_reference_is_refused_by_name(
    client: httpx2.Client, store: Store, commit: Commit, against: str, message: str
) -> None:
    job, _ = store.create_job(tuning())
    commit(job, 1)
    refused = client.get(f"/v1/jobs/{job.id}/verdict", params={"against": against})
    assert refused.status_code == 422
    (error,) = refused.json()["errors"]
    assert error["field"] == "against" and message in error["message"]


def test_a_robot_of_ones_own_is_measured_against_the_middle_of_the_bounds(
    client: httpx2.Client, store: Store, commit: Commit
) -> None:
    robot, walk = quadruped_files().model_dump(), BRIEF | {"radius": 0.22, "stride": 0.04}
    bounds = [{"name": "P", "low": 0.2, "high": 0.6}, "I"]
    spec = tuning(controller="pi", robot=robot, scenarios=[walk], variables=bounds)
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    found = client.get(f"/v1/jobs/{job.id}/verdict").json()
    integral = next(v for v in spec.design_space().variables if v.name == "I")
    asked = {
        "controller": "pi", "robot": robot, "scenarios": [walk],
        "design": {"P": 0.4, "I": (integral.low + integral.high) / 2},
    }  # fmt: skip
    walked = client.post("/v1/simulations", json=asked).json()
    assert found["reference"] == {
        "name": "start design",
        "kind": "start",
        "fitness": walked["fitness"],
    }
    assert found["gain"] == 1.0 - found["best_fitness"] / walked["fitness"]
    (listed,) = client.get("/v1/jobs").json()["items"]
    assert (listed["reference"], listed["robot"]) == (found["reference"], "quadruped")
    table = jobs_table([JobSummaryView.model_validate(listed)])
    (gains,) = (column for column in table.columns if column.header == "gain")
    assert [*map(str, gains.cells)] == [f"{found['gain']:.1%} over start"]


def test_a_reference_that_is_stored_stays(store: Store, commit: Commit) -> None:
    spec = tuning(controller="pi", robot=quadruped_files())
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    store.note_reference(job.id, Reference(None, None))
    assert note_reference(store, store.job(job.id)).reference == Reference(None, None)
    ended, reason = with_reference(store, store.job(job.id))
    assert ended.gain is None
    assert reason == "a plug-in evaluates its designs, and none is a reference"


def test_a_reference_that_an_outage_hinders_is_a_line_of_the_log_and_found_later(
    store: Store, commit: Commit, caplog: pytest.LogCaptureFixture
) -> None:
    spec = tuning()
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    ended = store.job(job.id)
    with patch.object(store, "note_reference", side_effect=StoreUnavailable("it is away")):
        assert note_reference(store, ended) == ended
    (record,) = caplog.records
    assert (record.levelname, record.exc_info) == ("WARNING", None)
    assert record.getMessage() == f"job {job.id}: its reference was not determined: it is away"
    assert note_reference(store, ended).reference is not None


def test_a_start_that_does_not_walk_says_so(store: Store, commit: Commit) -> None:
    walk = BRIEF | {"radius": 0.5}
    spec = tuning(controller="pi", robot=quadruped_files(), scenarios=[walk])
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    found, reason = with_reference(store, store.job(job.id))
    assert found.reference is not None
    assert (found.reference.name, found.reference.fitness) == ("start design", None)
    assert reason == "the start design fails in one of the scenarios"


def test_a_job_of_other_code_has_no_reference_and_says_why(
    client: httpx2.Client, store: Store, commit: Commit
) -> None:
    spec = tuning()
    other = job_provenance(spec).model_copy(update={"optimizer_digest": 32 * "0"})
    job, _ = store.create_job(spec, provenance=other)
    commit(job, 1)
    found = client.get(f"/v1/jobs/{job.id}/verdict").json()
    assert (found["reference"], found["gain"], found["quantities"]) == (None, None, [])
    assert "other code" in found["reason"]


def test_without_a_published_design_the_reference_is_the_middle_of_the_bounds() -> None:
    reference = walked_reference(tuning(controller="pid"))
    assert (reference.name, reference.kind) == ("start design", "start")


def test_jobs_are_sorted_by_gain_in_pages_either_way(store: Store, commit: Commit) -> None:
    jobs: list[Job] = []
    for fitness in (200.0, 50.0, None, 400.0):
        job, _ = store.create_job(tuning())
        commit(job, 1)
        if fitness is not None:
            store.note_reference(job.id, Reference("A", fitness))
        jobs.append(job)
    greatest = [jobs[3].id, jobs[0].id, jobs[1].id, jobs[2].id]
    least = [jobs[1].id, jobs[0].id, jobs[3].id, jobs[2].id]
    for reverse, wanted in ((False, greatest), (True, least)):
        found, after = [], None
        for _ in wanted:
            page = store.jobs(order=JobOrder.GAIN, reverse=reverse, after=after, limit=1)
            found += [job.id for job in page.items]
            after = page.next
        assert (found, after) == (wanted, None)


def test_a_gain_that_cannot_be_computed_breaks_nothing(
    store: Store, commit: Commit, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = tuning()
    job, _ = store.create_job(spec, provenance=job_provenance(spec))
    commit(job, 1)
    monkeypatch.setattr(references, "walked_reference", lambda _: 1 / 0)
    note_reference(store, store.job(job.id))
    assert store.job(job.id).reference is None


def test_in_many_worlds_the_reference_walks_in_them_too() -> None:
    many = walked_reference(tuning(worlds={"count": 2}))
    nominal = walked_reference(tuning())
    assert many.fitness is not None and nominal.fitness is not None
    assert many.fitness != nominal.fitness
    for reference, cases in ((many, 2), (nominal, 1)):
        assert reference._replace(fitness=0.0, results=b"") == Reference("A", 0.0)
        assert reference.objectives(cases).shape == (cases, len(RESULTS))
