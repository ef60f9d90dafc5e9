"""Lets a job's reference walk as its own designs do, so that its gain over that is known."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import changes_since, job_provenance
from gaitswarm.services.optimizer.jobs.reference import START, Reference, reference_design
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.sim.case import Walk, run_together
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.worlds.walks import PerturbedWalk

NONE: Final = Reference(None, None)
"""Of a job of a shipped robot for which nothing was published."""

_JUDGED_BY: Final = frozenset(
    {"robot", "controller", "scenarios", "preference", "variables", "fixed", "worlds"}
)
"""Fields of a spec on which a reference depends."""

_log = logging.getLogger(__name__)


def walked_reference(spec: Spec) -> Reference:
    """Let the published or the start design of a job walk in the job's cases."""
    if reference_design(spec) is None:
        return NONE
    return _walked(spec.model_dump_json(include=set(_JUDGED_BY)))


@lru_cache(maxsize=64)
def _walked(judged_by: str) -> Reference:
    spec = JobSpec.model_validate_json(judged_by)
    found = reference_design(spec)
    if found is None:
        return NONE
    name, kind, design = found
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
    return Reference(name, fitness if math.isfinite(fitness) else None, kind)


def with_reference(store: Store, job: Job) -> tuple[Job, str | None]:
    """Find out what a job's best is measured against, unless that is known, and store it.

    Nothing that determines results depends on it. A job whose numbers come of other code is left
    as it is, as its gain would be over what that code has never computed.
    """
    if job.reference is None:
        if not job.readable or not isinstance(job.spec, JobSpec):
            return job, "it tunes no drive"
        if job.progress.best_fitness is None:
            return job, "it has found no design yet that walks in every scenario"
        try:
            if changes_since(job.provenance, job_provenance(job.spec)):
                return job, "its numbers come of other code, or of other libraries, than there are"
            reference = walked_reference(job.spec)
        except (SimulationError, OSError) as error:
            return job, f"the design that it is compared with cannot walk here: {error}"
        store.note_reference(job.id, reference)
        job = replace(job, reference=reference)
    return job, None if job.gain is not None else _why_none(job)


def _why_none(job: Job) -> str:
    reference = job.reference or NONE
    if reference.name is None:
        return "no design was published for its controller and its robot"
    if reference.fitness is None:
        said = START if reference.kind == "start" else f"published design {reference.name}"
        return f"the {said} does not walk in all of its scenarios"
    return "it has found no design yet that walks in every scenario"


def note_reference(store: Store, job: Job) -> Job:
    """As `with_reference` of a job that has ended or paused; the log says what went wrong."""
    if job.reference is not None:
        return job
    try:
        job, reason = with_reference(store, job)
    except StoreUnavailable as error:
        # It is found out when somebody asks for the gain.
        _log.warning("job %s: its best is compared with nothing yet: %s", job.id, error)
    except Exception:  # noqa: BLE001
        # Whatever it is: the job's results are stored, and need it for nothing.
        _log.exception("job %s: its best is compared with nothing", job.id)
    else:
        if reason is not None:
            _log.debug("job %s: no gain: %s", job.id, reason)
    return job
