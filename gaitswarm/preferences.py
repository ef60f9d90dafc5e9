"""`gaitswarm.robust_preferences`: the preference whose winner is the most robust."""

from __future__ import annotations

from functools import partial

import numpy as np

from gaitswarm.jobs.base import Jobs
from gaitswarm.robustness_index import Progress, sampled_indices
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferencesRequest,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.preferences import (
    robust_preferences as ranked_preferences,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Status
from gaitswarm.specs import checked


def robust_preferences(
    jobs: Jobs,
    job_id: str,
    *,
    drawn: int = 512,
    candidates: int = 8,
    samples: int = 128,
    radius: float = 0.02,
    seed: int = 1,
    precision: Precision = "double",
    progress: Progress | None = None,
) -> RobustPreferencesView:
    """Find the preference whose winner among a job's designs is the most robust.

    The designs are ranked under A, B and C (table 4.5) and under preferences that are drawn at
    random; the robustness index (thesis 4.4.3) of the winners is estimated by simulation. Only
    designs of the job can win. `Jobs.preferences` simulates them where the jobs are.

    Args:
        jobs: Database or server of the job.
        job_id: Identifier of a job that tunes a drive.
        drawn: How many preferences to draw.
        candidates: Winners to simulate: those of A, B and C, and of the others those that win under
            most preferences.
        samples: Designs to simulate around each; 0 for no simulation and no index.
        radius: How far they are from it at most, as a share of each variable's bounds.
        seed: Of preferences and samples.
        precision: Of the physics' numbers.
        progress: Called with the number of simulations done and their total.

    Returns:
        The candidates, the most robust first, with their loss under the job's own preference.

    Raises:
        InvalidRequest: The job tunes no drive, or an argument is invalid; names it.
        Conflict: No design of the job succeeds in all scenarios.
    """
    document = {
        "drawn": drawn,
        "candidates": candidates,
        "samples": samples,
        "radius": radius,
        "seed": seed,
        "precision": precision,
    }
    request, table = checked(PreferencesRequest, document), jobs.evaluations(job_id)
    columns = EvaluationColumns(
        table.iteration,
        table.particle,
        table.designs,
        table.objectives,
        # Rankings do not distinguish failures.
        np.where(table.statuses == Status.OK.label, Status.OK, Status.FELL).astype(np.uint8),
        np.where(np.isfinite(table.fitness), table.fitness, np.inf),
    )
    index = partial(sampled_indices, progress=progress)
    return ranked_preferences(job_id, jobs.job(job_id).spec, columns, request, index)
