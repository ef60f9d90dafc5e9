"""Estimates of the total cost of jobs before submission"""

from __future__ import annotations

import os
import threading
import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.time_left import EstimateView
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.case import Case, LongCase, Walk
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.simulate import prepare
from gaitswarm.sim.worlds.walks import PerturbedWalk

_MEASURED: Final = 8
"""Designs simulated to measure a rate: a multiple of every kernel's lanes."""

_LONGEST_WALK: Final = 5.0
"""Length of the measured simulation [s]; a very short one would measure table setup."""

_REMEMBERED: Final = 64

_MOST_WALKS: Final = 1_000_000
"""Limit on simulations per iteration: their results, some 130 B each, are in memory together."""


def estimate(spec: Spec, cases: Sequence[Case], measured: MeasuredRates) -> EstimateView:
    """Estimate a job from the rate of a short simulation in this thread."""
    walked = spec.tuning if isinstance(spec, PreferencesSpec) else spec
    walks = walked.cases({}) if walked is not spec else cases
    rate, basis = measured.rate(walked, walks, walked.create_search().ask())
    simulated = spec.budget * duration(spec, cases)
    return EstimateView(
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
