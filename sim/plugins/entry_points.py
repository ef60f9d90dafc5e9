"""Entry points of installed distributions, as data; nothing is imported to list them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal, get_args

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["controller", "case", "optimizer"]

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

GROUPS: Final[Mapping[Kind, str]] = MappingProxyType({kind: f"gaitswarm.{kind}s" for kind in KINDS})
"""Group of entry points by what they bring."""


class PluginError(Exception):
    """A plug-in that cannot be used; the message names it, its distribution and the reason."""


@dataclass(frozen=True, slots=True)
class Plugin:
    """One entry point.

    Attributes:
        kind: What it brings.
        name: By which jobs name it.
        distribution: That brings it.
        version: Of the distribution.
        place: `module:attribute` of what it brings.
    """

    kind: Kind
    name: str
    distribution: str
    version: str
    place: str

    @property
    def module(self) -> str:
        """The module that is imported for it."""
        return self.place.partition(":")[0].strip()

    def __str__(self) -> str:
        return f"{self.kind} {self.name!r} of {self.distribution} {self.version}"

    def load(self) -> object:
        """Import what it brings."""
        try:
            return metadata.EntryPoint(self.name, self.place, GROUPS[self.kind]).load()
        except (Exception, SystemExit) as error:
            raise PluginError(
                f"{self} cannot be loaded: {type(error).__name__}: {error}"
            ) from error


@lru_cache(maxsize=1)
def find_plugins() -> tuple[Plugin, ...]:
    """All entry points for gaitswarm that are installed, as they are at the first call."""
    # Asked for at once: each question reads the metadata of all distributions.
    points = metadata.entry_points()
    found = {
        Plugin(
            kind,
            point.name,
            "unknown" if point.dist is None else point.dist.name,
            "0" if point.dist is None else point.dist.version,
            point.value,
        )
        for kind, group in GROUPS.items()
        for point in points.select(group=group)
    }
    return tuple(sorted(found, key=lambda p: (KINDS.index(p.kind), p.name, p.distribution)))
