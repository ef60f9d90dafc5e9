"""A search method as the registry holds it: its settings, and how it is made."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from gaitswarm.services.optimizer.search.optimizer import Optimizer, SearchSettings
from gaitswarm.services.optimizer.search.replayed import Replayed
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.plugins import MISSING, version_of

Create = Callable[[Any, Space, int, int], Optimizer]
"""(settings, space, budget [evaluations], seed) -> the optimizer before its first ask."""


@dataclass(frozen=True, slots=True)
class Method:
    """A search method.

    Attributes:
        settings: Model of its settings.
        summary: What it is, with its source.
        create: Makes one.
        multi_objective: Whether it is told objective vectors in place of fitness.
        replays: Whether its state is all that it was told, so that a job of it is bounded.
        uses_start: Whether it learns from the designs that a job starts from. One that does not
            evaluates them first, and then goes on as if there had been none.
        extra: The optional dependencies that it needs, as in `gaitswarm[extra]`; "" if none, and of
            a method that gaitswarm does not bring.
        libraries: Distributions whose version its path may depend on, beside those that every job
            depends on; a job goes on with the same version only.
    """

    settings: type[SearchSettings]
    summary: str
    create: Create
    multi_objective: bool = False
    replays: bool = False
    uses_start: bool = False
    extra: str = ""
    libraries: tuple[str, ...] = ()

    def versions(self) -> dict[str, str]:
        """Versions of its libraries here; "none" for one that is not installed."""
        return versions_of(self.libraries)

    @property
    def missing(self) -> tuple[str, ...]:
        """Those of its libraries that are not installed here."""
        return missing_of(self.libraries)

    @property
    def remedy(self) -> str:
        """How to install what it needs."""
        wanted = f"'gaitswarm[{self.extra}]'" if self.extra else " ".join(self.missing)
        return f"pip install {wanted}"


def versions_of(libraries: Iterable[str]) -> dict[str, str]:
    """Versions of distributions here.

    Args:
        libraries: Their names.

    Returns:
        Version by name; "none" for one that is not installed.
    """
    return {name: version_of(name) for name in libraries}


def missing_of(libraries: Iterable[str]) -> tuple[str, ...]:
    """Distributions that are not installed here.

    Args:
        libraries: Names of some.

    Returns:
        Those of them.
    """
    return tuple(name for name, version in versions_of(libraries).items() if version == MISSING)


def settings_of(method: Method) -> type[SearchSettings]:
    """The model of a method's settings.

    Args:
        method: The method.

    Returns:
        Its `settings`.
    """
    return method.settings


def from_generator(
    settings: type[SearchSettings],
    summary: str,
    place: str,
    *,
    uses_start: bool = False,
    extra: str = "",
    libraries: tuple[str, ...] = (),
) -> Method:
    """A method that is a generator function: it yields positions, and is sent what they are worth.

    Its state is all that it was told, by which it is replayed when a job is resumed.

    Args:
        settings: As of a `Method`.
        summary: As of a `Method`.
        place: `module:function`, imported when a search begins, of
            (settings, space, budget, random) -> the generator.
        uses_start: As of a `Method`.
        extra: As of a `Method`.
        libraries: As of a `Method`.

    Returns:
        The method.
    """
    module, _, function = place.partition(":")

    def create(settings: SearchSettings, space: Space, budget: int, seed: int) -> Optimizer:
        return Replayed(getattr(import_module(module), function), settings, space, budget, seed)

    return Method(
        settings,
        summary,
        create,
        replays=True,
        uses_start=uses_start,
        extra=extra,
        libraries=libraries,
    )
