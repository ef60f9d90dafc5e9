"""A field that takes a name or a document of one's own: which of the two was meant.

Only the alternative that was meant is validated, so that only it says what is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from pydantic import BaseModel, Discriminator

Location = Sequence[str | int]

NAME: Final = "<name>"
OWN: Final = "<own>"

_KEY: Final = "[key]"
"""What pydantic appends where the key of a dictionary is wrong, not its value."""


def alternatives(
    expected: str, *, among_own: Callable[[Any], str] = lambda _: OWN
) -> Discriminator:
    """A discriminator between a name and objects."""

    def tag(value: Any) -> str | None:
        if isinstance(value, str):
            return NAME
        return among_own(value) if isinstance(value, Mapping | BaseModel) else None

    return Discriminator(tag, custom_error_type="no_choice", custom_error_message=expected)


def without_tags(location: Location) -> tuple[str | int, ...]:
    """The part of a location of a validation error that is in the document."""
    return tuple(part for part in location if not is_tag(part))


def is_tag(part: str | int) -> bool:
    """Whether a part of a location says which alternative was validated."""
    return isinstance(part, str) and (part == _KEY or (part[:1] == "<" and part[-1:] == ">"))
