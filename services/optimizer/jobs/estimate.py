"""What a job will cost before it is submitted: how many walks, and how long they take."""

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
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec, create_optimizer
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.case import Case, LongCase, Walk
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.simulate import prepare
from gaitswarm.sim.worlds.walks import PerturbedWalk

_WEIGHT: Final = 0.3
"""Of the last iteration, against all before."""

_LATE: Final = 2.0
"""How many times as long as the last iterations one takes that is said to be late."""


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """Rates so far, and the rest of the budget at the pace of the last iterations.

    Attributes:
        eta_seconds: time to the end of the budget [s]; 0 for a job that succeeded, None unless it
            runs, waits for nothing and has committed something.
        evaluations_per_second: designs judged [1/s]; None before the first commit.
        simulations_per_second: walks, one per case and design that was not known [1/s]; None before
            the first commit, and where the spec cannot be read.
        basis: what `eta_seconds` is derived from, or why it is not known, for people.
    """

    eta_seconds: float | None
    evaluations_per_second: float | None
    simulations_per_second: float | None
    basis: str = field(default="", compare=False)


def recent_pace(before: float | None, latest: float) -> float:
    """The pace of a job when another iteration has ended."""
    return latest if before is None else (1.0 - _WEIGHT) * before + _WEIGHT * latest


def time_left(job: Job, now: datetime) -> TimeLeft:
    """Estimate when a job ends, from its own committed iterations.

    Rates are over the time spent evaluating, so pauses and the time in the queue do not count.
    """
    progress = job.progress
    nothing_known = job.own_evaluations == 0 or progress.compute_seconds <= 0.0
    eta, basis = _without_pace(job, nothing_known=nothing_known)
    if nothing_known:
        return TimeLeft(eta, None, None, basis)
    if not basis:
        eta, basis = _by_pace(job, now)
    walked = progress.evaluations_walked / progress.compute_seconds
    return TimeLeft(
        eta,
        job.own_evaluations / progress.compute_seconds,
        walked * len(job.spec.case_names) if job.readable else None,
        basis,
    )


def _without_pace(job: Job, *, nothing_known: bool) -> tuple[float | None, str]:
    """What is known without any pace, and why; no reason if a pace is all that it takes."""
    if job.state is JobState.SUCCEEDED:
        return 0.0, "it has ended"
    if job.state is not JobState.RUNNING:
        return None, f"not known of a job that is {job.state}"
    if job.waiting is not None:
        return None, "not known while it waits"
    if not job.readable:
        return None, "not known, as its spec cannot be read"
    if nothing_known:
        return None, "not known before its first iteration is committed"
    return None, ""


def _by_pace(job: Job, now: datetime) -> tuple[float, str]:
    progress = job.progress
    average = progress.compute_seconds / job.own_evaluations
    pace = average if progress.recent_seconds is None else progress.recent_seconds
    own = progress.iterations - (job.lineage.own_from if job.lineage else 0)
    one = pace * job.own_evaluations / own
    since = max(0.0, (now - job.updated_at).total_seconds())
    remaining = max(0, job.spec.budget - progress.evaluations) * pace
    basis = f"at the pace of its last iterations, {one:.3g} s each"
    if since > _LATE * one and remaining > 0.0:
        basis += f"; the one under way has taken {since:.3g} s"
    return max(0.0, remaining - min(one, since)), basis


_MOST_JOBS: Final = 5
"""Jobs whose rates are averaged, so that one on a busy machine does not count for all."""

_MEASURED: Final = 8
"""Designs that walk to measure a rate: a multiple of what any kernel takes at once."""

_LONGEST_WALK: Final = 5.0
"""Length of the walk that is measured [s]; a very short one would tell how long tables take."""

_REMEMBERED: Final = 64

_MOST_WALKS: Final = 1_000_000
"""Walks of an iteration: their objectives, 48 B each, are in memory together."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a job would cost.

    Attributes:
        evaluations: designs that are judged.
        walks: each design in each case.
        simulated_seconds: simulated time of all walks together [s].
        seconds: wall time [s], None where nothing is known.
        basis: what the wall time is derived from, for people.
    """

    evaluations: int
    walks: int
    simulated_seconds: float
    seconds: float | None
    basis: str


def estimate(
    spec: Spec, cases: Sequence[Case], earlier: Sequence[Job], measured: MeasuredRates
) -> Estimate:
    """Estimate a job by the rate of jobs like it, or else of a short walk in this thread."""
    evaluations = spec.budget
    one = duration(spec, cases)
    positions = create_optimizer(spec).ask()
    alike = [job for job in earlier if _alike(job, spec, len(positions))][:_MOST_JOBS]
    if alike:
        walked = sum(_simulated_seconds(job, one) for job in alike)
        rate: float | None = walked / sum(job.progress.compute_seconds for job in alike)
        jobs = "1 earlier job" if len(alike) == 1 else f"{len(alike)} earlier jobs"
        basis = f"the rate of {jobs} with the same kind of walks: {rate:.3g} simulated s/s"
    else:
        rate, basis = measured.rate(spec, cases, positions)
    simulated = evaluations * one
    return Estimate(
        evaluations=evaluations,
        walks=evaluations * len(cases),
        simulated_seconds=simulated,
        seconds=None if rate is None else simulated / rate,
        basis=basis,
    )


def duration(spec: Spec, cases: Sequence[Case]) -> float:
    """Simulated time of one design in some of a spec's cases."""
    cycle_time = _typical(spec.design_space(), "cycle_time")
    return sum(
        case.scenario.cycles * cycle_time
        if isinstance(case, Walk | PerturbedWalk) and cycle_time is not None
        else case.duration
        for case in cases
    )


