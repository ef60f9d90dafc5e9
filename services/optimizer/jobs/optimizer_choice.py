"""Choice of a search method: a name, a preset, or an object with settings"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, Final, Union

from pydantic import BaseModel, BeforeValidator, Discriminator, Tag, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from gaitswarm.services.optimizer.search.automatic import (
    CHOICES,
    AutoSettings,
    ChoiceName,
    ChosenSettings,
)
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.registry import DEFAULT_METHOD, METHODS
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.plugins import PluginSettings

_BUILT_IN: Final[dict[str, type[SearchSettings]]] = {
    "auto": AutoSettings,
    **{name: method.settings for name, method in METHODS.built_in.items()},
}
"""Settings models of the built-in methods, by `name`."""


def _model(name: str) -> type[SearchSettings]:
    """Return the settings model of a method. Raises ValueError that lists the methods."""
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    if name in METHODS:
        return METHODS[name].settings
    raise ValueError(f"unknown method {name!r}; {METHODS.instead_of(name, ('auto', *METHODS))}")


def optimizer_settings(choice: object) -> object:
    """Resolve a name to settings, and insert the default method if none is given."""
    if isinstance(choice, Mapping):
        name = choice.get("name", DEFAULT_METHOD)
        if isinstance(name, str):
            _check_known(choice, _model(name))
        return {"name": name, **choice}
    if not isinstance(choice, str):
        return choice
    if choice in CHOICES:
        return CHOICES[choice]
    reason = CHOICES.unknown(choice)
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


def _tag(settings: Any) -> str | None:
    if isinstance(settings, BaseModel):
        return f"<{getattr(settings, 'name', '')}>"
    return f"<{settings.get('name')}>" if isinstance(settings, Mapping) else None


if TYPE_CHECKING:
    _Settings = ChosenSettings
else:
    # Tags in angle brackets are omitted from the locations that errors name.
    _Settings = Annotated[
        Union[tuple(Annotated[m, Tag(f"<{name}>")] for name, m in _BUILT_IN.items())],  # noqa: UP007 - of a tuple
        Discriminator(
            _tag,
            custom_error_type="no_choice",
            custom_error_message="must be a name or an object with settings",
        ),
        PluginSettings(METHODS, attrgetter("settings"), "/v1/optimizers"),
    ]

OptimizerChoice = Annotated[
    _Settings,
    BeforeValidator(optimizer_settings, json_schema_input_type=ChoiceName | _Settings),
]
"""Choice of a search method; validation replaces a name by settings."""
