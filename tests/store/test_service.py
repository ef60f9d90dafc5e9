"""The service: what is checked before a job is queued, and how long it will take."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job, JobState, Progress
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.time_left import TimeLeft, recent_pace, time_left
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.settings import Settings
from tests.examples.walks import SHORT_WALK
from tests.store.examples import spec

NOW = datetime(2030, 1, 1, tzinfo=UTC)


def job(state: JobState, *, iterations: int, seconds: float = 8.0) -> Job:
    """A job of ten iterations of five particles in two scenarios, last changed now."""
    progress = Progress(iterations=iterations, evaluations=5 * iterations, compute_seconds=seconds)
    return Job("b" * 12, spec(iterations=10, particles=5), state, NOW, NOW, progress=progress)


def test_the_rest_takes_as_long_as_what_was_done() -> None:
    found = time_left(job(JobState.RUNNING, iterations=4), NOW)
    assert found == TimeLeft(12.0, 2.5, 5.0)


def test_the_iteration_under_way_counts_for_the_time_it_has_run() -> None:
    running = job(JobState.RUNNING, iterations=4)
    assert time_left(running, NOW + timedelta(seconds=1.5)).eta_seconds == 10.5


def test_a_late_iteration_counts_for_no_more_than_one() -> None:
    running = job(JobState.RUNNING, iterations=4)
    assert time_left(running, NOW + timedelta(hours=1)).eta_seconds == 10.0
    assert time_left(replace(running, progress=Progress(10, 50, compute_seconds=8.0)), NOW) == (
        TimeLeft(0.0, 6.25, 12.5)
    )


def test_an_iteration_that_is_far_too_late_is_reported() -> None:
    running = job(JobState.RUNNING, iterations=4)
    assert "the current one" not in time_left(running, NOW + timedelta(seconds=3.9)).basis
    late = time_left(running, NOW + timedelta(seconds=60.0))
    assert late.basis == (
        "at the pace of the last iterations, 2 s each; the current one has taken 60 s"
    )


def test_the_rest_takes_as_long_as_the_last_iterations_where_their_pace_is_another() -> None:
    pace = 0.4
    for _ in range(4):
        # Half of the workers have gone.
        pace = recent_pace(pace, 0.8)
    running = job(JobState.RUNNING, iterations=4)
    slower = replace(running, progress=running.progress._replace(recent_seconds=pace))
    found = time_left(slower, NOW)
    assert found.eta_seconds == pytest.approx(30 * pace) and 20.0 < 30 * pace < 24.0
    assert found.evaluations_per_second == 2.5


@pytest.mark.parametrize(
    ("found", "why"),
    [
        (job(JobState.QUEUED, iterations=4), "queued"),
        (job(JobState.PAUSED, iterations=4), "paused"),
        (replace(job(JobState.RUNNING, iterations=4), waiting="no route"), "while the job waits"),
        (job(JobState.RUNNING, iterations=0, seconds=0.0), "first iteration"),
    ],
    ids=["queued", "paused", "waiting", "nothing committed"],
)
def test_a_job_whose_end_is_not_known_says_why(found: Job, why: str) -> None:
    left = time_left(found, NOW)
    assert left.eta_seconds is None and left.basis.startswith("unknown") and why in left.basis


def test_a_clock_that_lags_behind_the_database_adds_nothing() -> None:
    running = job(JobState.RUNNING, iterations=4)
    assert time_left(running, NOW - timedelta(hours=1)).eta_seconds == 12.0


@pytest.mark.parametrize(
    "state", [s for s in JobState if s not in (JobState.RUNNING, JobState.SUCCEEDED)]
)
def test_a_job_that_does_not_run_has_rates_but_no_end(state: JobState) -> None:
    assert time_left(job(state, iterations=4), NOW) == TimeLeft(None, 2.5, 5.0)


def test_a_finished_job_has_no_time_left() -> None:
    assert time_left(job(JobState.SUCCEEDED, iterations=10), NOW).eta_seconds == 0.0


@pytest.mark.parametrize(("iterations", "seconds"), [(0, 0.0), (3, 0.0)])
def test_before_anything_was_measured_nothing_is_estimated(iterations: int, seconds: float) -> None:
    running = job(JobState.RUNNING, iterations=iterations, seconds=seconds)
    assert time_left(running, NOW) == TimeLeft(None, None, None)


LONG_STEPS = SHORT_WALK | {"name": "mine", "stride": 0.5}


@pytest.mark.parametrize(
    ("asked", "field", "message"),
    [
        ({"fixed": {"stride": 0.9}}, "scenarios.0", "right_front"),
        ({"scenarios": ["1", LONG_STEPS]}, "scenarios.1", "'mine'.*reduce stride"),
        ({"fixed": {"I": -5.0}}, "fixed", "I: -5"),
        ({"variables": ["P", {"name": "I", "low": -5.0, "high": 1.0}]}, "variables", "I: -5"),
        ({"variables": ["P", {"name": "I", "low": 0.0, "high": 500.0}]}, "variables", "I: 500"),
        (
            {"variables": ["P", "I", {"name": "duty_factor", "low": 0.5, "high": 2.0}]},
            "variables",
            "duty_factor",
        ),
        ({"fixed": {"fir_ms": 2.5}}, "fixed", "fir_ms"),
    ],
)
def test_a_job_that_cannot_be_simulated_is_refused_and_not_stored(
    database: Path, asked: dict[str, Any], field: str, message: str
) -> None:
    store = open_store(str(database))
    with pytest.raises(InvalidRequest, match=message) as refused:
        JobService(store).submit(JobSpec.model_validate({"controller": "pi", **asked}))
    assert refused.value.field == field
    assert store.jobs().items == ()
    store.close()


def test_a_scenario_is_fine_if_a_searched_gait_can_stay_within_reach(database: Path) -> None:
    store = open_store(str(database))
    asked = {"controller": "pi", "scenarios": [LONG_STEPS], "variables": ["P", "I", "stride"]}
    job, new = JobService(store).submit(JobSpec.model_validate(asked))
    assert new and JobService(store).job(job.id) == job
    store.close()


def test_a_job_longer_than_is_taken_is_refused_however_it_is_asked_for(store: Store) -> None:
    asked = JobSpec(scenarios=("1", "2"), iterations=4)
    # Three cycles of 1.5 s and of 2.2 s, of 25 designs in each of four iterations.
    taken = JobService(store, longest_job=1111.0)
    service = JobService(store, longest_job=1109.0)
    job, _ = taken.submit(asked)
    said = r"iterations: .* last 1\.11e\+03 s together, more than the .*; use fewer iterations"
    for refused in (
        lambda: service.submit(asked),
        lambda: service.submit_embedded(asked),
        lambda: service.estimate(asked),
        lambda: service.extend(job.id, 4),
    ):
        with pytest.raises(InvalidRequest, match=said):
            refused()
    assert taken.extend(job.id, 4).id == job.id
    assert [listed.id for listed in store.jobs().items] == [job.id]


def test_references_of_constraints_that_take_too_long_are_refused_by_name(store: Store) -> None:
    asked = JobSpec.model_validate(
        {
            "scenarios": ["1"],
            "worlds": {"count": 2},
            "constraints": ["speed>=0.01", "*<=9*published:A", "*<=9*published:B", "torque<=99"],
        }
    )
    # Two references in two worlds, each of three cycles of 1.5 s.
    JobService(store, longest_reference=18.1).submit(asked)
    service = JobService(store, longest_reference=17.9)
    (job,) = store.jobs().items
    assert isinstance(job.spec, JobSpec)
    for refused in (
        lambda: service.submit(asked),
        lambda: service.estimate(asked),
        lambda: service.under(job.spec, constraints=asked.constraints),
    ):
        with pytest.raises(InvalidRequest, match=r"18 s in total, more than the 17\.9 s") as error:
            refused()
        assert error.value.field == "constraints.2.relative_to"
    absolute = [c for c in asked.constraints if c.relative_to is None]
    service.submit(asked.model_copy(update={"constraints": tuple(absolute)}))


def test_a_cycle_time_that_is_searched_counts_by_the_middle_of_its_bounds(store: Store) -> None:
    searched = JobSpec(scenarios=("1",), iterations=4).with_gait_searched()
    seconds = 100 * 3 * 1.3
    JobService(store, longest_job=seconds + 1.0).submit(searched)
    with pytest.raises(InvalidRequest, match="iterations"):
        JobService(store, longest_job=seconds - 1.0).submit(searched)


def test_an_iteration_of_more_walks_than_are_kept_at_once_is_refused(store: Store) -> None:
    asked = JobSpec.model_validate(
        {"worlds": {"count": 100}, "optimizer": {"name": "pso", "particles": 2000}, "iterations": 1}
    )
    with pytest.raises(InvalidRequest, match="optimizer: an iteration has 1200000 simulations"):
        JobService(store, longest_job=1e10).submit(asked)


def test_a_weeks_work_of_a_cluster_is_taken_by_default(store: Store) -> None:
    limit = Settings().api_max_job_seconds
    asked = JobSpec.model_validate(
        {"worlds": {"count": 32}, "optimizer": {"particles": 200}, "iterations": 10_000}
    )
    job, _ = JobService(store, longest_job=limit).submit(asked)
    assert job.state is JobState.QUEUED