def checked_length(spec: Spec, cases: Sequence[Case], longest: float) -> float:
    """Refuse a job whose walks are too many at once, or last too long."""
    at_once = len(cases) * spec.optimizer.particles
    if at_once > _MOST_WALKS:
        raise InvalidRequest(
            f"an iteration has {at_once} walks, more than the {_MOST_WALKS} that are kept at"
            " once; give it fewer particles, scenarios or worlds",
            field="optimizer",
        )
    seconds = spec.budget * duration(spec, cases)
    if seconds > longest:
        raise InvalidRequest(
            f"all walks of the job last {seconds:.3g} s together, more than the {longest:.3g} s"
            " that a job may have here; give it fewer iterations, or fewer or shorter scenarios",
            field="iterations",
        )
    return seconds


class MeasuredRates:
    """Simulated over elapsed seconds, of this machine, by kind of walk. Thread-safe.

    A rate is measured once and kept: it is an estimate, and whoever fills a form asks often.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rates: OrderedDict[str, float] = OrderedDict()

    def rate(
        self, spec: Spec, cases: Sequence[Case], positions: NDArray[np.float64]
    ) -> tuple[float | None, str]:
        """Measure, unless it was measured before, how fast walks of a spec are simulated.

        Compiles the robot's kernel if need be, as the job itself would.
        """
        if any(isinstance(case, LongCase) for case in cases):
            return None, "nothing: a run takes too long to be measured beforehand"
        if prepare(spec.robot, precision=spec.precision) != "native":
            return None, "nothing: without a C compiler walks take some hundred times as long"
        # Only Linux says which processors a process may use.
        affinity = getattr(os, "sched_getaffinity", None)
        cores = len(affinity(0)) if affinity else os.cpu_count() or 1
        with self._lock:
            key = f"{_kind_of_walk(spec)} {min(_MEASURED, len(positions))}"
            rate = self._rates.pop(key, None) or _measure(spec, cases, positions)
            if rate is None:
                return None, "nothing: the designs that were tried are beyond the legs' reach"
            self._rates[key] = rate
            if len(self._rates) > _REMEMBERED:
                self._rates.popitem(last=False)
        return cores * rate, (
            f"a walk measured on this machine, {rate:.3g} simulated s/s, on all of its"
            f" {cores} cores"
        )


def _measure(spec: Spec, cases: Sequence[Case], positions: NDArray[np.float64]) -> float | None:
    """Simulated seconds per second of one core: a search's first designs in the shortest case.

    None if none of them can begin to walk.
    """
    space = spec.design_space()
    at_once = min(_MEASURED, len(positions))
    if at_once < _MEASURED:
        # A method that asks for few at a time would have nothing measured if those cannot walk.
        positions = space.box.evenly(
            RandomNumbers(spec.seed, 0).uniform(_MEASURED, space.box.dimension)
        )
    designs = space.simulated(space.designs(positions[:_MEASURED]))
    case = _shortened(min(cases, key=lambda case: case.duration))
    # The first walk pays for what later ones find ready: tables, and memory that is mapped.
    case.run(designs[:1])
    begun = time.perf_counter()
    outcomes = [case.run(designs[i : i + at_once]) for i in range(0, _MEASURED, at_once)]
    elapsed = time.perf_counter() - begun
    walked = sum(int((outcome.statuses != Status.UNREACHABLE).sum()) for outcome in outcomes)
    return walked * duration(spec, [case]) / elapsed if walked else None


def _shortened(case: Case) -> Case:
    """A walk of some seconds; a fit needs all of its recording."""
    if not isinstance(case, Walk | PerturbedWalk):
        return case
    scenario = case.scenario
    cycles = max(1.0, min(scenario.cycles, _LONGEST_WALK / scenario.cycle_time))
    return replace(case, scenario=scenario.model_copy(update={"cycles": cycles}))


def _alike(job: Job, spec: Spec, asked: int) -> bool:
    """Whether a job has run walks of the same kind; a fit, to the same recordings.

    Few at once take longer each than many; asked: how many the spec's method asks for first.
    """
    progress = job.progress
    return (
        progress.compute_seconds > 0.0
        and progress.evaluations_walked > 0
        and min(_MEASURED, round(progress.evaluations / progress.iterations))
        == min(_MEASURED, asked)
        and _kind_of_walk(job.spec) == _kind_of_walk(spec)
        and job.spec.recording_ids == spec.recording_ids
    )


def _kind_of_walk(spec: Spec) -> str:
    """What a walk's speed depends on: robot, controller, precision, case; the method."""
    if isinstance(spec, CertificateSpec):
        fields = {"controller", "robot", "precision", "engines"}
        return f"world {spec.model_dump_json(include=fields)}"
    controller = spec.controller if isinstance(spec, JobSpec) else _fitted_walks(spec)
    return f"{controller} {spec.model_dump_json(include={'robot', 'precision', 'case'})}"


def _fitted_walks(spec: Spec) -> str:
    """Of a job that fits parameters: walks to recordings are logged, others are not."""
    return "recorded" if spec.recording_ids else "calibrated"


def _simulated_seconds(job: Job, fitted: float) -> float:
    """What the committed iterations of a job that is like another have walked [s], as planned.

    fitted: simulated time of one design of the other [s]; fits to the same recordings share it.
    """
    recorded = bool(job.spec.recording_ids)
    one = fitted if recorded else duration(job.spec, job.spec.cases({}))
    return job.progress.evaluations_walked * one


def _typical(space: DesignSpace, name: str) -> float | None:
    """Value of a variable that is fixed, or the middle of its bounds; None if it is neither."""
    fixed = dict(space.fixed)
    if name in fixed:
        return fixed[name]
    bounds = [(v.low, v.high) for v in space.variables if v.name == name]
    return 0.5 * sum(bounds[0]) if bounds else None
