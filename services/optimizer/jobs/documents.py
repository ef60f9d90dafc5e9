"""Any job's spec: the union of all kinds, told apart by `kind`."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Discriminator, Tag, TypeAdapter

from services.optimizer.jobs.kinds.calibration import CalibrationSpec
from services.optimizer.jobs.kinds.certificate import CertificateSpec
from services.optimizer.jobs.kinds.identification import IdentificationSpec
from services.optimizer.jobs.kinds.tournament import TournamentSpec
from services.optimizer.jobs.kinds.tuning import JobSpec

_TUNING: Final = "<tuning>"
_IDENTIFICATION: Final = "<identification>"
_CALIBRATION: Final = "<calibration>"
_TOURNAMENT: Final = "<tournament>"
_CERTIFICATE: Final = "<certificate>"


def _kind(value: Any) -> str:
    """Of a document or a spec; a job without one tunes a drive."""
    named = value if isinstance(value, dict) else {"kind": getattr(value, "kind", "tuning")}
    return f"<{named.get('kind', 'tuning')}>"


AnySpec = Annotated[
    Annotated[JobSpec, Tag(_TUNING)]
    | Annotated[IdentificationSpec, Tag(_IDENTIFICATION)]
    | Annotated[CalibrationSpec, Tag(_CALIBRATION)]
    | Annotated[TournamentSpec, Tag(_TOURNAMENT)]
    | Annotated[CertificateSpec, Tag(_CERTIFICATE)],
    Discriminator(
        _kind,
        custom_error_type="unknown_kind",
        custom_error_message="kind: must be tuning, identification, calibration, tournament or"
        " certificate",
    ),
]

SPECS: Final[
    TypeAdapter[JobSpec | IdentificationSpec | CalibrationSpec | TournamentSpec | CertificateSpec]
] = TypeAdapter(AnySpec)
"""Reads a document with a spec of any kind; raises ValidationError for what is none."""
