"""Tables, evidence and analyses of every kind of job."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import gaitswarm
from gaitswarm import JobView
from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.sim.identification import record
from gaitswarm.sim.measurement.measured_log import simulated_log, synchronise
from gaitswarm.sim.robot import load_robot
from scripts.synthesize import Perturbation, synthetic_log
from tests.calibration.conftest import WALKS
from tests.certificate.examples import DOCUMENT as CERTIFICATE
from tests.examples.preferences import DOCUMENT as PREFERENCES
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, UPHILL_WALK, logged_walk, short_walk

pytestmark = pytest.mark.slow

TUNING: dict[str, Any] = {
    "controller": "pi",
    "scenarios": [SHORT_WALK],
    "optimizer": {"name": "pso", "particles": 4},
    "iterations": 2,
    "seed": 3,
}

TUNINGS: dict[str, dict[str, Any]] = {
    "tuning": TUNING,
    "tuning-in-single-precision": TUNING | {"precision": "single"},
    "tuning-for-a-front": TUNING | {"optimizer": {"name": "hype", "particles": 4}},
    "tuning-over-worlds": TUNING | {"worlds": {"count": 2}},
    "tuning-over-worlds-of-two-scenarios": TUNING
    | {"scenarios": [SHORT_WALK, UPHILL_WALK], "worlds": {"count": 3, "aggregate": "worst"}},
    "tuning-over-worlds-for-a-front": TUNING
    | {"optimizer": {"name": "hype", "particles": 4}, "worlds": {"count": 2}},
}

OTHERS: dict[str, dict[str, Any]] = {
    "calibration": {
        "kind": "calibration",
        "robot": "szabadka2",
        "walks": WALKS,
        "targets": [{"walk": "stiff", "quantity": "speed", "value": 0.15, "tolerance": 0.1}],
        "variables": ["battery_voltage", "contact_law"],
        "optimizer": {"particles": 4},
        "iterations": 2,
    },
    "certificate": CERTIFICATE,
    "identification": {
        "kind": "identification",
        "robot": "szabadka2",
        "variables": ["battery_voltage", "body_mass"],
        "optimizer": {"particles": 4},
        "iterations": 2,
    },
    "preferences": PREFERENCES,
}


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DatabaseJobs]:
    with gaitswarm.open(tmp_path_factory.mktemp("kinds") / "jobs.db") as opened:
        yield opened


@pytest.fixture(scope="module", params=[*TUNINGS, *OTHERS])
def ended(request: pytest.FixtureRequest, jobs: DatabaseJobs) -> JobView:
    """A small job of each kind that has succeeded."""
    return _run(jobs, request.param)


@pytest.fixture(scope="module", params=TUNINGS)
def tuned(request: pytest.FixtureRequest, jobs: DatabaseJobs) -> JobView:
    """A small job of each kind that is judged by a preference."""
    return _run(jobs, request.param)


def _run(jobs: DatabaseJobs, name: str) -> JobView:
    document = (TUNINGS | OTHERS)[name]
    if document.get("kind") == "identification":
        document = document | {"recordings": [_recording(jobs)]}
    ended = jobs.run(jobs.submit(document, idempotency_key=name).id)
    assert ended.state == "succeeded"
    return ended


def _recording(jobs: DatabaseJobs) -> str:
    robot = load_robot("szabadka2")
    scenario = short_walk(name="brief", cycles=2, stride=0.16, height=0.03, curve="half_ellipse")
    truth = Perturbation.of({"battery_voltage": 10.4})
    log = synthetic_log(robot, scenario, "fuzzy-pi", PUBLISHED_A, seed=3, perturbation=truth)
    simulated = simulated_log(robot, logged_walk(scenario, robot=robot))
    pair = synchronise(log, simulated, scenario.cycle_time)
    return jobs.record(record(pair, scenario, "fuzzy-pi", PUBLISHED_A)).id


@pytest.mark.variants("tuning", "tuning-over-worlds-for-a-front", "calibration")
def test_every_format_of_export_has_a_row_for_each_evaluation(
    jobs: DatabaseJobs, ended: JobView
) -> None:
    table = jobs.evaluations(ended.id)
    history = [e for iteration in jobs.history(ended.id) for e in iteration.evaluations]
    parquet = pq.read_table(io.BytesIO(b"".join(jobs.export(ended.id, "parquet"))))
    text = b"".join(jobs.export(ended.id, "csv")).decode()
    rows = list(csv.DictReader(io.StringIO(text, newline="")))

    assert len(history) == ended.evaluations
    assert len(table) == parquet.num_rows == len(rows) == len(history)
    fitness = [e.fitness for e in history]
    assert parquet.column("fitness").to_pylist() == fitness
    assert [float(row["fitness"]) if row["fitness"] else None for row in rows] == fitness
    assert np.array_equal(table.fitness, np.array(fitness, dtype=np.float64), equal_nan=True)
    assert list(rows[0]) == parquet.column_names


@pytest.mark.parametrize("name", TUNINGS)
def test_a_job_that_has_committed_nothing_has_a_table_without_rows(
    jobs: DatabaseJobs, name: str
) -> None:
    queued = jobs.submit(TUNINGS[name])
    assert len(jobs.evaluations(queued.id)) == 0
    assert b"".join(jobs.export(queued.id, "csv")).count(b"\n") == 1
    parquet = b"".join(jobs.export(queued.id, "parquet"))
    assert pq.read_table(io.BytesIO(parquet)).num_rows == 0


@pytest.mark.variants("tuning", "tuning-over-worlds-for-a-front", "certificate", "identification")
def test_evidence_and_stored_history_are_verified(jobs: DatabaseJobs, ended: JobView) -> None:
    evidence = gaitswarm.verify(jobs.evidence(ended.id), replay=2, seed=1)
    assert evidence.verified, evidence
    stored = jobs.verify(ended.id, replay=2, seed=1)
    assert stored.verified, stored


@pytest.mark.variants(
    "tuning", "tuning-over-worlds-of-two-scenarios", "tuning-over-worlds-for-a-front"
)
def test_every_analysis_answers_for_a_tuning(jobs: DatabaseJobs, tuned: JobView) -> None:
    best = jobs.best(tuned.id)
    assert jobs.ranking(tuned.id, "B").evaluations == tuned.evaluations
    assert jobs.importance(tuned.id).designs > 0
    assert jobs.front(tuned.id).size > 0
    assert jobs.preference_for(tuned.id, best.iteration, best.particle).fits
    assert len(jobs.comparison([tuned.id]).jobs) == 1
