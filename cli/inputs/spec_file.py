"""Job specs from files and options."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.inputs.robots import chosen_robot, robot_defaults, scenario_data
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.cli.inputs.options import SpecOptions
    from gaitswarm.services.optimizer.jobs.documents import AnySpec
    from gaitswarm.start import StartFile

LARGEST_FILE: Final = 1 << 20
"""Largest accepted JSON file [B]; a spec takes a few kilobytes."""


def read_json_object(path: Path, option: str) -> dict[str, Any]:
    """Read a JSON object from a file, or from standard input for "-"."""
    import sys

    try:
        with sys.stdin.buffer if str(path) == "-" else path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field=option) from error
    if len(content) > LARGEST_FILE:
        raise InvalidRequest(f"{path} is larger than {LARGEST_FILE >> 20} MiB", field=option)
    try:
        value = json.loads(content, object_pairs_hook=_without_repeats)
    except RecursionError as error:
        raise InvalidRequest(f"{path} is nested too deeply", field=option) from error
    except ValueError as error:
        raise InvalidRequest(f"{path} is not valid JSON: {error}", field=option) from error
    if not isinstance(value, dict):
        raise InvalidRequest(f"{path} must contain one JSON object", field=option)
    return value


def by_other_optimizer(spec: AnySpec, name: str) -> AnySpec:
    """Return the spec with another search method or preset, with default settings."""
    from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings

    document = spec.model_dump(mode="json")
    document["optimizer"] = with_settings(name, {"particles": spec.optimizer.particles})
    document["name"] = f"{spec.name or 'job'}, by {name}"[:200]
    return parse_spec(document)


def check_optimizer_name(name: str, option: str) -> None:
    """Raise InvalidRequest for the option if no search method has the name."""
    from gaitswarm.services.optimizer.jobs.optimizer_choice import optimizer_settings

    try:
        optimizer_settings(name)
    except ValueError as error:
        raise InvalidRequest(str(error), field=option) from error


def build_spec(options: SpecOptions) -> AnySpec:
    """Return the spec of the file, or the default spec, with options applied."""
    data = read_json_object(options.spec, "spec") if options.spec is not None else {}
    if options.robot is not None and data.get("kind", "tuning") == "tuning":
        controller = options.given.get("controller", data.get("controller"))
        data = robot_defaults(options.robot).of_controller(controller) | data
    fields = {name: value for name, value in options.given.items() if name != "spec"}
    if options.scenarios is not None:
        fields["scenarios"] = scenario_data(options.scenarios, options.robot)
    if options.robot is not None:
        fields["robot"] = chosen_robot(options.robot)
    case = options.case
    if case is not None and (case[0:1] in "{@" or case.endswith(".json")):
        fields["case"] = json_object(case, "case")
    _merge_settings(fields, data.get("optimizer", {}))
    _merge_worlds(fields, data.get("worlds"))
    with_gait = fields.pop("with_gait", False)
    file = _add_start(fields, data)
    try:
        spec = parse_spec(data | fields)
    except InvalidRequest as error:
        raise (error if file is None else file.located(error)) from error
    return _with_gait(spec) if with_gait else spec


def _add_start(fields: dict[str, Any], data: Mapping[str, Any]) -> StartFile | None:
    """Set the spec's `start` from options; return the file of start designs, if any."""
    source, count = fields.pop("start_from", None), fields.pop("start_count", None)
    if source is None and count is None:
        return None
    if source is None:
        raise InvalidRequest("requires --start-from", field="start-count")
    if "start" in data:
        raise InvalidRequest("the spec already has a start; choose one", field="start-from")
    from gaitswarm.start import StartFile, start_from

    start = start_from(source, count)
    fields["start"] = start.designs if isinstance(start, StartFile) else start
    return start if isinstance(start, StartFile) else None


def _merge_settings(fields: dict[str, Any], optimizer: object) -> None:
    """Merge settings and particles into `optimizer`, by default that of the file."""
    from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings

    text, particles = fields.pop("optimizer_settings", None), fields.pop("particles", None)
    settings = {} if text is None else json_object(text, "optimizer-settings")
    if particles is not None:
        settings["particles"] = particles
    if not settings:
        return
    named = with_settings(fields.get("optimizer", optimizer), {})
    if "optimizer" in fields and isinstance(named, Mapping):
        method = named["name"]
        if settings.get("name", method) != method:
            raise InvalidRequest(
                f"are those of {settings['name']}, but the optimizer is {fields['optimizer']};"
                " leave out one of both names",
                field="optimizer-settings",
            )
    fields["optimizer"] = with_settings(named, settings)


def _merge_worlds(fields: dict[str, Any], worlds: object) -> None:
    """Merge options of worlds into those of the file."""
    names = {"worlds": "count", "aggregate": "aggregate", "level": "level", "worlds_seed": "seed"}
    values = {names[option]: fields.pop(option) for option in names if option in fields}
    if not values:
        return
    if "count" not in values and worlds is None:
        option = next(o for o, name in names.items() if name in values).replace("_", "-")
        raise InvalidRequest("requires --worlds", field=option)
    fields["worlds"] = {**(worlds if isinstance(worlds, Mapping) else {}), **values}


def optimizer_choice(name: str | None, settings: str | None) -> Any:
    """Return the unchecked field `optimizer` of a spec; None if both arguments are.

    settings: JSON, or a file of JSON.
    """
    if settings is None:
        return name
    fields: dict[str, Any] = {} if name is None else {"optimizer": name}
    fields["optimizer_settings"] = settings
    _merge_settings(fields, {})
    return fields["optimizer"]


def preference_choice(text: str) -> Any:
    """Return a preference's name, or an unchecked one of JSON."""
    if not text.lstrip().startswith("{"):
        return text
    try:
        preference: dict[str, Any] = json.loads(text)
    except ValueError as error:
        raise InvalidRequest(f"not JSON: {error}", field="preference") from error
    return preference


def json_object(text: str, option: str) -> dict[str, Any]:
    """Return a JSON object from text, FILE or @FILE."""
    if text.lstrip().startswith("["):
        raise InvalidRequest("must be an object, {...}, not a list", field=option)
    if not text.lstrip().startswith("{"):
        return read_json_object(Path(text.removeprefix("@")), option)
    try:
        value: dict[str, Any] = json.loads(text, object_pairs_hook=_without_repeats)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest(f"is not valid JSON: {error}", field=option) from error
    return value


def _with_gait(spec: AnySpec) -> AnySpec:
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

    if not isinstance(spec, JobSpec):
        raise InvalidRequest("only jobs that tune a drive have a gait", field="with-gait")
    extended = spec.with_gait_searched()
    extended.check_can_be_simulated()
    return extended


def parse_spec(data: Mapping[str, Any]) -> AnySpec:
    """Validate a spec and check that it can be simulated; errors name every invalid field."""
    from pydantic import ValidationError

    from gaitswarm.errors import invalid_request
    from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec

    try:
        spec = SPECS.validate_python(data)
    except ValidationError as error:
        raise invalid_request(error, AnySpec) from error
    spec.check_can_be_simulated()
    return spec


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Reject objects with repeated names."""
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name!r} occurs twice in one object")
    return dict(pairs)
