"""Certificates of a job's designs in its evidence."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gaitswarm.evidence.archive import parsed_json
from gaitswarm.services.optimizer.analysis.certificate import CertificateView, certificate
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.service import JobService

FOLDER: Final = "certificates"
"""Folder of an archive with a subfolder for each certificate, named by its id."""

SUMMARY: Final = "certificate.json"

WORST: Final = 20
"""Worst worlds that a summary names."""

_TOLERANCE: Final = 1e-9
"""Relative tolerance for numbers computed by statistics libraries."""


@dataclass(frozen=True, slots=True)
class Certified:
    """A certificate of one of a job's designs.

    Attributes:
        job: The certificate.
        iteration: Iteration of the design in that job.
        particle: The design's place in it.
        of_best: Whether the design is that job's best.
    """

    job: Job
    iteration: int
    particle: int
    of_best: bool


def certificates_of(
    service: JobService, job: Job, columns: EvaluationColumns, best: tuple[int, int] | None
) -> list[Certified]:
    """Find the finished certificates of a job's designs."""
    if not isinstance(job.spec, JobSpec):
        return []
    found = []
    for certificate_job in _finished(service):
        place = certified_at(job.spec, columns, certificate_job.spec)
        if place is not None:
            found.append(Certified(certificate_job, *place, of_best=place == best))
    return sorted(found, key=lambda one: (not one.of_best, one.job.created_at, one.job.id))


def certified_at(
    spec: JobSpec, columns: EvaluationColumns, certificate_spec: AnySpec
) -> tuple[int, int] | None:
    """Find the design of a job that a certificate is of."""
    if not isinstance(certificate_spec, CertificateSpec):
        return None
    space, numbers = spec.design_space(), certificate_spec.numbers
    if certificate_spec.controller != spec.controller or set(numbers) != set(space.names):
        return None
    wanted = np.array([numbers[name] for name in space.names])
    (rows,) = np.nonzero((space.simulated(columns.designs) == wanted).all(axis=1))
    if not len(rows):
        return None
    return int(columns.iteration[rows[0]]), int(columns.particle[rows[0]])


def how_to_make_one(job_id: str) -> str:
    """Explain how to add a certificate to a job's evidence."""
    return f"`gaitswarm certify {job_id}` makes one, and evidence written afterwards includes it"


def summary(job_id: str, spec: CertificateSpec, columns: EvaluationColumns) -> CertificateView:
    """Summarize a certificate."""
    return certificate(job_id, spec, columns, most=WORST)


def by_certificate(members: Mapping[str, bytes]) -> dict[str, dict[str, bytes]]:
    """Sort members of an archive by the certificate that they belong to."""
    found: dict[str, dict[str, bytes]] = {}
    for name, content in members.items():
        folder, _, rest = name.partition("/")
        job_id, slash, own = rest.partition("/")
        if folder == FOLDER and slash:
            found.setdefault(job_id, {})[own] = content
    return found


def summary_differs(
    job_id: str, spec: CertificateSpec, columns: EvaluationColumns, content: bytes
) -> str | None:
    """Compare a certificate's summary with its evaluations."""
    here = json.loads(summary(job_id, spec, columns).model_dump_json())
    return next(_differences(here, parsed_json(content, SUMMARY), ""), None)


def _finished(service: JobService) -> Iterator[Job]:
    after: str | None = None
    while True:
        page = service.store.jobs(state=JobState.SUCCEEDED, kind="certificate", after=after)
        yield from (job for job in page.items if job.readable)
        if page.next is None:
            return
        after = page.next


def _differences(here: Any, there: Any, path: str) -> Iterator[str]:
    """Yield the paths at which two JSON documents differ."""
    if isinstance(here, dict) and isinstance(there, dict) and here.keys() == there.keys():
        for name in here:
            yield from _differences(here[name], there[name], f"{path}.{name}" if path else name)
    elif isinstance(here, list) and isinstance(there, list) and len(here) == len(there):
        for number, (ours, theirs) in enumerate(zip(here, there, strict=True)):
            yield from _differences(ours, theirs, f"{path}.{number}")
    elif isinstance(here, float) and isinstance(there, float):
        if not math.isclose(here, there, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE):
            yield path
    elif here != there:
        yield path
