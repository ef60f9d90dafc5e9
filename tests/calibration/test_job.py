"""Calibration by the machinery of every job: queue, swarm, store, resume."""

from __future__ import annotations

import threading

import pytest

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.sim.robot import RobotVariant, load_robot
from tests.calibration.conftest import PI, TRUE_LAW, TRUTH, WALKS, spec, true_targets
from tests.examples.jobs import history
from tests.examples.walks import short_walk, walk


def finished(store: Store, wanted: CalibrationSpec) -> str:
    job, _ = JobService(store).submit(wanted)
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        assert run_embedded(store, evaluator, job.id).state is JobState.SUCCEEDED
    finally:
        evaluator.close()
    return job.id


@pytest.mark.slow
@pytest.mark.thorough("a whole search")
def test_it_finds_hidden_parameters_and_the_hidden_law_of_friction(store: Store) -> None:
    wanted = spec(
        targets=true_targets(),
        variables=["battery_voltage", "body_mass", "contact_law"],
        optimizer={"name": "pso", "particles": 16, "inertia_start": 0.7, "inertia_end": 0.3},
        iterations=12,
    )
    best = store.best(finished(store, wanted))
    assert best is not None
    found = wanted.design_space().shown(best.design.tolist())
    assert found["contact_law"] == TRUE_LAW
    assert found["battery_voltage"] == pytest.approx(TRUTH["battery_voltage"], abs=0.2)
    assert found["body_mass"] == pytest.approx(TRUTH["body_mass"], abs=0.1)
    assert best.fitness < 0.2


def test_some_choices_are_searched_and_walk_by_their_names(store: Store) -> None:
    laws = ("stick", "linear_zone")
    law = {"name": "contact_law", "kind": "categorical", "choices": laws}
    wanted = spec(walks=WALKS[:1], variables=[law], iterations=1)
    job_id = finished(store, wanted)
    for evaluation in store.evaluations_between(job_id, 0, 1):
        index = int(evaluation.design[0])
        robot = load_robot(RobotVariant(name="szabadka2", contact_law=laws[index]))
        alone = walk(short_walk(), PI, "pi", robot=robot).outcome.objectives[0]
        assert evaluation.objectives[0, :6].tolist() == alone.tolist()


@pytest.mark.slow
def test_a_job_stopped_half_way_ends_with_the_same_bits(store: Store) -> None:
    wanted = spec(walks=WALKS[:1])
    whole = finished(store, wanted)
    job, _ = JobService(store).submit(wanted)
    stop = threading.Event()
    evaluator = open_evaluator("in-process", cpus=1)
    try:
        run_embedded(store, evaluator, job.id, stop=stop, on_iteration=lambda _: stop.set())
        assert store.job(job.id).progress.iterations < wanted.iterations
        run_embedded(store, evaluator, job.id)
    finally:
        evaluator.close()
    assert history(store, job.id) == history(store, whole)
