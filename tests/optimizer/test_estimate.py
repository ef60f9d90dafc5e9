"""Estimates: exact counts, and times from a measured simulation."""

from __future__ import annotations

import os
from typing import Any

import pytest

from gaitswarm.services.optimizer.jobs.estimate import MeasuredRates, estimate
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.registry import RandomSearchSettings
from gaitswarm.sim.kernel.walk import Walking
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, simulating
from gaitswarm.sim.variables import Variable
from tests.examples.walks import SHORT_WALK

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


def test_walks_and_their_length_are_counted() -> None:
    found = estimate(SPEC, SPEC.cases({}), NoMeasurement())
    assert (found.evaluations, found.walks) == (50, 100)
    assert found.simulated_seconds == pytest.approx(50 * (3.0 + 1.0))
    assert (found.seconds, found.basis) == (None, "nothing")


def test_a_cycle_time_of_the_design_replaces_that_of_the_scenarios() -> None:
    bounds = Variable(name="cycle_time", low=1.0, high=3.0)
    fixed = SPEC.model_copy(update={"fixed": {"cycle_time": 2.0}})
    searched = SPEC.model_copy(update={"variables": ("P", "I", bounds)})
    for spec in (fixed, searched):
        found = estimate(spec, spec.cases({}), NoMeasurement())
        assert found.simulated_seconds == pytest.approx(50 * 3.0 * 2.0)


@pytest.mark.slow
def test_a_walk_is_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rates = MeasuredRates()
    first = estimate(SPEC, SPEC.cases({}), rates)
    assert first.seconds is not None and 0.0 < first.seconds < 60.0
    assert "measured on this machine" in first.basis
    monkeypatch.setattr("gaitswarm.sim.case.simulating", None)
    assert estimate(SPEC, SPEC.cases({}), rates) == first


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
    found = estimate(single, single.cases({}), MeasuredRates())
    assert found.seconds is not None
    assert set(walked) == {1}


@pytest.mark.slow
def test_without_an_affinity_a_measurement_is_scaled_to_all_processors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 96)
    found = estimate(SPEC, SPEC.cases({}), MeasuredRates())
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
    found = estimate(long, long.cases({}), MeasuredRates())
    assert found.seconds is not None
    assert max(walked) * scenario.cycle_time == pytest.approx(5.0)


@pytest.mark.slow
def test_a_gait_beyond_reach_has_no_rate() -> None:
    bounds = Variable(name="stride", low=0.5, high=0.6)
    spec = SPEC.model_copy(update={"variables": ("P", "I", bounds)})
    found = estimate(spec, spec.cases({}), MeasuredRates())
    assert found.seconds is None
    assert "reach" in found.basis
