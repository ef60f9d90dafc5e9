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
"""Largest JSON file that is read [B]; a spec takes a few kilobytes."""


def read_json_object(path: Path, what: str) -> dict[str, Any]:
    """The JSON object in a file; "-" reads standard input.

    what: name of the option, for messages. Raises InvalidRequest.
    """
    import sys

    try:
        with sys.stdin.buffer if str(path) == "-" else path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field=what) from error
    if len(content) > LARGEST_FILE:
        raise InvalidRequest(
            f"{path} is larger than {LARGEST_FILE >> 20} MiB, which no valid file is", field=what
        )
    try:
        value = json.loads(content, object_pairs_hook=_without_repeats)
    except RecursionError as error:
        raise InvalidRequest(f"{path} is nested too deeply", field=what) from error
    except ValueError as error:
        raise InvalidRequest(f"{path} is not valid JSON: {error}", field=what) from error
    if not isinstance(value, dict):
        raise InvalidRequest(f"{path} must hold one JSON object", field=what)
    return value


def by_other_optimizer(spec: AnySpec, name: str) -> AnySpec:
    """The same job of another search method, with the same budget.

    name: of a method or preset, whose settings are the defaults but for `particles`.

    Raises InvalidRequest if the method cannot do the job.
    """
    from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings

    document = spec.model_dump(mode="json")
    document["optimizer"] = with_settings(name, {"particles": spec.optimizer.particles})
    document["name"] = f"{spec.name or 'the same'}, by {name}"[:200]
    return parse_spec(document)


def check_optimizer_name(name: str, option: str) -> None:
    """Raises InvalidRequest, with the option as its field, if no search method has the name."""
    from gaitswarm.services.optimizer.jobs.optimizer_choice import optimizer_settings

    try:
        optimizer_settings(name)
    except ValueError as error:
        raise InvalidRequest(str(error), field=option) from error


def build_spec(options: SpecOptions) -> AnySpec:
    """The spec in a file (without one: the defaults) with options laid over it.

    Raises InvalidRequest that names the field.
    """
    data = read_json_object(options.spec, "spec") if options.spec is not None else {}
    if options.robot is not None and data.get("kind", "tuning") == "tuning":
        controller = options.given.get("controller", data.get("controller"))
        data = robot_defaults(options.robot).of_controller(controller) | data
    chosen = {name: value for name, value in options.given.items() if name != "spec"}
    if options.scenarios is not None:
        chosen["scenarios"] = scenario_data(options.scenarios, options.robot)
    if options.robot is not None:
        chosen["robot"] = chosen_robot(options.robot)
    case = options.case
    if case is not None and (case[0:1] in "{@" or case.endswith(".json")):
        chosen["case"] = json_object(case, "case")
    _lay_settings(chosen, data.get("optimizer", {}))
    _lay_worlds(chosen, data.get("worlds"))
    with_gait = chosen.pop("with_gait", False)
    file = _add_start(chosen, data)
    try:
        spec = parse_spec(data | chosen)
    except InvalidRequest as error:
        raise (error if file is None else file.located(error)) from error
    return _searching_gait(spec) if with_gait else spec


def _add_start(chosen: dict[str, Any], data: Mapping[str, Any]) -> StartFile | None:
    """Put what the options say of the start into `chosen`; the file that they name, if any."""
    source, count = chosen.pop("start_from", None), chosen.pop("start_count", None)
    if source is None and count is None:
        return None
    if source is None:
        raise InvalidRequest("goes with --start-from, which says where from", field="start-count")
    if "start" in data:
        raise InvalidRequest("the spec has a start of its own; choose one", field="start-from")
    from gaitswarm.start import StartFile, start_from

    found = start_from(source, count)
    chosen["start"] = found.designs if isinstance(found, StartFile) else found
    return found if isinstance(found, StartFile) else None


def _lay_settings(chosen: dict[str, Any], asked: object) -> None:
    """Settings and particles over `optimizer`; asked: that of the file. Raises InvalidRequest."""
    from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings

    text, particles = chosen.pop("optimizer_settings", None), chosen.pop("particles", None)
    settings = {} if text is None else json_object(text, "optimizer-settings")
    if particles is not None:
        settings["particles"] = particles
    if not settings:
        return
    named = with_settings(chosen.get("optimizer", asked), {})
    if "optimizer" in chosen and isinstance(named, Mapping):
        method = named["name"]
        if settings.get("name", method) != method:
            raise InvalidRequest(
                f"are those of {settings['name']}, but the optimizer is {chosen['optimizer']};"
                " leave out one of both names",
                field="optimizer-settings",
            )
    chosen["optimizer"] = with_settings(named, settings)


def _lay_worlds(chosen: dict[str, Any], asked: object) -> None:
    """What options say of worlds over those of the file. Raises InvalidRequest."""
    fields = {"worlds": "count", "aggregate": "aggregate", "level": "level", "worlds_seed": "seed"}
    given = {fields[name]: chosen.pop(name) for name in fields if name in chosen}
    if not given:
        return
    if "count" not in given and asked is None:
        option = next(o for o, field in fields.items() if field in given).replace("_", "-")
        raise InvalidRequest("goes with --worlds, which says in how many", field=option)
    chosen["worlds"] = {**(asked if isinstance(asked, Mapping) else {}), **given}


def optimizer_choice(name: str | None, settings: str | None) -> Any:
    """A search method with settings, as a spec has it, unchecked; None where neither is given.

    settings: JSON, or a file that holds it. Raises InvalidRequest.
    """
    if settings is None:
        return name
    chosen: dict[str, Any] = {} if name is None else {"optimizer": name}
    chosen["optimizer_settings"] = settings
    _lay_settings(chosen, {})
    return chosen["optimizer"]


def preference_choice(text: str) -> str | dict[str, Any]:
    """A preference by name, or one's own as JSON, unchecked. Raises InvalidRequest."""
    if not text.lstrip().startswith("{"):
        return text
    try:
        chosen: dict[str, Any] = json.loads(text)
    except ValueError as error:
        raise InvalidRequest(f"not JSON: {error}", field="preference") from error
    return chosen


def json_object(text: str, what: str) -> dict[str, Any]:
    """A JSON object as text, or that in FILE or @FILE.

    what: name of the option, for messages. Raises InvalidRequest.
    """
    if text.lstrip().startswith("["):
        raise InvalidRequest("must be an object, {...}, not a list", field=what)
    if not text.lstrip().startswith("{"):
        return read_json_object(Path(text.removeprefix("@")), what)
    try:
        value: dict[str, Any] = json.loads(text, object_pairs_hook=_without_repeats)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest(f"is not valid JSON: {error}", field=what) from error
    return value


def _searching_gait(spec: AnySpec) -> AnySpec:
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

    if not isinstance(spec, JobSpec):
        raise InvalidRequest("only a job that tunes a drive has a gait", field="with-gait")
    searching = spec.with_gait_searched()
    searching.check_can_be_simulated()
    return searching


def parse_spec(data: Mapping[str, Any]) -> AnySpec:
    """A checked spec that can be simulated. Raises InvalidRequest that names every bad field."""
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
    """An object in which a name occurs twice means two things at once."""
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name!r} occurs twice in one object")
    return dict(pairs)
