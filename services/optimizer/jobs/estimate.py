"""Estimates of jobs: total cost before submission, time left while running"""

from __future__ import annotations

import os
import threading
import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.case import Case, LongCase, Walk
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.simulate import prepare
from gaitswarm.sim.worlds.walks import PerturbedWalk

_WEIGHT: Final = 0.3
"""Weight of the last iteration in the moving average."""

_LATE: Final = 2.0
"""An iteration is reported as late beyond this multiple of the recent duration."""


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """Rates so far, and the time to the end of the budget at the recent pace."""

    # [s]; 0 for a job that succeeded, None unless it is running, waits for nothing and has
    # committed an iteration
    eta_seconds: float | None
    evaluations_per_second: float | None  # [1/s]; None before the first commit
    # simulations that were not cached [1/s]; None before the first commit or if the spec is
    # unreadable
    simulations_per_second: float | None
    # what `eta_seconds` is derived from, or why it is unknown, for people
    basis: str = field(default="", compare=False)


def recent_pace(before: float | None, latest: float) -> float:
    """Update the moving average of the time per design."""
    return latest if before is None else (1.0 - _WEIGHT) * before + _WEIGHT * latest


def time_left(job: Job, now: datetime) -> TimeLeft:
    """Estimate a job's end from its committed iterations."""
    progress = job.progress
    rated = job.own_evaluations > 0 and progress.compute_seconds > 0.0
    eta: float | None = None
    if job.state is JobState.SUCCEEDED:
        eta, basis = 0.0, "the job has ended"
    elif job.state is not JobState.RUNNING:
        basis = f"unknown: the job is {job.state}"
    elif job.waiting is not None:
        basis = "unknown while the job waits"
    elif not job.readable:
        basis = "unknown: the job's spec cannot be read"
    elif not rated:
        basis = "unknown until the first iteration is committed"
    else:
        eta, basis = _by_pace(job, now)
    if not rated:
        return TimeLeft(eta, None, None, basis)
    walked = progress.evaluations_walked / progress.compute_seconds
    return TimeLeft(
        eta,
        job.own_evaluations / progress.compute_seconds,
        walked * len(job.spec.case_names) if job.readable else None,
        basis,
    )


def _by_pace(job: Job, now: datetime) -> tuple[float, str]:
    progress = job.progress
    average = progress.compute_seconds / job.own_evaluations
    pace = average if progress.recent_seconds is None else progress.recent_seconds
    iterations = progress.iterations - (job.lineage.own_from if job.lineage else 0)
    one_iteration = pace * job.own_evaluations / iterations
    since = max(0.0, (now - job.updated_at).total_seconds())
    remaining = max(0, job.spec.budget - progress.evaluations) * pace
    basis = f"at the pace of the last iterations, {one_iteration:.3g} s each"
    if since > _LATE * one_iteration and remaining > 0.0:
        basis += f"; the current one has taken {since:.3g} s"
    return max(0.0, remaining - min(one_iteration, since)), basis


_MEASURED: Final = 8
"""Designs simulated to measure a rate: a multiple of every kernel's lanes."""

_LONGEST_WALK: Final = 5.0
"""Length of the measured simulation [s]; a very short one would measure table setup."""

_REMEMBERED: Final = 64

_MOST_WALKS: Final = 1_000_000
"""Limit on simulations per iteration: their results, some 130 B each, are in memory together."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Predicted cost of a job."""

    evaluations: int
    walks: int
    simulated_seconds: float  # of all simulations together [s]
    seconds: float | None  # wall time [s], None if unknown
    basis: str  # what the wall time is derived from, for people


def estimate(spec: Spec, cases: Sequence[Case], measured: MeasuredRates) -> Estimate:
    """Estimate a job from the rate of a short simulation in this thread."""
    walked = spec.tuning if isinstance(spec, PreferencesSpec) else spec
    walks = walked.cases({}) if walked is not spec else cases
    rate, basis = measured.rate(walked, walks, walked.create_search().ask())
    simulated = spec.budget * duration(spec, cases)
    return Estimate(
        evaluations=spec.budget,
        walks=spec.budget * len(cases),
        simulated_seconds=simulated,
        seconds=None if rate is None else simulated / rate,
        basis=basis,
    )


def duration(spec: Spec, cases: Sequence[Case]) -> float:
    """Return the simulated time of one design in some of a spec's cases [s]."""
    cycle_time = _typical(spec.design_space(), "cycle_time")
    return sum(
        case.scenario.cycles * cycle_time
        if isinstance(case, Walk | PerturbedWalk) and cycle_time is not None
        else case.duration
        for case in cases
    )


