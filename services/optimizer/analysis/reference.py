"""Simulation of a job's reference design, for the gain of its best design"""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import changes_since, job_provenance
from gaitswarm.services.optimizer.jobs.reference import (
    START,
    Reference,
    ReferenceKind,
    reference_design,
)
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import Finite, View
from gaitswarm.sim.case import Walk, run_together
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.worlds.walks import PerturbedWalk

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

NONE: Final = Reference(None, None)
"""For a job with a plug-in's case."""

_JUDGED_BY: Final = frozenset(
    {
        *("robot", "controller", "scenarios", "preference", "variables", "fixed", "worlds"),
        *("scenario_weights", "scenario_aggregate"),
    }
)
"""Fields of a spec on which a reference depends."""

_log = logging.getLogger(__name__)


class ReferenceView(View):
    """The design that a job's best is compared with."""

    name: str = Field(
        description="Study or preference for which it was published, or `start design`.",
        examples=["A"],
    )
    kind: ReferenceKind = Field(
        default="published",
        description="`published`, or without one `start`: the middle of the job's bounds.",
    )
    fitness: Finite = Field(
        description="By the job's measure, in double precision [1]; null if it fails.",
        examples=[20.72],
    )

    @classmethod
    def from_reference(cls, reference: Reference | None) -> ReferenceView | None:
        """Return None without a reference."""
        if reference is None or reference.name is None:
            return None
        return cls.model_validate(reference)


def walked_reference(spec: Spec) -> Reference:
    """Simulate the published or start design of a job in the job's cases."""
    if reference_design(spec) is None:
        return NONE
    return _walked(spec.model_dump_json(include=set(_JUDGED_BY)))


@lru_cache(maxsize=64)
def _walked(judged_by: str) -> Reference:
    spec = JobSpec.model_validate_json(judged_by)
    reference = reference_design(spec)
    if reference is None:
        return NONE
    name, kind, design = reference
    cases = [
        replace(case, variables=tuple(design), precision="double")
        for case in spec.cases({})
        if isinstance(case, Walk | PerturbedWalk)
    ]
    row = np.array([list(design.values())])
    outcomes = run_together(cases, [row] * len(cases))
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    fitness = float(spec.judge(objectives, failed).fitness[0])
    results = objectives[0].astype("<f8").tobytes()
    return Reference(name, fitness if math.isfinite(fitness) else None, kind, results)


def with_reference(store: Store, job: Job) -> tuple[Job, str | None]:
    """Determine and store a job's reference, unless known; return why there is no gain.

    Results do not depend on it. A job computed by other code is left unchanged, as that code may
    have computed another reference.
    """
    if job.reference is None:
        if not job.readable or not isinstance(job.spec, JobSpec):
            return job, "the job is not a tuning job"
        if job.progress.best_fitness is None:
            return job, "no design has succeeded in every scenario yet"
        try:
            if changes_since(job.provenance, job_provenance(job.spec)):
                return job, "the job was computed by other code or libraries"
            reference = walked_reference(job.spec)
        except (SimulationError, OSError) as error:
            return job, f"the reference design cannot be simulated here: {error}"
        store.note_reference(job.id, reference)
        job = replace(job, reference=reference)
    return job, None if job.gain is not None else _why_none(job)


def _why_none(job: Job) -> str:
    reference = job.reference or NONE
    if reference.name is None:
        return "a plug-in evaluates its designs, and none is a reference"
    if reference.fitness is None:
        description = START if reference.kind == "start" else f"published design {reference.name}"
        return f"the {description} fails in one of the scenarios"
    return "no design has succeeded in every scenario yet"


def note_reference(store: Store, job: Job) -> Job:
    """As `with_reference` after a job's end or pause, with errors logged."""
    if job.reference is not None:
        return job
    try:
        job, reason = with_reference(store, job)
    except StoreUnavailable as error:
        # Determined on the next request for the gain.
        _log.warning("job %s: its reference was not determined: %s", job.id, error)
    except Exception:  # noqa: BLE001
        # The job's results are stored and do not depend on it.
        _log.exception("job %s: its reference was not determined", job.id)
    else:
        if reason is not None:
            _log.debug("job %s: no gain: %s", job.id, reason)
    return job
