"""Estimates: exact counts, and times from similar jobs or a measured simulation."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import pytest

from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.estimate import MeasuredRates, estimate
from gaitswarm.services.optimizer.jobs.job import Job, Progress
from gaitswarm.services.optimizer.jobs.kinds.identification import IdentificationSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.search.registry import RandomSearchSettings
from gaitswarm.sim.identification import RecordedWalk
from gaitswarm.sim.kernel.walk import Walking
from gaitswarm.sim.robot import RobotVariant
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, simulating
from gaitswarm.sim.variables import Variable
from tests.examples.walks import SHORT_WALK
from tests.optimizer.formula import job

SPEC = JobSpec.model_validate(
    {
        "controller": "pi",
        "scenarios": [
            SHORT_WALK | {"name": "one", "cycle_time": 1.5, "cycles": 2},
            SHORT_WALK | {"name": "two"},
        ],
        "optimizer": {"name": "pso", "particles": 10},
        "iterations": 5,
    }
)


class NoMeasurement(MeasuredRates):
    def rate(self, spec: Spec, cases: object, positions: object) -> tuple[float | None, str]:
        return None, "nothing"


def done(spec: AnySpec, evaluations: int, seconds: float) -> Job:
    progress = Progress(iterations=1, evaluations=evaluations, compute_seconds=seconds)
    return replace(job(spec), progress=progress)


def estimated(spec: JobSpec, *earlier: Job) -> tuple[float | None, str]:
    found = estimate(spec, spec.cases({}), earlier, NoMeasurement())
    return found.seconds, found.basis


def test_walks_and_their_length_are_counted() -> None:
    found = estimate(SPEC, SPEC.cases({}), (), NoMeasurement())
    assert (found.evaluations, found.walks) == (50, 100)
    assert found.simulated_seconds == pytest.approx(50 * (3.0 + 1.0))
    assert (found.seconds, found.basis) == (None, "nothing")


def test_walks_of_another_precision_are_of_another_speed() -> None:
    single = SPEC.model_copy(update={"precision": "single"})
    assert estimated(SPEC, done(SPEC, 50, 2.0))[0] == pytest.approx(2.0)
    assert estimated(single, done(SPEC, 50, 2.0)) == (None, "nothing")


def test_a_cycle_time_of_the_design_replaces_that_of_the_scenarios() -> None:
    bounds = Variable(name="cycle_time", low=1.0, high=3.0)
    fixed = SPEC.model_copy(update={"fixed": {"cycle_time": 2.0}})
    searched = SPEC.model_copy(update={"variables": ("P", "I", bounds)})
    for spec in (fixed, searched):
        found = estimate(spec, spec.cases({}), (), NoMeasurement())
        assert found.simulated_seconds == pytest.approx(50 * 3.0 * 2.0)


def test_jobs_alike_tell_how_long_it_takes() -> None:
    # 40 and 20 designs of 4 s each, in 3 s together: 80 simulated seconds a second.
    seconds, basis = estimated(SPEC, done(SPEC, 40, 1.0), done(SPEC, 20, 2.0))
    assert seconds == pytest.approx(200.0 / 80.0)
    assert "2 earlier jobs" in basis


def test_a_job_that_has_done_nothing_tells_nothing() -> None:
    assert estimated(SPEC, job(SPEC)) == (None, "nothing")


@pytest.mark.parametrize(
    "change", [{"controller": "pid"}, {"robot": RobotVariant(contact_law="stick")}]
)
def test_jobs_of_another_robot_or_controller_tell_nothing(change: dict[str, object]) -> None:
    other = JobSpec.model_validate(SPEC.model_dump(exclude=set(change)) | change)
    assert estimated(SPEC, done(other, 40, 1.0)) == (None, "nothing")


@pytest.mark.slow
def test_without_a_job_alike_a_walk_is_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rates = MeasuredRates()
    first = estimate(SPEC, SPEC.cases({}), (), rates)
    assert first.seconds is not None and 0.0 < first.seconds < 60.0
    assert "measured on this machine" in first.basis
    monkeypatch.setattr("gaitswarm.sim.case.simulating", None)
    assert estimate(SPEC, SPEC.cases({}), (), rates) == first


def test_jobs_that_walk_fewer_designs_at_once_are_of_another_speed() -> None:
    one_by_one = done(SPEC, 40, 1.0)
    one_by_one = replace(one_by_one, progress=replace(one_by_one.progress, iterations=40))
    assert estimated(SPEC, one_by_one) == (None, "nothing")
    assert estimated(SPEC, one_by_one, done(SPEC, 50, 2.0))[0] == pytest.approx(2.0)


@pytest.mark.slow
def test_a_method_that_asks_for_one_design_at_a_time_is_measured_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walked: list[int] = []

    def noted(*arguments: Any, **options: Any) -> Walking[Simulation]:
        *_, designs = arguments
        walked.append(len(designs))
        return simulating(*arguments, **options)

    monkeypatch.setattr("gaitswarm.sim.case.simulating", noted)
    single = SPEC.model_copy(update={"optimizer": RandomSearchSettings(particles=1)})
    found = estimate(single, single.cases({}), (), MeasuredRates())
    assert found.seconds is not None
    assert set(walked) == {1}


@pytest.mark.slow
def test_without_an_affinity_a_measurement_is_scaled_to_all_processors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 96)
    found = estimate(SPEC, SPEC.cases({}), (), MeasuredRates())
    assert found.seconds is not None
    assert "96 cores" in found.basis


@pytest.mark.slow
def test_a_measured_walk_is_short_however_long_the_jobs_walks_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = SPEC.resolved_scenarios()[0].model_copy(update={"cycles": 100.0})
    long = SPEC.model_copy(update={"scenarios": (scenario,)})
    walked: list[float] = []

    def noted(scenario: Scenario, *arguments: Any, **options: Any) -> Walking[Simulation]:
        walked.append(scenario.cycles)
        return simulating(scenario, *arguments, **options)

    monkeypatch.setattr("gaitswarm.sim.case.simulating", noted)
    found = estimate(long, long.cases({}), (), MeasuredRates())
    assert found.seconds is not None
    assert max(walked) * scenario.cycle_time == pytest.approx(5.0)


@pytest.mark.slow
def test_a_gait_beyond_reach_has_no_rate() -> None:
    bounds = Variable(name="stride", low=0.5, high=0.6)
    spec = SPEC.model_copy(update={"variables": ("P", "I", bounds)})
    found = estimate(spec, spec.cases({}), (), MeasuredRates())
    assert found.seconds is None
    assert "reach" in found.basis


def test_a_fit_is_timed_by_fits_to_the_same_recordings() -> None:
    walk = RecordedWalk(
        scenario=SPEC.resolved_scenarios()[0],
        controller="pi",
        design={"P": 0.4, "I": 0.1},
        first_tick=0,
        joints=("a",),
        current=((0.1,),),
    )
    recordings = {"0" * 32: walk, "1" * 32: walk}
    one, both = (
        IdentificationSpec(
            kind="identification", recordings=ids, optimizer=PsoSettings(particles=10), iterations=5
        )
        for ids in (tuple(recordings)[:1], tuple(recordings))
    )

    def seconds(spec: IdentificationSpec, *earlier: Job) -> float | None:
        return estimate(spec, spec.cases(recordings), earlier, NoMeasurement()).seconds

    fitted = done(one.model_copy(update={"iterations": 99}), evaluations=20, seconds=4.0)
    assert seconds(one, fitted) == pytest.approx(50 * 4.0 / 20)
    assert seconds(both, fitted) is None
    assert seconds(one, done(SPEC, evaluations=20, seconds=4.0)) is None
