"""Reference designs: simulated for the gain of a job's best design, and for its constraints"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from gaitswarm.services.optimizer.errors import GaitswarmError, InvalidRequest, StoreUnavailable
from gaitswarm.services.optimizer.jobs.constraints import (
    PUBLISHED,
    Constraint,
    ReferenceChoice,
    reference_choice,
)
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import (
    GIVEN,
    Job,
    Reference,
    ReferenceKind,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import (
    JobSpec,
    adapted_to_job,
    nearest_design,
    reference_design,
)
from gaitswarm.services.optimizer.jobs.preference import by_design
from gaitswarm.services.optimizer.jobs.provenance import changes_since, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.case import run_together
from gaitswarm.sim.catalogue import GAIT_VARIABLES, design_numbers
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Outcome, Status

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store


S = TypeVar("S", bound=Spec)

NONE: Final = Reference(None, None)
"""For a job with a plug-in's case."""

_JUDGED_BY: Final = {
    *("robot", "controller", "scenarios", "preference", "variables", "fixed", "worlds"),
    *("scenario_weights", "scenario_aggregate", "case"),
}
"""Fields of a spec on which a reference depends."""

_log = logging.getLogger(__name__)


def walked_reference(spec: JobSpec) -> Reference:
    """Simulate the published or start design of a job in the job's cases."""
    reference = reference_design(spec)
    return NONE if reference is None else _walked(spec, spec.controller, *reference)


def _walked(
    spec: JobSpec,
    controller: ControllerName,
    name: str,
    kind: ReferenceKind,
    design: Mapping[str, float],
) -> Reference:
    judged_by = spec.model_dump_json(include=_JUDGED_BY)
    objectives, failed = by_design(_simulated(judged_by, controller, tuple(design.items())))
    fitness = float(JobSpec.model_validate_json(judged_by).judge(objectives, failed).fitness[0])
    results = objectives[0].astype("<f8").tobytes()
    return Reference(name, fitness if math.isfinite(fitness) else None, kind, results)


@lru_cache(maxsize=64)
def _simulated(
    judged_by: str, controller: ControllerName, design: tuple[tuple[str, float], ...]
) -> tuple[Outcome, ...]:
    """Simulate a design of any controller in the cases of a job, in double precision."""
    spec = JobSpec.model_validate_json(judged_by)
    cases = spec.cases_of(controller, tuple(name for name, _ in design))
    return run_together(cases, [np.array([[value for _, value in design]])] * len(cases))


def with_references(
    spec: S,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
    *,
    starts: bool,
    longest: float = math.inf,
) -> S:
    """Return a spec whose constraints have the values of their references, simulated in double.

    longest: limit on the simulated time of all references [s]. starts: whether a job without start
    designs starts from the references.
    """
    if not isinstance(spec, JobSpec) or not spec.constraints:
        return spec
    relative = {str(c.relative_to): k for k, c in enumerate(spec.constraints) if c.relative_to}
    seconds = len(relative) * duration(spec, spec.cases({})) if longest < math.inf else 0.0
    if relative and seconds > longest:
        raise InvalidRequest(
            f"the simulations of the references last {seconds:g} s in total, more than the"
            f" {longest:g} s allowed; choose fewer references, scenarios, cycles or worlds",
            field=f"constraints.{max(relative.values())}.relative_to",
        )
    constraints, start = [], list[dict[str, float | str]]()
    for index, constraint in enumerate(spec.constraints):
        values = None
        try:
            if constraint.relative_to is not None:
                controller, design = _referred(spec, constraint.relative_to, job_of, best_of)
                values = _values(spec, constraint, controller, design)
                nearest = nearest_design(spec, design) if controller == spec.controller else None
                start += [nearest] if starts and nearest and nearest not in start else []
        except (GaitswarmError, SimulationError, ValueError) as error:
            message = str(error).removeprefix("relative_to: ")
            field = f"constraints.{index}.relative_to"
            raise InvalidRequest(message, field=field) from error
        constraints.append(constraint.model_copy(update={"reference": values}))
    changes = {
        "constraints": tuple(constraints),
        "start": spec.start or tuple(start[: spec.budget]),
    }
    resolved = spec.model_copy(update=changes)
    try:
        resolved.limits()
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        raise InvalidRequest(message, field=field) from error
    return resolved


