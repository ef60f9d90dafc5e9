"""Perturbations of a robot's model; a world is one value of each."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.sensors import LARGEST_DELAY
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

_SEEDS: Final = 2.0**31
"""Number of seeds that worlds are drawn from."""

_Limits = tuple[float, float]


def _perturbation(
    name: str,
    bounds: tuple[float, float],
    unit: str,
    description: str,
    *,
    limits: _Limits,
    nominal: float = 0.0,
    kind: Literal["continuous", "integer"] = "continuous",
) -> tuple[Variable, _Limits]:
    """Define a variable that is drawn within its bounds, and can be simulated within its limits."""
    low, high = bounds
    variable = Variable(
        name=name,
        low=low,
        high=high,
        unit=unit,
        kind=kind,
        default=nominal,
        description=description,
    )
    return variable, limits


def _factor(
    name: str,
    bounds: tuple[float, float],
    description: str,
    limits: _Limits = (0.0, 100.0),
) -> tuple[Variable, _Limits]:
    return _perturbation(name, bounds, "1", f"Factor of {description}", limits=limits, nominal=1.0)


_TABLE: Final = (
    _factor("friction_factor", (0.70, 1.51), "the friction of all feet (table 2.7)."),
    _factor(
        "stiffness_factor",
        (0.84, 1.18),
        "the stiffness of all soles (table 2.7).",
        (0.01, 100.0),
    ),
    _factor("damping_factor", (0.85, 1.18), "the damping of all soles (table 2.7)."),
    _factor("sole_factor", (0.89, 1.14), "the length of all soles' springs (table 2.7)."),
    _factor(
        "body_mass_factor",
        (0.99, 1.15),
        "the mass and inertia of the body (table 2.7).",
        (0.01, 100.0),
    ),
    _perturbation(
        "load_added",
        (0.0, 0.5),
        "kg",
        "Load in addition to the scenario's (assumed).",
        limits=(0.0, 50.0),
    ),
    _perturbation(
        "load_ahead",
        (-0.05, 0.05),
        "m",
        "Forward offset of the whole load (assumed).",
        limits=(-1.0, 1.0),
    ),
    _perturbation(
        "load_left",
        (-0.03, 0.03),
        "m",
        "Offset of the whole load to the left (assumed).",
        limits=(-1.0, 1.0),
    ),
    _perturbation(
        "load_raised",
        (0.0, 0.05),
        "m",
        "Upward offset of the whole load (assumed).",
        limits=(-1.0, 1.0),
    ),
    _factor(
        "battery_voltage_factor",
        (0.97, 1.02),
        "the battery's open-circuit voltage (table 2.7).",
        (0.01, 10.0),
    ),
    _factor(
        "battery_resistance_factor",
        (0.96, 1.09),
        "the battery's internal resistance (table 2.7).",
    ),
    _factor(
        "efficiency_factor",
        (0.41, 1.22),
        "the efficiency of all gearheads, limited to 1 (table 2.7).",
        (0.01, 100.0),
    ),
    _factor(
        "viscous_friction_factor",
        (0.8, 1.5),
        "the viscous friction of all motors and gearheads: cold or worn grease (assumed).",
    ),
    _factor(
        "backlash_factor",
        (0.8, 1.2),
        "the backlash of all gears, 2 to 3 degrees as measured; no effect without backlash.",
    ),
    _perturbation(
        "angle_noise",
        (0.0, 1e-3),
        "rad",
        "Standard deviation of white noise on the encoders: about ten counts (assumed).",
        limits=(0.0, 1.0),
    ),
    _perturbation(
        "current_noise",
        (0.0, 0.05),
        "A",
        "Standard deviation of white noise on the current sensors: about six steps (assumed).",
        limits=(0.0, 10.0),
    ),
    _perturbation(
        "angle_delay",
        (0.0, 2.0),
        "ticks",
        "Delay of the controller's angle readings in control ticks of 2 ms (assumed).",
        limits=(0.0, LARGEST_DELAY),
        kind="integer",
    ),
    _perturbation(
        "current_delay",
        (0.0, 2.0),
        "ticks",
        "Delay of the controller's current readings in control ticks of 2 ms (assumed).",
        limits=(0.0, LARGEST_DELAY),
        kind="integer",
    ),
    _perturbation(
        "slope_added",
        (0.0, 3.0),
        "deg",
        "Slope in addition to the scenario's (assumed).",
        limits=(0.0, 45.0),
    ),
    _perturbation(
        "slope_added_direction",
        (-180.0, 180.0),
        "deg",
        "Direction in which that slope rises, from straight ahead towards the left.",
        limits=(-180.0, 180.0),
    ),
    _perturbation(
        "start_angle",
        (0.0, 0.03),
        "rad",
        "Standard deviation of the joints' angles at the start (assumed).",
        limits=(0.0, 0.2),
    ),
    _perturbation(
        "start_height",
        (0.0, 0.01),
        "m",
        "Height of the start above the stance at which the soles carry the weight (assumed).",
        limits=(0.0, 0.5),
    ),
    _perturbation(
        "start_roll",
        (-3.0, 3.0),
        "deg",
        "Tilt of the body at the start, the left side up (assumed).",
        limits=(-30.0, 30.0),
    ),
    _perturbation(
        "start_pitch",
        (-3.0, 3.0),
        "deg",
        "Tilt of the body at the start, the front down (assumed).",
        limits=(-30.0, 30.0),
    ),
    _perturbation(
        "world_seed",
        (0.0, _SEEDS - 1.0),
        "1",
        "Seed of the randomness within the world: sensor noise, start angles, place on rough"
        " ground.",
        limits=(0.0, 2.0**53),
        kind="integer",
    ),
    _perturbation(
        "roughness",
        (0.0, 0.02),
        "m",
        "Amplitude of rough ground (assumed); drawn only if chosen.",
        limits=(0.0, 0.5),
    ),
)

PERTURBATIONS: Final[tuple[Variable, ...]] = tuple(variable for variable, _ in _TABLE)
"""Quantities that a world may vary; `default` is the nominal value.

Bounds are the default ranges to draw worlds from. Factors of table 2.7 span the widest of its
intervals, relative to the optimum, among all legs."""

DRAWN: Final = tuple(v for v in PERTURBATIONS if v.name != "roughness")
"""Drawn by default."""

NOMINAL: Final[Mapping[str, float]] = MappingProxyType(
    {v.name: v.default for v in PERTURBATIONS if v.default is not None}
)
"""Nominal value of each perturbation."""

LIMITS: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {variable.name: limits for variable, limits in _TABLE}
)
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
