"""Analyses of jobs"""

from __future__ import annotations

from gaitswarm.requests.identification import Histories
from gaitswarm.services.optimizer.analysis.certificate import certificate
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.views.certificate import CertificateView


def run_certificate(
    histories: Histories, job_id: str, *, worlds: int | None = None, most: int = 5
) -> CertificateView:
    """Summarize a certificate."""
    job = histories.job(job_id)
    spec = job.spec
    if not isinstance(spec, CertificateSpec):
        raise InvalidRequest(
            f"job {job.id} is of kind {spec.kind}; only a certificate has worlds", field="job_id"
        )
    found = certificate(spec, histories.columns(job), worlds=worlds, most=most)
    return CertificateView.from_certificate(job.id, spec, found)
