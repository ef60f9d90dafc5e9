"""Designs of the literature, simulated as a job's own were."""

from __future__ import annotations

from gaitswarm.requests.walk import SimulationRequest, run_simulation
from gaitswarm.views import SimulationView
from services.optimizer.jobs.preference import PREFERENCES
from services.optimizer.jobs.spec import Spec
from services.optimizer.jobs.tuning import JobSpec
from sim.controllers import CONTROLLERS


def published_beside(spec: Spec) -> dict[str, SimulationView]:
    """The published optimum of the job's controller and preference, by the name to show.

    Evaluated in the job's scenarios under its preference. Where none was published for that
    preference, the controller's first; none for a job that tunes no drive.
    """
    if not isinstance(spec, JobSpec):
        return {}
    published = CONTROLLERS[spec.controller].published
    wanted = spec.resolved_preference()
    names = [name for name, known in PREFERENCES.items() if known == wanted and name in published]
    study = next(iter([*names, *published]))
    request = SimulationRequest(
        robot=spec.robot,
        controller=spec.controller,
        design=dict(published[study]),
        scenarios=spec.scenarios,
        preference=spec.preference,
    )
    return {f"published {study}": run_simulation(request)}
