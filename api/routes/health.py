"""Whether the server lives, and whether it can work."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from pydantic import Field

from api.context import Service
from api.openapi import problems
from gaitswarm.views import PREFIX, View

router = APIRouter(prefix=PREFIX, tags=["health"])


class HealthView(View):
    """Good news; bad news is a problem."""

    status: Literal["ok"] = Field(default="ok", description="Always `ok`.", examples=["ok"])


@router.get(
    "/healthz", operation_id="healthz", summary="Is the server alive?", responses=problems()
)
async def healthz() -> HealthView:
    """Answers as long as the process does; asks nothing else."""
    return HealthView()


@router.get("/readyz", operation_id="readyz", summary="Can it work?", responses=problems())
def readyz(service: Service) -> HealthView:
    """Answers ok if the database does and has this version's schema, else 503."""
    service.store.ping()
    return HealthView()
