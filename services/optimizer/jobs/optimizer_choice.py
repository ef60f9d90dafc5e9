"""How a job names its search: a method, a preset, or settings of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, Final, Union

from pydantic import BaseModel, BeforeValidator, Discriminator, Tag, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from gaitswarm.services.optimizer.search.automatic import (
    CHOICES,
    AutoSettings,
    ChoiceName,
    ChosenSettings,
)
from gaitswarm.services.optimizer.search.method import settings_of
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.registry import DEFAULT_METHOD, METHODS
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.plugins import PluginSettings

_BUILT_IN: Final[dict[str, type[SearchSettings]]] = {
    "auto": AutoSettings,
    **{name: method.settings for name, method in METHODS.built_in.items()},
}
"""Models of the settings that gaitswarm brings, by their `name`."""


def _model(name: str) -> type[SearchSettings]:
    """The model of settings. Raises ValueError that names those that there are."""
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    if name in METHODS:
        return METHODS[name].settings
    raise ValueError(f"unknown method {name!r}; {METHODS.instead_of(name, ('auto', *METHODS))}")


def optimizer_settings(choice: object) -> object:
    """Look up settings that are named, and name the default method where none is."""
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
    otherwise = "; or give an object: settings of your own" if "known are" in reason else ""
    raise ValueError(f"{reason}{otherwise}")


def with_settings(choice: object, settings: Mapping[str, Any]) -> object:
    """Lay settings over those of an optimizer."""
    with suppress(ValueError):
        choice = optimizer_settings(choice)
    if isinstance(choice, SearchSettings):
        choice = choice.model_dump()
    if not isinstance(choice, Mapping):
        return choice
    name = settings.get("name", choice.get("name"))
    return {**choice, **settings} if name == choice.get("name") else dict(settings)


def _check_known(settings: Mapping[Any, Any], model: type[SearchSettings]) -> None:
    """Raises ValidationError that names every unknown setting and those that there are."""
    known = [name for name in model.model_fields if name != "name"]
    problems = [
        InitErrorDetails(
            type=PydanticCustomError(
                "unknown_setting",
                "no setting of {method}; {known}",
                {
                    "method": model.model_fields["name"].default,
                    "known": instead_of(str(key), known),
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
    """The tag of the method that was meant."""
    if isinstance(settings, BaseModel):
        return f"<{getattr(settings, 'name', '')}>"
    return f"<{settings.get('name')}>" if isinstance(settings, Mapping) else None


if TYPE_CHECKING:
    _Settings = ChosenSettings
else:
    # A tag in angle brackets is no part of the location that an error names.
    _Settings = Annotated[
        Union[tuple(Annotated[m, Tag(f"<{name}>")] for name, m in _BUILT_IN.items())],  # noqa: UP007 - of a tuple
        Discriminator(
            _tag,
            custom_error_type="no_choice",
            custom_error_message="must be a name or an object: settings of your own",
        ),
        PluginSettings(METHODS, settings_of, "/v1/optimizers"),
    ]

OptimizerChoice = Annotated[
    _Settings,
    BeforeValidator(optimizer_settings, json_schema_input_type=ChoiceName | _Settings),
]
"""How jobs choose a search: once it is read, a name has become settings."""
