"""Motor controllers: variables to tune and their compilation to integers."""

from __future__ import annotations

from typing import Final, Literal

from sim.controllers.base import Controller, Drive
from sim.controllers.fuzzy_pi import FuzzyPi
from sim.controllers.pi import Pi

ControllerName = Literal["fuzzy-pi", "pi"]

CONTROLLERS: Final[dict[ControllerName, Controller]] = {"fuzzy-pi": FuzzyPi(), "pi": Pi()}
"""By name, as in job specs and on the command line."""

__all__ = ["CONTROLLERS", "Controller", "ControllerName", "Drive"]
