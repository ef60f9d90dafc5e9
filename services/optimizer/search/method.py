"""Search methods as the registry stores them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from gaitswarm.services.optimizer.search.optimizer import Optimizer, SearchSettings
from gaitswarm.services.optimizer.search.replayed import Proposals, Replayed
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.plugins import MISSING, version_of

Create = Callable[[Any, Space, int, int], Optimizer]
"""(settings, space, budget [evaluations], seed) -> an optimizer before its first ask."""


@dataclass(frozen=True, slots=True)
class Method:
    """A search method.

    Attributes:
        settings: Model of its settings.
        summary: One line for lists of methods, with the source.
        create: Creates an optimizer.
        multi_objective: Whether it receives objective vectors instead of fitness values.
        replays: Whether its state is the complete feedback, which bounds the length of a job.
        uses_start: Whether it learns from the designs that a job starts from. Otherwise these
            designs are evaluated first and the method begins as if there were none.
        extra: Optional dependencies of gaitswarm that it needs, as in `gaitswarm[extra]`; empty for
            none and for methods of plug-ins.
        libraries: Distributions that its results depend on, besides those that every job depends
            on. Their versions are recorded, and a job resumes with the same versions only.
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
        """Return the installed versions of its libraries, "none" for a missing one."""
        return versions_of(self.libraries)

    @property
    def missing(self) -> tuple[str, ...]:
        """Libraries that are not installed."""
        return tuple(name for name, version in self.versions().items() if version == MISSING)

    @property
    def remedy(self) -> str:
        """Command that installs what is missing."""
        packages = f"'gaitswarm[{self.extra}]'" if self.extra else " ".join(self.missing)
        return f"pip install {packages}"


def versions_of(libraries: Iterable[str]) -> dict[str, str]:
    """Return installed versions by distribution, "none" for a missing one."""
    return {name: version_of(name) for name in libraries}


def settings_of(method: Method) -> type[SearchSettings]:
    """Return the model of a method's settings."""
    return method.settings


def from_generator(
    settings: type[SearchSettings],
    summary: str,
    search: Callable[..., Proposals],
    *,
    extra: str = "",
    libraries: tuple[str, ...] = (),
) -> Method:
    """Make a method of a generator function that yields positions and receives their fitness.

    The state of such a method is the feedback it received, which is replayed when a job resumes.

    Args:
        settings: Model of its settings.
        summary: One line for lists of methods, with the source.
        search: Function of (settings, space, budget, random) that returns the generator. A
            parameter `start`, None by default, receives a `Start`: evaluated designs to begin from.
        extra: As in `Method`.
        libraries: As in `Method`.

    Returns:
        The method.
    """

    def create(settings: SearchSettings, space: Space, budget: int, seed: int) -> Optimizer:
        return Replayed(search, settings, space, budget, seed)

    return Method(
        settings,
        summary,
        create,
        replays=True,
        uses_start="start" in inspect.signature(search).parameters,
        extra=extra,
        libraries=libraries,
    )
