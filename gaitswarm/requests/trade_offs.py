"""What a job's designs trade, from what is stored. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitswarm.places import place_of
from gaitswarm.requests.targets import Histories
from gaitswarm.services.optimizer.analysis.trade_offs.front import pareto_front
from gaitswarm.services.optimizer.analysis.trade_offs.winning_preference import preference_fits
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.views.trade_offs import FrontView, PreferenceForView

DESIGNS: Final = 1000
"""Designs of a front that are listed, by default."""

MOST_DESIGNS: Final = 10_000
"""Designs of a front that can be listed."""


def run_front(histories: Histories, job_id: str, *, most: int) -> FrontView:
    """Find the Pareto front of a job, from what is stored."""
    if not 1 <= most <= MOST_DESIGNS:
        raise InvalidRequest(f"must be 1 to {MOST_DESIGNS}", field="most")
    spec, columns = _tuning(histories, job_id)
    vectors = objective_vectors(columns, worlds=spec.worlds)
    if not np.isfinite(vectors).any():
        raise Conflict(f"job {job_id} has no design yet that walks in all scenarios")
    front = pareto_front(columns, vectors, worlds=spec.worlds)
    return FrontView.from_front(front, columns, spec, most=most)


def run_preference_for(
    histories: Histories, job_id: str, iteration: int, particle: int
) -> PreferenceForView:
    """Find the preference under which a design wins its job, from what is stored."""
    for field, number in (("iteration", iteration), ("particle", particle)):
        if number < 0:
            raise InvalidRequest("must be at least 0", field=field)
    spec, columns = _tuning(histories, job_id)
    rows = np.flatnonzero((columns.iteration == iteration) & (columns.particle == particle))
    if not len(rows):
        raise NotFound(f"job {job_id} has no design {place_of(iteration, particle)}")
    row = int(rows[0])
    if not np.isfinite(objective_vectors(columns.rows(rows), worlds=spec.worlds)).all():
        raise Conflict(
            f"design {place_of(iteration, particle)} fails in a scenario, so that it wins under no"
            " preference"
        )
    fits = preference_fits(columns, row, spec.resolved_preference(), worlds=spec.worlds)
    return PreferenceForView.from_fits(row, fits, columns, spec)


def _tuning(histories: Histories, job_id: str) -> tuple[JobSpec, EvaluationColumns]:
    job = histories.job(job_id)
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive has objectives"
            " to trade",
            field="job_id",
        )
    return job.spec, histories.columns(job)
