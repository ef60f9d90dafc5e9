"""Designs of the literature, simulated as a job's own were."""

from __future__ import annotations

from collections.abc import Mapping

from gaitswarm.requests.walk import SimulationRequest, run_simulation
from gaitswarm.views import SimulationView
from services.optimizer.jobs.kinds.tuning import JobSpec
from services.optimizer.jobs.preference import PREFERENCES
from services.optimizer.jobs.spec import Spec
from sim.controllers import CONTROLLERS
from sim.gait_variables import GAIT_CATALOGUE


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
    study = next(iter([*names, *published]), None)
    if study is None:
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
        design=on_the_jobs_terms(published, spec),
        scenarios=spec.scenarios,
        preference=spec.preference,
    )
    return run_simulation(request)


def on_the_jobs_terms(published: Mapping[str, float], spec: JobSpec) -> dict[str, float]:
    """A published design for comparison with what a job finds.

    published: a design with or without a gait of its own.

    It walks in its own gait only as far as the job searches the gait; else in the gait that all of
    the job's designs have. So with conventions that the job holds fixed.
    """
    space = spec.design_space()
    searched = {variable.name for variable in space.variables}
    conventions = {variable.name for variable in CONTROLLERS[spec.controller].conventions}
    held = {
        name: value for name, value in space.fixed if name in conventions or name in GAIT_CATALOGUE
    }
    own = {
        name: value
        for name, value in published.items()
        if name not in GAIT_CATALOGUE or name in searched
    }
    return own | held
