"""Published designs, simulated in a job's scenarios under its preference."""

from __future__ import annotations

from gaitswarm.requests.simulations import SimulationRequest, run_simulation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.reference import adapted_to_job, published_study
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.views import SimulationView


def published_results(spec: Spec) -> dict[str, SimulationView]:
    """Return the published optimum for the job's controller and preference, by label.

    If none was published for that preference, the controller's first; none for jobs that tune no
    drive.
    """
    study = published_study(spec) if isinstance(spec, JobSpec) else None
    if study is None or not isinstance(spec, JobSpec):
        return {}
    return {f"published {study}": published_walk(spec, study)}


def published_walk(spec: JobSpec, study: str) -> SimulationView:
    published = CONTROLLERS[spec.controller].published[study]
    request = SimulationRequest(
        robot=spec.robot,
        controller=spec.controller,
        design=adapted_to_job(published, spec),
        scenarios=spec.scenarios,
        preference=spec.preference,
    )
    return run_simulation(request)
