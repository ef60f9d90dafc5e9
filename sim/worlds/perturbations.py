"""What may be wrong with a model of a robot, as data: one world is one value of each."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.errors import SimulationInputError
from sim.variables import Variable

Floats = NDArray[np.float64]


def _factor(name: str, low: float, high: float, description: str) -> Variable:
    """A factor of something that the robot's description gives."""
    return Variable(
        name=name, low=low, high=high, unit="1", default=1.0, description=f"Factor of {description}"
    )


def _added(name: str, low: float, high: float, unit: str, description: str) -> Variable:
    """Something that is added to what the robot or the scenario has."""
    return Variable(name=name, low=low, high=high, unit=unit, default=0.0, description=description)


PERTURBATIONS: Final[tuple[Variable, ...]] = (
    _factor("friction_factor", 0.70, 1.51, "the friction of all feet (table 2.7)."),
    _factor("stiffness_factor", 0.84, 1.18, "the stiffness of all soles (table 2.7)."),
    _factor("damping_factor", 0.85, 1.18, "the damping of all soles (table 2.7)."),
    _factor("sole_factor", 0.89, 1.14, "the length of all soles' springs (table 2.7)."),
    _factor("body_mass_factor", 0.99, 1.15, "the mass and inertia of the body (table 2.7)."),
    _added("load_added", 0.0, 0.5, "kg", "Load beside the scenario's (assumed)."),
    _added("load_ahead", -0.05, 0.05, "m", "Of the whole load, before its place (assumed)."),
    _added("load_left", -0.03, 0.03, "m", "Of the whole load, left of its place (assumed)."),
    _added("load_raised", 0.0, 0.05, "m", "Of the whole load, over its place (assumed)."),
    _factor(
        "battery_voltage_factor", 0.97, 1.02, "the battery's open-circuit voltage (table 2.7)."
    ),
    _factor(
        "battery_resistance_factor", 0.96, 1.09, "the battery's internal resistance (table 2.7)."
    ),
    _factor(
        "efficiency_factor",
        0.41,
        1.22,
        "the efficiency of all gearheads, which stays 1 at most (table 2.7).",
    ),
    _factor(
        "viscous_friction_factor",
        0.8,
        1.5,
        "the viscous friction of all motors and gearheads: cold or worn grease (assumed).",
    ),
    _added("slope_added", 0.0, 3.0, "deg", "Slope beside the scenario's (assumed)."),
    Variable(
        name="slope_added_direction",
        low=-180.0,
        high=180.0,
        unit="deg",
        default=0.0,
        description="Where that slope rises, from straight ahead towards the left.",
    ),
)
"""What a world may vary: `default` is nominal, what the model has without it.

Bounds are those that worlds are drawn from where nobody gives others. Factors of table 2.7 span the
widest of its intervals, each over its optimum, among all legs."""

NOMINAL: Final[Mapping[str, float]] = MappingProxyType(
    {v.name: v.default for v in PERTURBATIONS if v.default is not None}
)
"""Value of each in the world that the model knows."""

_LIMITS: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "friction_factor": (0.0, 100.0),
        "stiffness_factor": (0.01, 100.0),
        "damping_factor": (0.0, 100.0),
        "sole_factor": (0.0, 10.0),
        "body_mass_factor": (0.01, 100.0),
        "load_added": (0.0, 50.0),
        "load_ahead": (-1.0, 1.0),
        "load_left": (-1.0, 1.0),
        "load_raised": (-1.0, 1.0),
        "battery_voltage_factor": (0.01, 10.0),
        "battery_resistance_factor": (0.0, 100.0),
        "efficiency_factor": (0.01, 100.0),
        "viscous_friction_factor": (0.0, 100.0),
        "slope_added": (0.0, 45.0),
        "slope_added_direction": (-180.0, 180.0),
    }
)
"""Least and largest value of each that can be simulated."""


def check_worlds(variables: Sequence[str], worlds: Floats) -> None:
    """Refuse worlds that cannot be simulated.

    Args:
        variables: Columns of the worlds, names of `PERTURBATIONS`.
        worlds: (n, len(variables)), in the variables' units.

    Raises:
        SimulationInputError: There is no such perturbation, or a value lies beyond what can be
            simulated; names it.
    """
    for name in variables:
        if name not in _LIMITS:
            raise SimulationInputError(f"{name}: no perturbation; known are {', '.join(_LIMITS)}")
    if worlds.ndim != 2 or worlds.shape[1] != len(variables):
        raise SimulationInputError(
            f"worlds: shape {worlds.shape} does not match {len(variables)} perturbations"
        )
    for name, column in zip(variables, worlds.T, strict=True):
        low, high = _LIMITS[name]
        outside = ~((column >= low) & (column <= high))
        if outside.any():
            world = int(np.argmax(outside))
            raise SimulationInputError(
                f"{name}: {column[world]:g} in world {world}; it must lie in {low:g} to {high:g}"
            )


def sample_worlds(count: int, seed: int, choice: Sequence[Variable] = PERTURBATIONS) -> Floats:
    """Draw worlds, each variable uniformly between its bounds.

    Each variable has a Philox stream of its own, so a world has the same values however many are
    drawn and whatever else is varied, and bounds that are moved move its value alone.

    Args:
        count: Of the worlds.
        seed: Of the streams, >= 0.
        choice: What is varied, with its bounds.

    Returns:
        (count, len(choice)), columns in the order of the choice.
    """
    worlds = np.empty((count, len(choice)))
    for column, variable in zip(worlds.T, choice, strict=True):
        name = int.from_bytes(hashlib.sha256(variable.name.encode()).digest()[:8], "little")
        share = np.random.Generator(np.random.Philox(key=[seed, name])).random(count)
        if variable.kind == "continuous":
            column[:] = variable.low + share * (variable.high - variable.low)
        else:
            column[:] = np.floor(variable.low + share * (variable.high - variable.low + 1.0))
    return worlds
