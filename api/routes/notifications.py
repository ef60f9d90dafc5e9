"""What came of telling others that a job has ended."""

from __future__ import annotations

from fastapi import APIRouter

from gaitswarm.api.dependencies import JobId, Service
from gaitswarm.api.documentation import problems
from gaitswarm.views import PREFIX
from gaitswarm.views.operations import NotificationView

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["jobs"])


@router.get(
    "/notifications",
    operation_id="list_notifications",
    summary="See who was told of its end",
    responses=problems(404, 422),
)
def list_notifications(job_id: JobId, service: Service) -> list[NotificationView]:
    """One for each time that the job ended, if it was submitted with a `Notify-URL`."""
    found = service.store.outbox.about(job_id)
    return [NotificationView.from_notification(notification) for notification in found]
