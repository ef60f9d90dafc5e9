"""Union of the specs of all kinds of jobs, discriminated by `kind`"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

from pydantic import Discriminator, Tag, TypeAdapter, ValidationError

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.input import Imported, message_of


def _kind(value: Any) -> str:
    """Tag of a document or spec; the default kind is tuning."""
    document = value if isinstance(value, dict) else {"kind": getattr(value, "kind", "tuning")}
    return f"<{document.get('kind', 'tuning')}>"


if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.kinds.calibration import (
        CalibrationSpec,
        IdentificationSpec,
    )
    from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
    from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

    AnySpec = JobSpec | IdentificationSpec | CalibrationSpec | CertificateSpec | PreferencesSpec
else:

    def _spec(kind, name, module=None):
        """Member of the union, which is imported when a document of its kind is validated."""
        path = f"gaitswarm.services.optimizer.jobs.kinds.{module or kind}"
        return Annotated[Any, Imported(path, name), Tag(f"<{kind}>")]

    AnySpec = Annotated[
        _spec("tuning", "JobSpec")
        | _spec("identification", "IdentificationSpec", "calibration")
        | _spec("calibration", "CalibrationSpec")
        | _spec("certificate", "CertificateSpec")
        | _spec("preferences", "PreferencesSpec"),
        Discriminator(
            _kind,
            custom_error_type="unknown_kind",
            custom_error_message="kind: must be tuning, identification, calibration, certificate"
            " or preferences",
        ),
    ]

SPECS: Final[TypeAdapter[AnySpec]] = TypeAdapter(AnySpec)
"""Validates a spec of any kind; raises ValidationError."""


def checked_spec(spec: AnySpec, changes: Mapping[str, Any]) -> AnySpec:
    """Return a spec with changed fields, validated, so that it can be stored and read again."""
    try:
        return SPECS.validate_python({**spec.model_dump(), **changes})
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = [str(part) for part in first["loc"] if not str(part).startswith("<")]
        message = message_of(first)
        field, colon, rest = message.partition(": ")
        if not where and colon and " " not in field:
            where, message = [field], rest
        raise InvalidRequest(message, field=".".join(where)) from error


def check_budget(spec: AnySpec, iterations: int) -> None:
    """Check that a job may have another budget."""
    try:
        checked_spec(spec.with_budget(iterations), {})
    except InvalidRequest as error:
        text = str(error).removeprefix("iterations: ")
        raise InvalidRequest(text, field="iterations") from error