def _values(
    spec: JobSpec,
    constraint: Constraint,
    controller: ControllerName,
    design: Mapping[str, float],
) -> dict[str, dict[str, float]]:
    """Simulate a reference and return its values by case and quantity."""
    judged_by = spec.model_dump_json(include=_JUDGED_BY)
    outcomes = _simulated(judged_by, controller, tuple(design.items()))
    values: dict[str, dict[str, float]] = {}
    for case, column in spec.constraint_cases.limited(constraint):
        name, status = spec.case_names[case], Status(outcomes[case].statuses[0])
        if status is not Status.OK:
            raise ValueError(f"it fails in {name}: {status.phrase}")
        value = float(outcomes[case].objectives[0, column])
        values.setdefault(name, {})[spec.columns[column].name] = value
    return values


def _referred(
    spec: JobSpec,
    reference: ReferenceChoice,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
) -> tuple[ControllerName, Mapping[str, float]]:
    """Return the controller and the design of a reference."""
    law = CONTROLLERS[spec.controller]
    if not isinstance(reference, str):
        return spec.controller, _complete_design(spec, reference)
    if reference.startswith(PUBLISHED):
        name = reference.removeprefix(PUBLISHED)
        if name not in law.published:
            raise ValueError(
                f"no published design {name!r} of {spec.controller};"
                f" {instead_of(name, law.published)}"
            )
        return spec.controller, adapted_to_job(law.published[name], spec)
    other, best = job_of(reference).spec, best_of(reference)
    if not isinstance(other, JobSpec):
        raise InvalidRequest(f"job {reference} is of kind {other.kind}, which tunes no controller")
    if best is None:
        raise ValueError(f"job {reference} has no feasible design yet")
    space = other.design_space()
    (values,) = space.simulated(best.design[np.newaxis]).tolist()
    return other.controller, dict(zip(space.names, values, strict=True))


def _complete_design(spec: JobSpec, design: Mapping[str, float | str]) -> dict[str, float]:
    """Check a design; conventions and gait that it omits are those of the job."""
    law = CONTROLLERS[spec.controller]
    known = [v.name for v in (*law.variables, *law.conventions, *GAIT_VARIABLES)]
    for name in design:
        if name not in known:
            raise ValueError(f"unknown variable {name!r}; {instead_of(name, known)}")
    missing = [v.name for v in law.variables if v.name not in design]
    if missing:
        raise ValueError(f"the design has no {', '.join(missing)}")
    return adapted_to_job({}, spec) | design_numbers(spec.controller, design)


def with_other_reference(
    job: Job,
    spec: JobSpec,
    against: str,
    job_of: Callable[[str], Job],
    best_of: Callable[[str], Evaluation | None],
) -> tuple[Job, str | None]:
    """Return a job with another reference, which is not stored, and why there is no gain."""
    if spec.case is not None:
        raise InvalidRequest("a plug-in evaluates the designs of the job", field="against")
    try:
        choice, name = reference_choice(against), GIVEN
        kind: ReferenceKind = "design"
        if isinstance(choice, str):
            name = choice.removeprefix(PUBLISHED)
            kind = "job" if name == choice else "published"
        controller, design = _referred(spec, choice, job_of, best_of)
        reference = _walked(spec, controller, name, kind, design)
    except (GaitswarmError, SimulationError, ValueError) as error:
        raise InvalidRequest(str(error), field="against") from error
    job = replace(job, reference=reference)
    return job, None if job.gain is not None else _why_none(job)


def with_reference(store: Store, job: Job) -> tuple[Job, str | None]:
    """Determine and store a job's reference, unless known; return why there is no gain."""
    if job.reference is None:
        if not job.readable or not isinstance(job.spec, JobSpec):
            return job, "the job is not a tuning job"
        if job.progress.best_fitness is None:
            return job, "no design is feasible yet"
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
        return f"{reference.title} fails in one of the scenarios"
    return "no design is feasible yet"


def note_reference(store: Store, job: Job) -> Job:
    """As `with_reference` after a job's end or pause, with errors logged."""
    if job.reference is not None:
        return job
    try:
        job, _ = with_reference(store, job)
    except StoreUnavailable as error:
        # Determined on the next request for the gain.
        _log.warning("job %s: its reference was not determined: %s", job.id, error)
    except Exception:  # noqa: BLE001
        # The job's results are stored and do not depend on it.
        _log.exception("job %s: its reference was not determined", job.id)
    return job
