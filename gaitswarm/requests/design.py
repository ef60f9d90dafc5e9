"""The design that a job stands for, with all that it walks with. Knows nothing of HTTP."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Protocol

from gaitswarm.views import JobView
from services.optimizer.errors import InvalidRequest, NotFound
from services.optimizer.jobs.certificate import CertificateSpec
from services.optimizer.jobs.preference import Preference
from services.optimizer.jobs.tuning import JobSpec
from sim.controllers import ControllerName
from sim.robot import RobotSource
from sim.scenario import Scenario

_JOB_ID: Final = re.compile(r"[23456789bcdfghjkmnpqrstvwxz]{12}")


class Jobs(Protocol):
    """Where jobs are."""

    def job(self, job_id: str) -> JobView:
        """A job.

        Args:
            job_id: identifier of the job.
        """


@dataclass(frozen=True, slots=True)
class DesignOfJob:
    """What a job stands for where a design is wanted.

    Attributes:
        spec: Of the job.
        robot: That walks.
        controller: That drives it.
        design: Values by name, choices by theirs.
        preference: By which the job judges.
        scenarios: In which it does.
    """

    spec: JobSpec | CertificateSpec
    robot: RobotSource
    controller: ControllerName
    design: dict[str, float | str]
    preference: Preference
    scenarios: tuple[Scenario, ...]


def may_be_job(text: str) -> bool:
    """Whether a text has the form of a job's identifier.

    Args:
        text: Any text.

    Returns:
        True for twelve letters and digits of those that identifiers have.
    """
    return _JOB_ID.fullmatch(text) is not None


def design_of_job(jobs: Jobs, job_id: str) -> DesignOfJob:
    """The best design of a job that tunes a drive, or the one that a certificate is of.

    Args:
        jobs: Where the job is.
        job_id: Identifier of the job.

    Returns:
        The design with its robot, controller, preference and scenarios.

    Raises:
        NotFound: There is no such job, or no design of it has walked in every scenario yet.
        InvalidRequest: The job is of a kind that finds no design.
    """
    job = jobs.job(job_id)
    spec = job.spec
    if isinstance(spec, CertificateSpec):
        design = dict(spec.design)
    elif isinstance(spec, JobSpec):
        if job.best is None:
            raise NotFound(f"job {job_id} has no design yet that walks in every scenario")
        design = job.best.design
    else:
        raise InvalidRequest(
            f"job {job_id} is of kind {spec.kind}, which finds no design", field="design"
        )
    return DesignOfJob(
        spec=spec,
        robot=spec.robot,
        controller=spec.controller,
        design=design,
        preference=spec.resolved_preference(),
        scenarios=spec.resolved_scenarios(),
    )
