"""Comparison of jobs over HTTP."""

from __future__ import annotations

import json
from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.jobs.job import Job, Reference
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import PARTICLES, Commit

pytestmark = pytest.mark.slow


@pytest.fixture
def other(store: Store, spec: JobSpec) -> Job:
    """As `job`, of another seed, budget and swarm."""
    settings = PsoSettings(particles=PARTICLES, inertia_end=0.3)
    changes = {"seed": 9, "iterations": 2, "optimizer": settings, "name": "other"}
    return store.create_job(spec.model_copy(update=changes))[0]


def test_jobs_are_compared_with_what_their_specs_say_differently(
    client: httpx2.Client, job: Job, other: Job, commit: Commit
) -> None:
    commit(job, 3)
    commit(other, 1)
    answer = client.get(f"/v1/jobs/{job.id}/comparison", params={"also": other.id})
    assert answer.status_code == 200, answer.text
    view = answer.json()
    assert [found["id"] for found in view["jobs"]] == [job.id, other.id]
    fields = {difference["field"]: difference["values"] for difference in view["differences"]}
    assert fields == {
        "optimizer.inertia_end": [fields["optimizer.inertia_end"][0], "0.3"],
        "iterations": ["3", "2"],
        "seed": [str(job.spec.seed), "9"],
    }
    assert view["comparable"]
    first = view["jobs"][0]
    assert first["convergence"]["evaluations"] == [4, 8, 12]
    assert first["convergence"]["seconds"] == pytest.approx([0.5, 1.0, 1.5])
    assert first["convergence"]["best_so_far"] == [101.0, 100.0, 99.0]
    # The first particle of each iteration fails; the fitness of the others is spread.
    assert (first["evaluations"], first["failed"]) == (12, 3)
    assert (first["fitness"][0], first["fitness"][-1]) == (99.0, 103.0)
    assert (first["shares"][0], first["shares"][-1]) == (0.0, 1.0)


def test_the_published_design_and_the_gain_over_it_are_reported_where_they_are_known(
    client: httpx2.Client, store: Store, job: Job, other: Job, commit: Commit
) -> None:
    commit(job, 3)
    store.note_reference(job.id, Reference("A", 198.0))
    view = client.get(f"/v1/jobs/{job.id}/comparison", params={"also": other.id}).json()
    assert [(found["reference"], found["gain"]) for found in view["jobs"]] == [
        ({"name": "A", "kind": "published", "fitness": 198.0}, 0.5),
        # Missing values are not simulated.
        (None, None),
    ]


def test_another_measure_is_reported_and_a_job_without_designs_has_no_distribution(
    client: httpx2.Client, store: Store, job: Job, spec: JobSpec, commit: Commit
) -> None:
    commit(job, 1)
    changed = store.create_job(spec.model_copy(update={"preference": "B"}))[0]
    view = client.get(f"/v1/jobs/{job.id}/comparison", params={"also": changed.id}).json()
    assert not view["comparable"]
    assert {d["field"] for d in view["differences"]} == {"preference.bias", "preference.exponent"}
    assert (view["jobs"][1]["fitness"], view["jobs"][1]["convergence"]["iterations"]) == ([], [])


def test_jobs_of_different_controllers_differ_by_a_field_for_every_variable(
    client: httpx2.Client, store: Store, spec: JobSpec
) -> None:
    job = store.create_job(spec.resolved())[0]
    searched = ("P", "I", "fir_ms", "curve")
    changes = {"controller": "pi", "variables": searched, "name": "other"}
    pi = store.create_job(spec.model_copy(update=changes).resolved())[0]
    view = client.get(f"/v1/jobs/{job.id}/comparison", params={"also": pi.id}).json()
    fields = {difference["field"]: difference["values"] for difference in view["differences"]}
    assert fields["variables.FI1R"] == ["1500 to 6000 counts", None]
    assert fields["variables.P"] == [None, "0.05 to 1 PWM counts/count"]
    assert fields["variables.fir_ms"] == [None, "integers, 4 to 300 ms"]
    assert fields["variables.curve"][1].startswith("quadratic_spline, ")
    assert fields["controller"] == ['"fuzzy-pi"', '"pi"']
    # Variables stay together, whichever job has them.
    rooms = [field.split(".")[0] for field in fields]
    assert rooms == sorted(rooms, key=rooms.index)
    assert len(fields) < 20


def test_a_scenario_that_one_job_lacks_is_a_field_with_what_is_special_of_it(
    client: httpx2.Client, store: Store, spec: JobSpec
) -> None:
    job = store.create_job(spec.resolved())[0]
    first, *_ = spec.resolved_scenarios()
    slower = first.model_copy(update={"cycle_time": 2.5})
    steep = first.model_copy(update={"name": "steep", "slope": 15.0})
    changed = store.create_job(spec.model_copy(update={"scenarios": (slower, steep)}))[0]
    view = client.get(f"/v1/jobs/{job.id}/comparison", params={"also": changed.id}).json()
    fields = {difference["field"]: difference["values"] for difference in view["differences"]}
    assert fields[f"scenarios.{first.name}.cycle_time"][1] == "2.5"
    nothing, said = fields["scenarios.steep"]
    assert nothing is None
    assert json.loads(said)["slope"] == 15.0
    assert "stride" not in json.loads(said)
    assert not [field for field in fields if field.startswith("scenarios.steep.")]


def test_a_job_that_is_named_twice_or_not_there_is_refused(client: httpx2.Client, job: Job) -> None:
    assert client.get(f"/v1/jobs/{job.id}/comparison?also={job.id}").status_code == 422
    assert client.get(f"/v1/jobs/{job.id}/comparison?also={'a' * 12}").status_code == 404


def test_short_convergences_begin_and_end_where_jobs_do_and_leave_out_those_that_are_gone(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    asked: dict[str, Any] = {"job": [job.id, "a" * 12], "points": 2}
    (found,) = client.get("/v1/job-convergences", params=asked).json()["items"]
    assert (found["id"], found["iterations"]) == (job.id, [0, 2])
    assert found["best_so_far"] == [101.0, 99.0]
