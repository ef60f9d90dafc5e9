"""Histories of jobs, made of objectives alone."""

from __future__ import annotations

import numpy as np

from gaitswarm.services.optimizer.analysis.utilities import fitness_by
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import PLAIN, Aggregation
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference
from gaitswarm.sim.outcome import Status


def columns_of(
    objectives: np.ndarray,
    failed: tuple[int, ...] = (),
    *,
    particles: int = 1,
    own: Preference = PREFERENCES["A"],
    aggregation: Aggregation = PLAIN,
) -> EvaluationColumns:
    """A job's history.

    objectives: (r, 5) of one scenario, or (r, K, 5); failed: rows whose walks all fell; own:
    preference of the job.
    """
    walks = objectives[:, None] if objectives.ndim == 2 else objectives
    rows, cases, _ = walks.shape
    statuses = np.zeros((rows, cases), dtype=np.uint8)
    statuses[list(failed)] = Status.FELL
    columns = EvaluationColumns(
        iteration=np.arange(rows) // particles,
        particle=np.arange(rows) % particles,
        designs=np.zeros((rows, len(JobSpec().design_space().names))),
        objectives=np.concatenate([walks, np.zeros((rows, cases, 1))], axis=2),
        statuses=statuses,
        fitness=np.empty(rows),
    )
    columns.fitness[:] = fitness_by(columns, own, aggregation=aggregation)
    return columns
