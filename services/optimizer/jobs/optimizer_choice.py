"""How a job names its search: a method, a preset, or settings of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import BaseModel, BeforeValidator, Discriminator, Tag

from services.optimizer.search.registry import (
    DEFAULT_METHOD,
    METHODS,
    OPTIMIZERS,
    OptimizerName,
    OptimizerSettings,
)


def optimizer_settings(choice: object) -> object:
    """Look up settings that are named, and name the default method where none is.

    Args:
        choice: Name of a method or preset, a document of settings, or anything else.

    Returns:
        The settings of a name, a document with a `name`; anything else as it is.

    Raises:
        ValueError: No method or preset of that name; names those that there are.
    """
    if isinstance(choice, Mapping):
        name = choice.get("name", DEFAULT_METHOD)
        if isinstance(name, str) and name not in METHODS:
            raise ValueError(f"unknown method {name!r}; known are {', '.join(METHODS)}")
        return {"name": name, **choice}
    if not isinstance(choice, str):
        return choice
    if choice in OPTIMIZERS:
        return OPTIMIZERS[choice]
    raise ValueError(
        f"unknown optimizer {choice!r}; known are {', '.join(OPTIMIZERS)}, or give an object:"
        " settings of your own"
    )


def _tag(settings: Any) -> str | None:
    """The tag of the method that was meant."""
    if isinstance(settings, BaseModel):
        return f"<{getattr(settings, 'name', '')}>"
    return f"<{settings.get('name')}>" if isinstance(settings, Mapping) else None


if TYPE_CHECKING:
    _Settings = OptimizerSettings
else:
    # A tag in angle brackets is no part of the location that an error names.
    _Settings = Annotated[
        Union[tuple(Annotated[m.settings, Tag(f"<{name}>")] for name, m in METHODS.items())],  # noqa: UP007 - of a tuple
        Discriminator(
            _tag,
            custom_error_type="no_choice",
            custom_error_message="must be a name or an object: settings of your own",
        ),
    ]

OptimizerChoice = Annotated[
    _Settings,
    BeforeValidator(optimizer_settings, json_schema_input_type=OptimizerName | _Settings),
]
"""How jobs choose a search: once it is read, a name has become settings."""
