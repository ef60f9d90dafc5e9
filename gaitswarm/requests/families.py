"""Which scenarios of a job matter. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitswarm.requests.targets import Histories
from gaitswarm.services.optimizer.analysis.robustness.scenario_families import scenario_families
from gaitswarm.services.optimizer.analysis.utilities import log_utilities
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.views.families import ScenarioFamiliesView

TOLERANCE: Final = 0.01
"""Regret of the smallest family, by default [1]."""


def run_scenario_families(
    histories: Histories, job_id: str, tolerance: float
) -> ScenarioFamiliesView:
    """Judge a job's designs by fewer scenarios, from what is stored."""
    if not 0.0 <= tolerance < np.inf:
        raise InvalidRequest("must be at least 0", field="tolerance")
    job = histories.job(job_id)
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive has scenarios",
            field="job_id",
        )
    columns = histories.columns(job)
    spec, names = job.spec, [scenario.name for scenario in job.spec.resolved_scenarios()]
    judged = log_utilities(columns, spec.resolved_preference())
    if spec.worlds is not None:
        judged = spec.worlds.aggregated(judged)
    if not np.isfinite(judged).all(axis=1).any():
        raise Conflict(f"job {job_id} has no design yet that walks in all scenarios")
    found = scenario_families(judged, tolerance=tolerance)
    return ScenarioFamiliesView.from_families(found, names, columns)
