"""Perturbations of a robot's model; a world is one value of each."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, listed_limits, listed_variables

PERTURBATIONS: Final = listed_variables("world", "worlds")
"""Quantities that a world may vary; `default` is the nominal value."""

DRAWN: Final = tuple(v for v in PERTURBATIONS if v.name != "roughness")
"""Drawn by default."""

NOMINAL: Final[Mapping[str, float]] = MappingProxyType(
    {v.name: v.default for v in PERTURBATIONS if v.default is not None}
)
"""Nominal value of each perturbation."""

LIMITS: Final = listed_limits("world", "worlds")
"""Least and largest value of each that can be simulated; other bounds must lie within."""


_WHOLE: Final = frozenset(v.name for v in PERTURBATIONS if v.kind == "integer")


def check_worlds(variables: Sequence[str], worlds: Floats) -> None:
    """Reject worlds (n, len(variables)) that cannot be simulated."""
    for name in variables:
        if name not in LIMITS:
            raise SimulationInputError(f"{name}: unknown perturbation; {instead_of(name, LIMITS)}")
    if worlds.ndim != 2 or worlds.shape[1] != len(variables):
        raise SimulationInputError(
            f"worlds: shape {worlds.shape} does not match {len(variables)} perturbations"
        )
    for name, column in zip(variables, worlds.T, strict=True):
        low, high = LIMITS[name]
        outside = ~((column >= low) & (column <= high))
        if outside.any():
            raise SimulationInputError(
                f"{name}: {_first(outside, column)} must lie in {low:g} to {high:g}"
            )
        broken = column != np.rint(column)
        if name in _WHOLE and broken.any():
            raise SimulationInputError(f"{name}: {_first(broken, column)} is not a whole number")


def _first(wrong: NDArray[np.bool_], column: Floats) -> str:
    world = int(np.argmax(wrong))
    return f"{column[world]:g}" + (f" in world {world}" if len(column) > 1 else "")


def sample_worlds(count: int, seed: int, choice: Sequence[Variable] = DRAWN) -> Floats:
    """Draw worlds (count, len(choice)), each variable uniformly between its bounds.

    Each variable has its own Philox stream, so its values depend neither on the number of worlds
    nor on other variables, and changed bounds affect it alone.
    """
    worlds = np.empty((count, len(choice)))
    for column, variable in zip(worlds.T, choice, strict=True):
        name = int.from_bytes(hashlib.sha256(variable.name.encode()).digest()[:8], "little")
        stream = np.random.Philox(key=np.array([seed, name], dtype=np.uint64))
        share = np.random.Generator(stream).random(count)
        if variable.kind == "integer":
            column[:] = np.floor(variable.low + share * (variable.high - variable.low + 1.0))
        else:
            column[:] = variable.low + share * (variable.high - variable.low)
    return worlds
