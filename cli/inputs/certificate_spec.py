"""The certificate that options of the command line ask for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, cast

from gaitswarm.cli.inputs.design_file import given_design, may_be_file
from gaitswarm.cli.inputs.job_ids import full_id
from gaitswarm.cli.inputs.robots import (
    chosen_robot,
    chosen_scenarios,
    robot_defaults,
    scenario_data,
)
from gaitswarm.cli.inputs.spec_file import parse_spec
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.held_out import certificate_walks
from gaitswarm.sim.worlds import PERTURBATIONS

_PLAIN: Final = ("worlds", "seed", "preference", "precision", "engines", "name")
"""Options that are fields of the spec."""


def certificate_spec(design: str, db: str | None, given: Mapping[str, Any]) -> CertificateSpec:
    """The job that a command asks for."""
    options = {name: value for name, value in given.items() if value is not None}
    document = _earlier(design, db, options) or _new(design, db, options)
    document |= {name: options[name] for name in _PLAIN if name in options}
    if "scenarios" in options:
        # A job's scenarios have names there, whether they are presets or its own.
        known = {scenario.name: scenario for scenario in document.get("scenarios", ())}
        chosen = scenario_data(options["scenarios"], options.get("robot"))
        document["scenarios"] = [
            known.get(entry, entry) if isinstance(entry, str) else entry for entry in chosen
        ]
        document |= _still_held_out(document)
    if "robot" in options:
        document["robot"] = chosen_robot(options["robot"])
    document |= _perturbations(document, options)
    return cast(CertificateSpec, parse_spec(document))


def _earlier(design: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any] | None:
    """Of a certificate that is named by its id; None for any other design."""
    from gaitswarm.jobs.open import open_jobs

    if may_be_file(design):
        return None
    with open_jobs(None, db) as jobs:
        try:
            spec = jobs.job(full_id(jobs, design)).spec
        except NotFound:
            return None
    if not isinstance(spec, CertificateSpec):
        return None
    if "controller" in options:
        raise InvalidRequest("is that of the certificate; leave it out", field="controller")
    document = spec.model_dump() | {"scenarios": spec.resolved_scenarios()}
    # They follow from the number of worlds.
    del document["iterations"]
    return document


def _new(design: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any]:
    robot = options.get("robot")
    found = given_design(design, options.get("controller"), robot=robot, server=None, db=db)
    document: dict[str, Any] = {
        "kind": "certificate",
        "name": f"certificate of {found.label}",
        "controller": found.controller,
        "design": found.values,
    }
    if found.spec is None:
        walker, tuned = chosen_robot(robot), chosen_scenarios("all", robot)
        document |= {"robot": walker, "preference": robot_defaults(robot).preference}
    else:
        walker = found.spec.robot if robot is None else chosen_robot(robot)
        tuned = found.spec.resolved_scenarios()
        document |= {"robot": walker, "preference": found.spec.resolved_preference()}
    return document | certificate_walks(tuned, walker, found.values)


def _still_held_out(document: Mapping[str, Any]) -> dict[str, Any]:
    """`held_out` without what is not walked, if the spec says which are."""
    if document.get("held_out") is None:
        return {}
    walked = {
        entry if isinstance(entry, str) else dict(entry).get("name")
        for entry in document["scenarios"]
    }
    return {"held_out": [name for name in document["held_out"] if name in walked]}


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
    """Name and variable of NAME=LOW:HIGH, of the perturbation's kind. Raises InvalidRequest."""
    name, value = _pair(entry, "range", "NAME=LOW:HIGH")
    low, colon, high = value.partition(":")
    if not colon:
        raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field="range")
    kinds = {variable.name: variable.kind for variable in PERTURBATIONS}
    kind = kinds.get(name, "continuous")
    return name, {"name": name, "low": low, "high": high, "kind": kind}


def _pair(entry: str, option: str, form: str) -> tuple[str, str]:
    name, equals, value = entry.partition("=")
    if not (name and equals and value):
        raise InvalidRequest(f"{entry!r} is not {form}", field=option)
    return name.strip(), value.strip()
