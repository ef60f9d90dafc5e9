"""Designs of the literature, simulated as a job's own were."""

from __future__ import annotations

from gaitswarm.requests.simulations import SimulationRequest, run_simulation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.reference import adapted_to_job, published_study
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.views import SimulationView


def published_beside(spec: Spec) -> dict[str, SimulationView]:
    """The published optimum of the job's controller and preference, by the name to show.

    Evaluated in the job's scenarios under its preference. Where none was published for that
    preference, the controller's first; none for a job that tunes no drive.
    """
    study = published_study(spec) if isinstance(spec, JobSpec) else None
    if study is None or not isinstance(spec, JobSpec):
        return {}
    return {f"published {study}": published_walk(spec, study)}


def published_walk(spec: JobSpec, study: str) -> SimulationView:
    """A published design in the job's scenarios, under its preference.

    study: name of the design, one that was published for the job's controller.
    """
    published = CONTROLLERS[spec.controller].published[study]
    request = SimulationRequest(
        robot=spec.robot,
        controller=spec.controller,
        design=adapted_to_job(published, spec),
        scenarios=spec.scenarios,
        preference=spec.preference,
    )
    return run_simulation(request)
