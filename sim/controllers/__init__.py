"""Motor controllers: design variables, and their compilation to integers."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Final, TypeAlias

from gaitswarm.sim.controllers.base import ControlLaw, Controller, Inference, LookupTable, names_of
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.controllers.fuzzy_pi_3 import FuzzyPi3
from gaitswarm.sim.controllers.linear import LINEAR_CONTROLLERS
from gaitswarm.sim.plugins import KnownName, Plugin, Registry, check_is, check_name


def _accepted(plugin: Plugin, candidate: object) -> Controller:
    controller: Controller = check_is(plugin, candidate, Controller)  # type: ignore[type-abstract]
    check_name(plugin, controller.name)
    return controller


CONTROLLERS: Final = Registry[Controller](
    "controller",
    {controller.name: controller for controller in (FuzzyPi(), FuzzyPi3(), *LINEAR_CONTROLLERS)},
    _accepted,
)
"""By name."""

ControllerName: TypeAlias = Annotated[str, KnownName(CONTROLLERS)]


@lru_cache(maxsize=192)
def control_law(controller: ControllerName, gains: tuple[tuple[str, float], ...]) -> ControlLaw:
    """Compile a design, once for all scenarios."""
    return CONTROLLERS[controller].compile(dict(gains))


__all__ = [
    "CONTROLLERS",
    "ControlLaw",
    "Controller",
    "ControllerName",
    "Inference",
    "LookupTable",
    "control_law",
    "names_of",
]
