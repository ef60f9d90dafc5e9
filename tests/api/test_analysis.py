"""Questions about all evaluations of a job at once, over HTTP."""

from __future__ import annotations

import math
from typing import Any

import httpx2
import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.calibration import IdentificationSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import PARTICLES, Commit
from tests.examples.servers import unframed

pytestmark = pytest.mark.slow


def distribution(client: httpx2.Client, job: Job, **parameters: int) -> Any:
    answer = client.get(f"/v1/jobs/{job.id}/distribution", params=parameters)
    assert answer.status_code == 200, answer.text
    return answer.json()


def ranking(client: httpx2.Client, job: Job, **body: Any) -> Any:
    answer = client.post(f"/v1/jobs/{job.id}/ranking", json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def particles(
    client: httpx2.Client, job: Job, **parameters: int | bool
) -> tuple[Any, dict[str, NDArray[np.float32]]]:
    answer = client.get(f"/v1/jobs/{job.id}/particles", params=parameters)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/octet-stream"
    header, numbers = unframed(answer.content)
    names = [column["name"] for column in header["columns"]]
    return header, dict(zip(names, numbers.reshape(len(names), header["rows"]), strict=True))


def test_the_distribution_leaves_out_designs_that_failed(
    client: httpx2.Client, store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 2)
    found = distribution(client, job)
    assert found["quantiles"] == [0, 0.05, 0.25, 0.5, 0.75, 0.95, 1]
    second = found["items"][1]
    assert (second["index"], second["failed"], second["mean"]) == (1, 1, 101.0)
    assert second["fitness"] == pytest.approx([100, 100.1, 100.5, 101, 101.5, 101.9, 102])
    space = job.spec.design_space()
    designs = np.array([evaluation.design for evaluation in store.evaluations(job.id, 1)])
    spread = designs.std(axis=0) / (space.box.high - space.box.low)
    assert second["diversity"] == pytest.approx(spread.mean())
    assert found["next"] is None


def test_the_distribution_comes_in_pages(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 3)
    first = distribution(client, job, limit=2)
    second = distribution(client, job, limit=2, after=first["next"])
    assert [item["index"] for item in first["items"] + second["items"]] == [0, 1, 2]
    assert (first["next"], second["next"]) == ("1", None)


def test_a_swarm_that_failed_wholly_has_nulls(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1, failed=True)
    (item,) = distribution(client, job)["items"]
    assert item["fitness"] == [None] * 7
    assert (item["mean"], item["failed"]) == (None, PARTICLES)


def test_the_distribution_follows_a_running_job(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    def indices(**parameters: int) -> list[int]:
        return [item["index"] for item in distribution(client, job, **parameters)["items"]]

    assert indices() == []
    claim = commit(job, 1)
    assert indices() == [0]
    commit(job, 1, claim=claim)
    assert indices() == [0, 1]
    assert indices(after=0) == [1]


def test_particles_are_columns_of_floats_with_units_and_bounds(
    client: httpx2.Client, store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    header, columns = particles(client, job)
    rows = store.evaluations_between(job.id, 0, 3)
    assert (header["job_id"], header["rows"], header["total"]) == (job.id, 12, 12)
    assert header["iterations"] == [0, 2]
    space = job.spec.design_space()
    assert list(columns) == [
        *("iteration", "particle", "fitness"),
        *(variable.name for variable in space.variables),
        *("utility:normal-fast", "utility:turn-right-fast"),
    ]
    described = header["columns"][4]
    second = space.variables[1]
    assert described == {
        "name": second.name,
        "unit": second.unit,
        "low": second.low,
        "high": second.high,
        "kind": second.kind,
        "choices": [],
    }
    assert columns["iteration"].tolist() == [row.iteration for row in rows]
    assert columns["particle"].tolist() == [row.particle for row in rows]
    expected = np.array([row.fitness for row in rows], dtype=np.float32)
    expected[np.isinf(expected)] = np.nan
    np.testing.assert_array_equal(columns["fitness"], expected)
    np.testing.assert_array_equal(
        columns[second.name], np.array([row.design[1] for row in rows], dtype=np.float32)
    )
    bias, exponent = PREFERENCES["A"].bias, PREFERENCES["A"].exponent
    utility = math.prod((b + 11.0) ** e for b, e in zip(bias, exponent, strict=True))
    assert columns["utility:normal-fast"][1] == np.float32(utility)
    assert np.isnan(columns["utility:turn-right-fast"][0])


def test_a_categorical_variable_is_a_column_of_indices_with_the_names_of_its_choices(
    client: httpx2.Client, store: Store, spec: JobSpec, commit: Commit
) -> None:
    names = [variable.name for variable in spec.design_space().variables]
    job, _ = store.create_job(spec.model_copy(update={"variables": (*names, "fir_window")}))
    commit(job, 3)
    header, columns = particles(client, job)
    (described,) = [c for c in header["columns"] if c["name"] == "fir_window"]
    assert (described["kind"], described["choices"]) == (
        "categorical",
        ["moving_average", "hamming"],
    )
    assert set(columns["fir_window"].tolist()) == {0.0, 1.0}


def test_particles_have_the_objectives_of_a_front_where_they_are_asked_for(
    client: httpx2.Client, store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 2)
    plain, without = particles(client, job)
    header, columns = particles(client, job, objectives=True)
    assert header["columns"][: len(plain["columns"])] == plain["columns"]
    described = header["columns"][len(plain["columns"]) :]
    assert [(d["name"], d["unit"], d["kind"]) for d in described][1:3] == [
        ("objective:acceleration", "m/s2", "objective"),
        ("objective:angular_acceleration", "rad/s2", "objective"),
    ]
    assert set(columns) - set(without) == {d["name"] for d in described}
    rows = store.evaluations_between(job.id, 0, 2)
    failed = np.array([row.statuses.any() for row in rows])
    means = np.exp([np.log(row.objectives[:, 0]).mean() for row in rows])
    np.testing.assert_allclose(columns["objective:torque"], np.where(failed, np.nan, means), 1e-6)
    assert failed.any()


def test_particles_after_an_iteration_are_the_later_ones(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    assert particles(client, job)[0]["iterations"] is None
    commit(job, 3)
    header, columns = particles(client, job, after_iteration=0)
    assert (header["rows"], header["total"], header["iterations"]) == (8, 8, [1, 2])
    assert set(columns["iteration"]) == {1, 2}


def test_too_many_particles_are_thinned_and_the_best_is_kept(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    header, columns = particles(client, job, max_points=6)
    assert (header["rows"], header["total"]) == (5, 12)
    assert np.nanmin(columns["fitness"]) == 99.0


def test_a_ranking_by_another_preference_lists_both_places(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    found = ranking(client, job, preference="B", top=3)
    assert (found["preference"], found["evaluations"]) == ("B", 12)
    # The store's fitnesses are made up; objectives grow with the particle's number.
    assert [(d["rank"], d["iteration"], d["particle"]) for d in found["top"]] == [
        *((1, 0, 1), (2, 1, 1), (3, 2, 1))
    ]
    assert [d["rank_before"] for d in found["top"]] == [4, 2, 1]
    first = found["top"][0]
    assert first["fitness_before"] == 101.0
    bias, exponent = PREFERENCES["B"].bias, PREFERENCES["B"].exponent
    expected = math.prod((b + 11.0) ** e for b, e in zip(bias, exponent, strict=True))
    assert first["fitness"] == pytest.approx(expected, rel=1e-12)
    walk = first["scenarios"]["normal-fast"]
    assert walk["utility"] == pytest.approx(expected, rel=1e-12)
    assert walk["objectives"]["energy"] == 11.0
    assert list(first["design"]) == list(job.spec.design_space().names)
    assert found["fitness_of_present_best"] == pytest.approx(expected, rel=1e-12)
    assert [entry["index"] for entry in found["best_so_far"]] == [0, 1, 2]
    # Particle 0 falls; the fitness of the others grows with their number and falls by iteration.
    ranked = [(100 - k + particle, particle) for k in range(3) for particle in (1, 2, 3)]
    before, after = zip(*ranked, strict=True)
    from scipy.stats import spearmanr

    assert found["correlation"] == pytest.approx(spearmanr(before, after).statistic)


def test_a_preference_of_ones_own_is_taken_and_given_back(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    own = {"bias": [0.0] * 5, "exponent": [1.0, 0.0, 0.0, 0.0, 0.0]}
    found = ranking(client, job, preference=own)
    assert found["preference"] == own
    assert found["top"][0]["fitness"] == pytest.approx(11.0)
    assert len(found["top"]) == 3


def test_a_job_that_has_committed_nothing_has_an_empty_ranking(
    client: httpx2.Client, job: Job
) -> None:
    found = ranking(client, job, preference="A")
    assert (found["top"], found["best_so_far"], found["evaluations"]) == ([], [], 0)
    assert found["correlation"] is found["fitness_of_present_best"] is None


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"preference": "D"}, "preference"),
        ({"preference": {"bias": [0] * 5, "exponent": [0] * 5}}, "preference"),
        ({"preference": "A", "top": 0}, "top"),
        ({"constraints": ["speed"]}, "constraints.0"),
        ({"constraints": ["sped>=1"]}, "constraints.0.quantity"),
        ({"constraints": ["speed>=1", "speed<=0"]}, "constraints.1"),
    ],
)
def test_a_ranking_that_makes_no_sense_is_refused(
    client: httpx2.Client, job: Job, body: Any, field: str
) -> None:
    answer = client.post(f"/v1/jobs/{job.id}/ranking", json=body)
    assert answer.status_code == 422
    assert any(error["field"].startswith(field) for error in answer.json()["errors"])


def test_a_job_without_a_preference_cannot_be_ranked(
    client: httpx2.Client, store: Store, identification: Job
) -> None:
    answer = client.post(f"/v1/jobs/{identification.id}/ranking", json={"preference": "A"})
    assert answer.status_code == 422
    assert "only tuning jobs" in answer.json()["detail"]


def test_particles_of_an_identification_have_currents_as_utility(
    client: httpx2.Client, identification: Job
) -> None:
    header, columns = particles(client, identification)
    assert header["rows"] == 0
    assert [c["unit"] for c in header["columns"] if c["kind"] == "utility"] == ["A"]
    assert list(columns)[2] == "fitness"


@pytest.mark.parametrize("what", ["distribution", "particles"])
def test_an_unknown_job_has_nothing_to_look_at(client: httpx2.Client, what: str) -> None:
    assert client.get(f"/v1/jobs/bcdfghjkmnpq/{what}").status_code == 404


@pytest.fixture
def identification(store: Store) -> Job:
    spec = IdentificationSpec(
        kind="identification", recordings=("0" * 32,), variables=("battery_voltage",)
    )
    return store.create_job(spec)[0]
