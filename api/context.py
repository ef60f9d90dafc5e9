"""What the routes need: the service, the settings, and the news that the server is stopping."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import Annotated, cast

import anyio
from fastapi import Depends, Path, Request
from pydantic import Field

from gaitswarm.settings import Settings
from services.optimizer.jobs.job import Job
from services.optimizer.service import JobService


@dataclass(slots=True)
class ApiContext:
    """Of one application.

    stopping: set in the event loop when the server begins to stop; event streams end then.
    """

    service: JobService
    settings: Settings
    stopping: asyncio.Event = field(default_factory=asyncio.Event)
    simulations: anyio.CapacityLimiter | None = None

    def simulation_slots(self) -> anyio.CapacityLimiter:
        """Limiter of simulations that compute at once; made in the event loop, on first use."""
        if self.simulations is None:
            self.simulations = anyio.CapacityLimiter(self.settings.api_simulation_workers)
        return self.simulations


def context(request: Request) -> ApiContext:
    """The application's context."""
    return cast(ApiContext, request.app.state.context)


def service(request: Request) -> JobService:
    """The application's service."""
    return context(request).service


Context = Annotated[ApiContext, Depends(context)]
Service = Annotated[JobService, Depends(service)]

JobIdText = Annotated[
    str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_-]+$", examples=["k2q7zr5dm9xw"])
]

JobId = Annotated[
    JobIdText, Path(description="Identifier of the job, as POST /v1/jobs answered it.")
]


def existing_job(job_id: JobId, service: Service) -> Job:
    """The job of the path, or NotFound before any answer has begun."""
    return service.job(job_id)


ExistingJob = Annotated[Job, Depends(existing_job)]
