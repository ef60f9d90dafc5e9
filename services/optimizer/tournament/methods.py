"""Who takes part: methods of the registry and rivals, by name, with settings that may be drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.services.optimizer.search.automatic import (
    CHOICES,
    RULES,
    AutoSettings,
    chosen_method,
)
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.registry import METHODS, create_search
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.services.optimizer.tournament.race import Evaluate, Search
from gaitswarm.services.optimizer.tournament.rivals import RIVALS
from gaitswarm.sim.input.near_names import instead_of
from gaitswarm.sim.input.wording import message_of
from gaitswarm.sim.variables import Variable

_UNBOUNDED: Final = 1e9
"""In place of a bound that a setting does not have."""

_SWITCH: Final = ("no", "yes")
"""Choices of a setting that is true or false."""


def method_names() -> tuple[str, ...]:
    """Names that a method may be given by: what a job may name, then rivals.

    A multi-objective method is none: methods are ranked by the one number that they are told.
    """
    return (*(name for name in CHOICES.built_in if not is_multi_objective(name)), *RIVALS)


def is_multi_objective(name: str) -> bool:
    """Whether a method of the registry is told objective vectors, and so cannot take part."""
    return name in METHODS.built_in and METHODS[name].multi_objective


def why_unknown(name: str, known: Iterable[str]) -> str:
    """Say why a name is none of a method that may take part."""
    if is_multi_objective(name):
        return f"{name} is multi-objective; a tournament ranks methods by a single number"
    return f"unknown method {name!r}; {instead_of(name, known)}"


def named_settings(name: str) -> SearchSettings:
    """Settings that a name stands for."""
    if name in RIVALS:
        return RIVALS[name].settings()
    if name in method_names():
        return CHOICES[name]
    raise ValueError(why_unknown(name, method_names()))


def settings_models() -> dict[str, type[SearchSettings]]:
    """Settings of every method that may take part, by their `name`."""
    own: dict[str, type[SearchSettings]] = {
        name: method.settings
        for name, method in METHODS.built_in.items()
        if not method.multi_objective
    }
    rivals = {name: rival.settings for name, rival in RIVALS.items()}
    return {"auto": AutoSettings, **own, **rivals}


def search_of(settings: SearchSettings) -> Search:
    """The method that settings are of."""
    if settings.name in RIVALS:
        return partial(_rival, settings)
    return partial(_ask_and_tell, settings)


def libraries_of(settings: SearchSettings) -> tuple[str, ...]:
    """Distributions that a method computes with, beside those that every job does."""
    if settings.name in RIVALS:
        return RIVALS[settings.name].libraries
    chosen = {rule.settings.name for rule in RULES} if settings.name == "auto" else {settings.name}
    found = [
        library for name, m in METHODS.built_in.items() if name in chosen for library in m.libraries
    ]
    return tuple(dict.fromkeys(found))


def extra_of(settings: SearchSettings) -> str:
    """The optional dependencies of gaitswarm that a method's libraries are in."""
    return "search" if settings.name in METHODS else "rivals"


def settings_variables(model: type[SearchSettings]) -> tuple[Variable, ...]:
    """What may be drawn of a method's settings: numbers by their bounds, names by their choices."""
    properties = model.model_json_schema()["properties"]
    found = [_variable(name, schema) for name, schema in properties.items() if name != "name"]
    return tuple(variable for variable in found if variable is not None)


def drawn_settings(settings: SearchSettings, drawn: dict[str, float]) -> SearchSettings:
    """Settings of one run."""
    known = {variable.name: variable for variable in settings_variables(type(settings))}
    values = {name: _value(known[name], number) for name, number in drawn.items()}
    try:
        return type(settings).model_validate(settings.model_dump() | values)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        said = [*(str(part) for part in first["loc"]), message_of(first)]
        raise ValueError(": ".join(said)) from error


def random_ranges(name: str) -> tuple[Variable, ...]:
    """What the thesis's tournament draws anew for every run of a method."""
    model = settings_models()[name]
    own = RANGES.get(name, {})
    defaults = {key: getattr(model(name=name), key) for key in model.model_fields}

    def drawn(variable: Variable) -> Variable | None:
        if variable.name in own:
            low, high = own[variable.name]
            return variable.model_copy(update={"low": low, "high": high})
        return variable if variable.choices else _around(variable, defaults[variable.name])

    found = map(drawn, settings_variables(model))
    return tuple(variable for variable in found if variable is not None)


_OF_SWARMS: Final = {
    "particles": (12.0, 50.0),
    "cognitive": (0.25, 2.0),
    "social": (0.75, 2.5),
    "inertia_start": (0.7, 1.0),
    "inertia_end": (0.3, 0.7),
    "velocity_limit": (0.25, 1.0),
}
RANGES: Final = {"pso": _OF_SWARMS, "pso-ps": _OF_SWARMS}
"""Ranges of settings, by method, where half to twice the default would not do."""


def _around(variable: Variable, default: Any) -> Variable | None:
    if isinstance(default, bool) or not isinstance(default, int | float) or not default:
        return None
    low, high = sorted((0.5 * default, 2.0 * default))
    if variable.kind == "integer":
        low, high = float(round(low)), float(round(high))
    low, high = max(low, variable.low), min(high, variable.high)
    return variable.model_copy(update={"low": low, "high": high}) if low < high else None


def _variable(name: str, schema: dict[str, Any]) -> Variable | None:
    described: dict[str, Any] = {"name": name, "description": schema.get("description", "")}
    kind = schema.get("type")
    if kind == "boolean":
        return Variable(**described, kind="categorical", choices=_SWITCH)
    if "enum" in schema and kind == "string":
        return Variable(**described, kind="categorical", choices=tuple(schema["enum"]))
    if kind not in ("integer", "number"):
        return None
    low, high = schema.get("minimum", -_UNBOUNDED), schema.get("maximum", _UNBOUNDED)
    if "exclusiveMinimum" in schema:
        low = _beyond(schema["exclusiveMinimum"], math.inf, kind)
    if "exclusiveMaximum" in schema:
        high = _beyond(schema["exclusiveMaximum"], -math.inf, kind)
    numeric = "integer" if kind == "integer" else "continuous"
    return Variable(**described, kind=numeric, low=low, high=high) if low < high else None


def _beyond(bound: float, towards: float, kind: str) -> float:
    """The next value, of a bound that is none itself."""
    return math.nextafter(bound, towards) if kind == "number" else bound + math.copysign(1, towards)


def _value(variable: Variable, number: float) -> object:
    if variable.choices == _SWITCH:
        return bool(number)
    if variable.kind == "categorical":
        return variable.shown(number)
    return int(number) if variable.kind == "integer" else number


def _rival(
    settings: SearchSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - libraries are told to end, not when
    seed: int,
    evaluate: Evaluate,
) -> None:
    RIVALS[settings.name].search(settings, space, seed, evaluate)


def _ask_and_tell(settings: Any, space: Space, budget: int, seed: int, evaluate: Evaluate) -> None:
    if isinstance(settings, AutoSettings):
        settings = chosen_method(settings, space, budget)
    optimizer = create_search(settings, space, budget, seed)
    while True:
        positions = optimizer.ask(budget - optimizer.evaluations)
        optimizer.tell(evaluate(positions))
