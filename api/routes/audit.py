"""The audit log, for administrators."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from gaitswarm.api.access import may_administer
from gaitswarm.api.dependencies import JobIdText, Service
from gaitswarm.api.documentation import problems
from gaitswarm.views import PREFIX, PageView
from gaitswarm.views.operations import AuditEntryView

router = APIRouter(prefix=PREFIX, tags=["jobs"])


@router.get(
    "/audit",
    operation_id="read_audit",
    summary="Who did what",
    dependencies=[Depends(may_administer)],
    responses=problems(403, 422),
)
def read_audit(
    service: Service,
    job_id: Annotated[
        JobIdText | None, Query(description="Only changes of the job of this id.")
    ] = None,
    after: Annotated[
        str | None, Query(max_length=200, description="`next` of the page before.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Most entries on a page.")] = 50,
) -> PageView[AuditEntryView]:
    """Changes to jobs and tokens, the newest first.

    Needs a token of scope `admin`, where the server asks for tokens.
    """
    page = service.store.audit(job_id=job_id, after=after, limit=limit)
    return PageView(items=[AuditEntryView.from_entry(e) for e in page.items], next=page.next)
