"""Columns of evaluations, made up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.preference import Preference, judge
from gaitswarm.sim.outcome import RESULTS, Status


def columns_of(
    objectives: NDArray[np.float64],
    statuses: NDArray[np.uint8] | None = None,
    *,
    particles: int = 1,
    preference: Preference | None = None,
    designs: NDArray[np.float64] | None = None,
) -> EvaluationColumns:
    """objectives: (r, K, m), measurements are 0; the job's own fitness is that of `preference`."""
    rows, missing = len(objectives), len(RESULTS) - objectives.shape[2]
    objectives = np.pad(objectives, ((0, 0), (0, 0), (0, missing)))
    if statuses is None:
        statuses = np.zeros(objectives.shape[:2], dtype=np.uint8)
    fitness = np.full(rows, math.inf)
    if preference is not None:
        fitness = judge(objectives, statuses != Status.OK, preference).fitness
    return EvaluationColumns(
        iteration=np.arange(rows) // particles,
        particle=np.arange(rows) % particles,
        designs=np.zeros((rows, 1)) if designs is None else designs,
        objectives=objectives,
        statuses=statuses,
        fitness=fitness,
    )


def fitness_only(*swarms: tuple[float, ...]) -> EvaluationColumns:
    """One iteration for every swarm's fitness."""
    fitness = np.array(swarms, dtype=np.float64)
    found = columns_of(np.ones((fitness.size, 1, 6)), particles=fitness.shape[1])
    return replace(found, fitness=fitness.reshape(-1))
