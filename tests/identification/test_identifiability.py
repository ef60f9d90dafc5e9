"""Identifiability of parameters from several runs."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.identifiability import (
    THRESHOLDS,
    IdentifiabilityView,
    Trust,
    identifiability,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.sim.variables import Variable

VARIABLES = (
    Variable(name="determined", low=0.0, high=10.0, unit="V"),
    Variable(name="free", low=0.0, high=10.0, unit="kg"),
)


def run(free: float, *, seed: int) -> EvaluationColumns:
    """A swarm that contracts to (4, free), of which the fitness sees the first alone."""
    rng = np.random.default_rng(seed)
    spread = np.linspace(1.0, 0.0, 400)[:, None]
    designs = np.array([4.0, free]) + spread * rng.uniform(-4.0, 4.0, (400, 2))
    fitness = 1.0 + 0.5 * np.abs(designs[:, 0] - 4.0)
    fitness[::50] = np.inf
    zeros = np.zeros(400, dtype=np.int64)
    none = np.zeros((400, 1), dtype=np.uint8)
    return EvaluationColumns(zeros, zeros, designs, np.zeros((400, 1, 3)), none, fitness)


def compared(*runs: EvaluationColumns) -> IdentifiabilityView:
    """Runs whose designs count as good as the best within 5 %."""
    ids = [str(k) for k in range(len(runs))]
    return identifiability(ids, VARIABLES, runs, lambda fitness: 1.05 * fitness)


def test_there_are_twelve_thresholds_from_loose_to_tight() -> None:
    assert len(THRESHOLDS) == 12
    assert list(THRESHOLDS) == sorted(THRESHOLDS, reverse=True)


def test_intervals_are_those_of_the_designs_within_each_threshold() -> None:
    only = run(7.0, seed=1)
    found = compared(only)
    for threshold, interval in zip(THRESHOLDS, found.parameters[0].intervals, strict=True):
        good = only.designs[only.fitness <= found.fitness[0] * (1.0 + threshold), 0]
        assert (interval.low, interval.high) == (good.min(), good.max())
    widths = [interval.high - interval.low for interval in found.parameters[0].intervals]
    assert widths == sorted(widths, reverse=True)
    assert found.designs[0] > found.designs[-1] > 0


def test_runs_that_agree_are_trusted_and_runs_that_do_not_are_not() -> None:
    determined, free = compared(*(run(free, seed=int(free)) for free in (1, 5, 9))).parameters
    assert determined.trust is Trust.TRUSTED
    assert determined.best == pytest.approx(4.0, abs=0.1)
    assert free.trust is Trust.UNKNOWN
    assert len(free.bests) == 3


def test_a_single_run_is_inconclusive() -> None:
    contracted = compared(run(7.0, seed=1)).parameters[1]
    assert contracted.trust is None
