"""Cases by name, which evaluate a job's designs in place of the built-in simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import Data
from gaitswarm.sim.outcome import OBJECTIVES, Objective
from gaitswarm.sim.plugins import MISSING, Plugin, Registry, check_is, check_name, version_of

if TYPE_CHECKING:
    from gaitswarm.sim.case import Case, Walk


class CaseSettings(Data):
    """Base class of cases' settings."""

    name: str


CreateCase = Callable[[Any, "Walk"], "Case"]
"""(settings, walk) -> case that evaluates designs in place of that walk, with its `variables`."""


@dataclass(frozen=True, slots=True)
class CaseFamily:
    """A kind of cases, each of which evaluates designs in place of a walk.

    Workers need `libraries`; `measurements` are columns after a walk's objectives, which
    constraints may name.
    """

    settings: type[CaseSettings]
    summary: str
    create: CreateCase
    libraries: tuple[str, ...] = ()
    measurements: tuple[Objective, ...] = ()

    @property
    def missing(self) -> tuple[str, ...]:
        return tuple(name for name in self.libraries if version_of(name) == MISSING)


def _accepted(plugin: Plugin, brought: object) -> CaseFamily:
    family = check_is(plugin, brought, CaseFamily)
    check_name(plugin, family.settings.model_fields["name"].default)
    return replace(family, libraries=(plugin.distribution, *family.libraries))


CASES: Final = Registry[CaseFamily]("case", {}, _accepted)
"""By name, as in job specs; the built-in simulator is the default of jobs."""


def create_case(settings: CaseSettings, walk: Walk) -> Case:
    family = CASES[settings.name]
    if family.missing:
        needed = " ".join(family.missing)
        raise SimulationInputError(
            f"{settings.name} needs packages that are not installed: pip install {needed}"
        )
    case = family.create(settings, walk)
    columns = (*OBJECTIVES, *family.measurements)
    if case.objectives != columns:
        names = ", ".join(column.name for column in columns)
        raise SimulationInputError(
            f"{settings.name} does not have the objectives of a walk and its measurements: {names}"
        )
    return case