def checked_length(spec: Spec, cases: Sequence[Case], longest: float) -> float:
    """Return a job's simulated time [s]. Raises InvalidRequest beyond the limits."""
    at_once = len(cases) * spec.optimizer.particles
    if at_once > _MOST_WALKS:
        raise InvalidRequest(
            f"an iteration has {at_once} simulations, more than the limit of {_MOST_WALKS};"
            " use fewer particles, scenarios or worlds",
            field="optimizer",
        )
    seconds = spec.budget * duration(spec, cases)
    if seconds > longest:
        raise InvalidRequest(
            f"the job's simulations last {seconds:.3g} s together, more than the limit of"
            f" {longest:.3g} s; use fewer iterations, or fewer or shorter scenarios",
            field="iterations",
        )
    return seconds


class MeasuredRates:
    """Simulated seconds per second on this machine, by kind of simulation. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rates: OrderedDict[str, float] = OrderedDict()

    def rate(
        self, spec: Spec, cases: Sequence[Case], positions: NDArray[np.float64]
    ) -> tuple[float | None, str]:
        """Return the cached or measured rate, and its basis."""
        if any(isinstance(case, LongCase) for case in cases):
            return None, "none: a simulation takes too long to be measured in advance"
        if prepare(spec.robot, precision=spec.precision) != "native":
            return None, "none: without a C compiler simulations are some hundred times slower"
        # Only Linux reports the processors that a process may use.
        affinity = getattr(os, "sched_getaffinity", None)
        cores = len(affinity(0)) if affinity else os.cpu_count() or 1
        with self._lock:
            key = f"{_kind_of_walk(spec)} {min(_MEASURED, len(positions))}"
            rate = self._rates.pop(key, None) or _measure(spec, cases, positions)
            if rate is None:
                return None, "none: the sampled designs are out of the legs' reach"
            self._rates[key] = rate
            if len(self._rates) > _REMEMBERED:
                self._rates.popitem(last=False)
        return cores * rate, (
            f"a simulation measured on this machine, {rate:.3g} simulated s/s, on all of its"
            f" {cores} cores"
        )


def _measure(spec: Spec, cases: Sequence[Case], positions: NDArray[np.float64]) -> float | None:
    """Measure one core on the search's first designs in the shortest case; None if all fail."""
    space = spec.design_space()
    at_once = min(_MEASURED, len(positions))
    if at_once < _MEASURED:
        # The few designs of a method that asks for few at a time may all be unable to walk.
        positions = space.box.evenly(
            RandomNumbers(spec.seed, 0).uniform(_MEASURED, space.box.dimension)
        )
    designs = space.simulated(space.designs(positions[:_MEASURED]))
    case = _shortened(min(cases, key=lambda case: case.duration))
    # Warm up tables and mapped memory.
    case.run(designs[:1])
    begun = time.perf_counter()
    outcomes = [case.run(designs[i : i + at_once]) for i in range(0, _MEASURED, at_once)]
    elapsed = time.perf_counter() - begun
    walked = sum(int((outcome.statuses != Status.UNREACHABLE).sum()) for outcome in outcomes)
    return walked * duration(spec, [case]) / elapsed if walked else None


def _shortened(case: Case) -> Case:
    """Limit a simulation to some seconds; a fit needs its whole recording."""
    if not isinstance(case, Walk | PerturbedWalk):
        return case
    scenario = case.scenario
    cycles = max(1.0, min(scenario.cycles, _LONGEST_WALK / scenario.cycle_time))
    return replace(case, scenario=scenario.model_copy(update={"cycles": cycles}))


def _kind_of_walk(spec: Spec) -> str:
    """Determinants of a simulation's speed: robot, controller, precision, case."""
    if isinstance(spec, CertificateSpec):
        fields = {"controller", "robot", "precision", "engines"}
        return f"world {spec.model_dump_json(include=fields)}"
    # Simulations of recordings are logged, others are not.
    fitted = "recorded" if spec.recording_ids else "calibrated"
    controller = spec.controller if isinstance(spec, JobSpec) else fitted
    return f"{controller} {spec.model_dump_json(include={'robot', 'precision', 'case'})}"


def _typical(space: DesignSpace, name: str) -> float | None:
    """Value of a fixed variable, or the middle of its bounds; None if it is neither."""
    fixed = dict(space.fixed)
    if name in fixed:
        return fixed[name]
    bounds = [(v.low, v.high) for v in space.variables if v.name == name]
    return 0.5 * sum(bounds[0]) if bounds else None
