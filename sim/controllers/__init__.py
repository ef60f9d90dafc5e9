"""Motor controllers: variables to tune and their compilation to integers."""

from __future__ import annotations

from typing import Final, Literal

from sim.controllers.base import ControlLaw, Controller, Inference, LookupTable, names_of
from sim.controllers.fuzzy_pi import FuzzyPi
from sim.controllers.fuzzy_pi_3 import FuzzyPi3
from sim.controllers.linear import PI, PID, P

ControllerName = Literal["fuzzy-pi", "fuzzy-pi-3", "p", "pi", "pid"]

CONTROLLERS: Final[dict[ControllerName, Controller]] = {
    "fuzzy-pi": FuzzyPi(),
    "fuzzy-pi-3": FuzzyPi3(),
    "p": P,
    "pi": PI,
    "pid": PID,
}
"""By name, as in job specs and on the command line."""

__all__ = [
    "CONTROLLERS",
    "ControlLaw",
    "Controller",
    "ControllerName",
    "Inference",
    "LookupTable",
    "names_of",
]
