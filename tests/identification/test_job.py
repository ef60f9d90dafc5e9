"""Identification by the machinery of every job: queue, swarm, store, resume."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.services.optimizer.analysis.identifiability import Trust
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.calibration import IdentificationSpec
from gaitswarm.services.optimizer.jobs.preference import Judgement
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from tests.examples.jobs import history
from tests.identification.conftest import TRUTH, Twin

VARIABLES = ("battery_voltage", "body_mass", "efficiency_right_front_coxa")


def spec(recording: str, **changes: object) -> IdentificationSpec:
    document: dict[str, object] = {
        "kind": "identification",
        "robot": "szabadka2",
        "recordings": (recording,),
        "variables": VARIABLES,
        "fixed": {"stiffness_left_rear": TRUTH["stiffness_left_rear"]},
        "optimizer": PsoSettings(particles=8, inertia_end=0.3),
        "iterations": 15,
    }
    return IdentificationSpec.model_validate(document | changes)


def judged(links: tuple[int, ...], objectives: np.ndarray) -> Judgement:
    only = IdentificationSpec.model_validate(
        {"kind": "identification", "recordings": ["0" * 32, "1" * 32], "links": links}
    )
    return only.judge(objectives, np.isnan(objectives).any(axis=2))


def test_fitness_is_the_mean_error_over_walks_and_chosen_links() -> None:
    # Two designs, two walks, three links; the second design fails in one walk.
    errors = np.array([[[1.0, 2.0, 3.0], [3.0, 4.0, 8.0]], [[1.0, 1.0, 1.0], [np.nan] * 3]])
    everything, second_link = judged((1, 2, 3), errors), judged((2,), errors)
    assert everything.fitness.tolist() == [3.5, np.inf]
    np.testing.assert_allclose(everything.utilities[0], [2.0, 5.0])
    assert second_link.fitness.tolist() == [3.0, np.inf]


def finished(store: Store, wanted: IdentificationSpec) -> str:
    job, _ = JobService(store).submit(wanted)
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        assert run_embedded(store, evaluator, job.id).state is JobState.SUCCEEDED
    finally:
        evaluator.close()
    return job.id


@pytest.mark.slow
def test_it_recovers_the_twins_battery_mass_and_efficiency(store: Store, twin: Twin) -> None:
    job_id = finished(store, spec(store.add_recording(twin.recording)))
    best = store.best(job_id)
    assert best is not None
    found = dict(zip(VARIABLES, best.design.tolist(), strict=False))
    assert found["battery_voltage"] == pytest.approx(TRUTH["battery_voltage"], abs=0.25)
    assert found["body_mass"] == pytest.approx(TRUTH["body_mass"], abs=0.2)
    assert found["efficiency_right_front_coxa"] == pytest.approx(0.42, abs=0.07)


@pytest.mark.slow
def test_a_job_stopped_half_way_ends_with_the_same_bits(store: Store, twin: Twin) -> None:
    brief = {"iterations": 2, "optimizer": PsoSettings(particles=5)}
    wanted = spec(store.add_recording(twin.recording), **brief)
    whole = finished(store, wanted)
    job, _ = JobService(store).submit(wanted)
    stop = threading.Event()
    evaluator = open_evaluator("in-process", cpus=1)
    try:
        run_embedded(store, evaluator, job.id, stop=stop, on_iteration=lambda _: stop.set())
        assert store.job(job.id).progress.iterations < 2
        run_embedded(store, evaluator, job.id)
    finally:
        evaluator.close()
    assert history(store, job.id) == history(store, whole)


@pytest.mark.slow
def test_runs_of_other_seeds_tell_which_parameters_to_trust(store: Store, twin: Twin) -> None:
    recording = store.add_recording(twin.recording)
    jobs = DatabaseJobs(JobService(store), "")
    brief = {
        "variables": ("battery_voltage", "damping_left_rear"),
        "iterations": 4,
        "optimizer": PsoSettings(particles=8),
    }
    ids = [
        finished(store, spec(recording, seed=seed, name=f"run {seed}", **brief)) for seed in (1, 2)
    ]
    found = jobs.parameters(ids)
    assert [p.name for p in found.parameters] == ["battery_voltage", "damping_left_rear"]
    assert found.fitness == [store.job(job).progress.best_fitness for job in ids]
    # Two short runs find much the same battery; a sole's damping hardly shows in the currents.
    battery, damping = found.parameters
    assert battery.trust in (Trust.TRUSTED, Trust.ROUGH)
    assert damping.trust is Trust.UNKNOWN
    assert [p.trust for p in jobs.parameters(ids[:1]).parameters] == [None, None]


def test_runs_of_different_problems_are_not_compared(store: Store, twin: Twin) -> None:
    recording, service = store.add_recording(twin.recording), JobService(store)
    jobs = DatabaseJobs(service, "")
    first, _ = service.submit(spec(recording))
    other, _ = service.submit(spec(recording, links=(1,), seed=2))
    with pytest.raises(InvalidRequest, match="another problem") as refused:
        jobs.parameters([first.id, other.id])
    assert refused.value.field == "job_ids"
    with pytest.raises(Conflict, match="no successful design yet"):
        jobs.parameters([first.id])


def test_a_run_is_no_evidence_for_itself(store: Store, twin: Twin) -> None:
    recording, service = store.add_recording(twin.recording), JobService(store)
    jobs = DatabaseJobs(service, "")
    first, _ = service.submit(spec(recording))
    again, _ = service.submit(spec(recording, iterations=15))
    for other in (first, again):
        with pytest.raises(InvalidRequest, match="has the seed of job") as refused:
            jobs.parameters([first.id, other.id])
        assert refused.value.field == "job_ids"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (
            {"variables": [{"name": "efficiency_left_rear_tibia", "low": 0.5, "high": 1.5}]},
            "variables",
        ),
        ({"fixed": {"battery_voltage": -3.0}, "variables": ["body_mass"]}, "fixed"),
    ],
)
def test_bounds_that_no_robot_has_are_refused(
    store: Store, twin: Twin, change: dict[str, object], field: str
) -> None:
    with pytest.raises(InvalidRequest) as refused:
        JobService(store).submit(spec(store.add_recording(twin.recording), **change))
    assert refused.value.field == field
