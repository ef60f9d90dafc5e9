"""The certificate that options of the command line ask for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from cli.design_file import read_design
from cli.robots import chosen_robot, scenario_data
from cli.spec_file import parse_spec
from gaitswarm.requests.design import design_of_job, may_be_job
from services.optimizer.errors import InvalidRequest
from services.optimizer.jobs.certificate import CertificateSpec, certificate_scenarios
from sim.controllers import CONTROLLERS
from sim.worlds import PERTURBATIONS

if TYPE_CHECKING:
    from gaitswarm.requests.design import DesignOfJob

_PLAIN: Final = ("worlds", "seed", "preference", "precision", "name")
"""Options that are fields of the spec."""


def certificate_spec(design: str, db: str | None, given: Mapping[str, Any]) -> CertificateSpec:
    """The job that a command asks for.

    Args:
        design: As the command names it.
        db: The database to look for a job in, as `--db` names it.
        given: Options that were given: controller, worlds, seed, scenarios, ranges, fixed, only,
            robot, preference, precision, name.

    Returns:
        The spec, checked.

    Raises:
        InvalidRequest: Something makes no sense; names the option or field.
        NotFound: No such job or database, or a job without a design.
    """
    options = {name: value for name, value in given.items() if value is not None}
    if may_be_job(design) and not Path(design).exists():
        document = _of_job(design, db, options)
    else:
        document = _of_design(design, options)
    document |= {
        k: options[k] for k in ("worlds", "seed", "preference", "precision", "name") if k in options
    }
    if "scenarios" in options:
        # A job's scenarios have names there, whether they are presets or its own.
        known = {scenario.name: scenario for scenario in document.get("scenarios", ())}
        chosen = scenario_data(options["scenarios"])
        document["scenarios"] = [
            known.get(entry, entry) if isinstance(entry, str) else entry for entry in chosen
        ]
    if "robot" in options:
        document["robot"] = chosen_robot(options["robot"])
    document |= _perturbations(document, options)
    return cast(CertificateSpec, parse_spec(document))


def _of_job(job_id: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any]:
    from gaitswarm.jobs.open import open_jobs

    if "controller" in options:
        raise InvalidRequest("is that of the job; leave it out", field="controller")
    with open_jobs(None, db) as jobs:
        found = design_of_job(jobs, job_id)
    if isinstance(found.spec, CertificateSpec):
        document = found.spec.model_dump() | {"scenarios": found.scenarios}
        # They follow from the number of worlds.
        del document["iterations"]
        return document
    return {**_document(found), "name": f"certificate of {found.spec.name or job_id}"}


def _document(found: DesignOfJob) -> dict[str, Any]:
    return {
        "kind": "certificate",
        "robot": found.robot,
        "controller": found.controller,
        "design": found.design,
        "preference": found.preference,
        "scenarios": certificate_scenarios(found.scenarios),
    }


def _of_design(design: str, options: Mapping[str, Any]) -> dict[str, Any]:
    controller = options.get("controller") or _controller_of(design)
    return {
        "kind": "certificate",
        "name": f"certificate of {design}",
        "controller": controller,
        "design": read_design(design, controller),
    }


def _controller_of(design: str) -> str:
    """The one that has the published design of that name, or fuzzy-pi."""
    name = design.removeprefix("published:")
    has = [known for known, family in CONTROLLERS.items() if name in family.published]
    return has[0] if design.startswith("published:") and has else "fuzzy-pi"


def _perturbations(document: Mapping[str, Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """`variables` and `fixed` of the spec, as far as options say something of them."""
    ranges = dict(map(_range, options.get("ranges", ())))
    held = dict(_pair(entry, "set", "NAME=VALUE") for entry in options.get("fixed", ()))
    if not ranges and not held and "only" not in options:
        return {}
    drawn = document.get("variables") or [variable.name for variable in PERTURBATIONS]
    variables = {entry if isinstance(entry, str) else entry["name"]: entry for entry in drawn}
    if "only" in options:
        names = [name.strip() for name in options["only"].split(",")]
        variables = {name: variables.get(name, name) for name in names}
    variables |= ranges
    fixed = {name: v for name, v in document.get("fixed", {}).items() if name not in variables}
    fixed |= held
    return {
        "variables": [entry for name, entry in variables.items() if name not in fixed],
        "fixed": fixed,
    }


def _range(entry: str) -> tuple[str, dict[str, str]]:
    name, value = _pair(entry, "range", "NAME=LOW:HIGH")
    low, colon, high = value.partition(":")
    if not colon:
        raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field="range")
    return name, {"name": name, "low": low, "high": high}


def _pair(entry: str, option: str, form: str) -> tuple[str, str]:
    name, equals, value = entry.partition("=")
    if not (name and equals and value):
        raise InvalidRequest(f"{entry!r} is not {form}", field=option)
    return name.strip(), value.strip()
