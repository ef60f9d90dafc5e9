"""Choice of a search method: a name, a preset, or an object with settings"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    METHODS,
    OPTIMIZERS,
    OptimizerName,
    OptimizerSettings,
)
from gaitswarm.sim.near_names import instead_of


def optimizer_settings(choice: object) -> object:
    """Resolve a name to settings, and insert the default method if none is given."""
    if isinstance(choice, Mapping):
        name = choice.get("name", DEFAULT_METHOD)
        if isinstance(name, str):
            if name not in METHODS:
                raise ValueError(f"unknown method {name!r}; {METHODS.instead_of(name, METHODS)}")
            _check_known(choice, METHODS[name].settings)
        return {"name": name, **choice}
    if not isinstance(choice, str):
        return choice
    if choice in OPTIMIZERS:
        return OPTIMIZERS[choice]
    reason = OPTIMIZERS.unknown(choice)
    otherwise = "; or pass an object with settings" if "known are" in reason else ""
    raise ValueError(f"{reason}{otherwise}")


def with_settings(choice: object, settings: Mapping[str, Any]) -> object:
    """Apply settings on top of those of an optimizer."""
    with suppress(ValueError):
        choice = optimizer_settings(choice)
    if isinstance(choice, SearchSettings):
        choice = choice.model_dump()
    if not isinstance(choice, Mapping):
        return choice
    name = settings.get("name", choice.get("name"))
    return {**choice, **settings} if name == choice.get("name") else dict(settings)


def _check_known(settings: Mapping[Any, Any], model: type[SearchSettings]) -> None:
    """Raise ValidationError for unknown settings, with suggestions."""
    setting_names = [name for name in model.model_fields if name != "name"]
    problems = [
        InitErrorDetails(
            type=PydanticCustomError(
                "unknown_setting",
                "no setting of {method}; {known}",
                {
                    "method": model.model_fields["name"].default,
                    "known": instead_of(str(key), setting_names),
                },
            ),
            loc=(str(key),),
            input=value,
        )
        for key, value in settings.items()
        if key not in model.model_fields
    ]
    if problems:
        raise ValidationError.from_exception_data(model.__name__, problems)


OptimizerChoice = Annotated[
    OptimizerSettings,
    BeforeValidator(optimizer_settings, json_schema_input_type=OptimizerName | OptimizerSettings),
]
"""Choice of a search method; validation replaces a name by settings."""
