"""Cases by name: what a job's designs are put to in place of a walk in the built-in simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from pydantic import BaseModel, ConfigDict

from gaitswarm.sim.case import Case, Walk
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.outcome import OBJECTIVES
from gaitswarm.sim.plugins import MISSING, Plugin, Registry, check_is, check_name, version_of


class CaseSettings(BaseModel):
    """What the settings of every case have."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str


CreateCase = Callable[[Any, Walk], Case]
"""(settings, walk) -> what evaluates designs in place of that walk, with its `variables`."""


@dataclass(frozen=True, slots=True)
class CaseFamily:
    """Cases of one kind: for each walk of a job one that evaluates designs in its place.

    Attributes:
        settings: Model of its settings.
        summary: What it is, for people.
        create: Makes one for a walk.
        libraries: Distributions that it computes with beside its own; a job goes on with the same
            versions only, and workers need them.
    """

    settings: type[CaseSettings]
    summary: str
    create: CreateCase
    libraries: tuple[str, ...] = ()

    @property
    def missing(self) -> tuple[str, ...]:
        """Those of its libraries that are not installed here."""
        return tuple(name for name in self.libraries if version_of(name) == MISSING)


def _accepted(plugin: Plugin, brought: object) -> CaseFamily:
    family = check_is(plugin, brought, CaseFamily)
    check_name(plugin, family.settings.model_fields["name"].default)
    return replace(family, libraries=(plugin.distribution, *family.libraries))


CASES: Final = Registry[CaseFamily]("case", {}, _accepted)
"""By name, as in job specs; gaitswarm's own is what a job has that names none."""


def create_case(settings: CaseSettings, walk: Walk) -> Case:
    """What evaluates designs in place of a walk."""
    family = CASES[settings.name]
    if family.missing:
        needed = " ".join(family.missing)
        raise SimulationInputError(
            f"{settings.name} needs what is not installed here: pip install {needed}"
        )
    case = family.create(settings, walk)
    if case.objectives != OBJECTIVES:
        known = ", ".join(objective.name for objective in OBJECTIVES)
        raise SimulationInputError(
            f"{settings.name} does not have the objectives of a walk: {known}"
        )
    return case
