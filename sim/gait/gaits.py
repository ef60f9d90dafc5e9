"""Gaits by name, and each leg's part of a gait: its *lag*, a share of the cycle.

A foot touches down by its lag after the first one (Hildebrand 1965, "Symmetrical gaits of horses",
Science 150; 1989, "The quadrupedal gaits of vertebrates", BioScience 39).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.robot.legs import LegKinematics
from gaitswarm.sim.robot.robot import Robot, rows_of, values_by_leg
from gaitswarm.sim.scenario import BY_LEG_GROUP, GaitName, Scenario
from gaitswarm.sim.variables import split_name

Rows = tuple[Sequence[int], Sequence[int]]
"""Indices of the legs on the left and on the right, from front to hind."""


@dataclass(frozen=True, slots=True)
class Gait:
    """An order of footfalls."""

    name: GaitName
    description: str  # with its source
    # numbers of legs that it is defined for, half of them on each side; any if empty
    legs: tuple[int, ...]
    # from the legs' rows to the lag of each leg, by its index
    lags: Callable[[Rows], Mapping[int, float]]
    # feet in the air at a time; None for half of them
    swinging: int | None = None

    def duty_factor(self, legs: int) -> float:
        """Share of support at which a foot lifts off when another one has touched down [1]."""
        return 0.5 if self.swinging is None else 1.0 - self.swinging / legs


def _places(rows: Rows) -> Iterator[tuple[int, int, int, int]]:
    """Leg, side (0 left, 1 right), place from the front, and the number of legs on its side."""
    for side, row in enumerate(rows):
        for place, leg in enumerate(row):
            yield leg, side, place, len(row)


def _alternating(rows: Rows) -> dict[int, float]:
    return {leg: 0.5 * ((place + side) % 2) for leg, side, place, _ in _places(rows)}


def _wave(rows: Rows) -> dict[int, float]:
    left, right = rows
    order = [*reversed(left), *reversed(right)]
    return {leg: k / len(order) for k, leg in enumerate(order)}


def _ripple(rows: Rows) -> dict[int, float]:
    return {
        leg: (0.5 * side + (row - 1 - place) / row) % 1.0 for leg, side, place, row in _places(rows)
    }


def _pace(rows: Rows) -> dict[int, float]:
    return {leg: 0.5 * side for leg, side, _, _ in _places(rows)}


def _bound(rows: Rows) -> dict[int, float]:
    return {leg: 0.5 * (row - 1 - place) for leg, _, place, row in _places(rows)}


_GAITS: Final = (
    Gait(
        "alternating",
        "legs that are neighbours, along a side or across the body, half a cycle apart: the trot of"
        " four legs, the tripod of six",
        (),
        _alternating,
    ),
    Gait(
        "tripod",
        "front and hind leg of a side with the middle leg of the other, half a cycle apart"
        " (Wilson 1966)",
        (6,),
        _alternating,
    ),
    Gait(
        "wave",
        "one leg after the other from hind to front, the left side before the right (Wilson 1966;"
        " Song and Waldron 1987)",
        (),
        _wave,
        1,
    ),
    Gait(
        "ripple",
        "a wave from hind to front along each side, half a cycle apart: twice as fast as the wave"
        " gait (Wilson 1966)",
        (6, 8, 10, 12),
        _ripple,
        2,
    ),
    Gait("trot", "diagonal pairs half a cycle apart (Hildebrand 1965)", (4,), _alternating),
    Gait(
        "pace",
        "the legs of a side together, the sides half a cycle apart (Hildebrand 1965)",
        (4,),
        _pace,
    ),
    Gait(
        "bound",
        "the hind legs together, the front legs half a cycle later (Hildebrand 1989)",
        (4,),
        _bound,
    ),
    Gait(
        "crawl",
        "left hind, left front, right hind, right front, a quarter of a cycle apart: the lateral"
        " sequence, of all orders the most stable (McGhee and Frank 1968)",
        (4,),
        _wave,
        1,
    ),
)

GAITS: Final[Mapping[GaitName, Gait]] = MappingProxyType({gait.name: gait for gait in _GAITS})
"""All but `own`, which is defined by a robot's description."""


def find_gait(name: str) -> Gait:
    for gait in _GAITS:
        if gait.name == name:
            return gait
    raise SimulationInputError(f"unknown gait {name!r}; {instead_of(name, GAITS)}")


def suits(gait: Gait, legs: Sequence[LegKinematics]) -> bool:
    """Whether a gait is defined for a robot's legs."""
    left, right = rows_of(legs)
    return not gait.legs or (len(legs) in gait.legs and len(left) == len(right))


def lags_of(gait: Gait, legs: Sequence[LegKinematics]) -> tuple[float, ...]:
    """Return the lag of each leg of a robot."""
    if not suits(gait, legs):
        fitting = ", ".join(name for name, other in GAITS.items() if suits(other, legs))
        left, right = rows_of(legs)
        raise SimulationInputError(
            f"gait: {gait.name} is for {' or '.join(map(str, gait.legs))} legs, half of them on"
            f" each side, not for {len(left)} on the left and {len(right)} on the right; choose"
            f" {fitting}, or custom phases"
        )
    lags = gait.lags(rows_of(legs))
    return tuple(lags[leg] for leg in range(len(legs)))


def phases_of(robot: Robot, scenario: Scenario) -> tuple[float, ...]:
    """Return each leg's phase when the gait begins, before `start_phase`."""
    if scenario.phases is not None:
        names = [leg.name for leg in robot.legs]
        if scenario.phases.keys() != set(names):
            raise SimulationInputError(
                f"phases: given for {', '.join(scenario.phases)}; {robot.description.name} has the"
                f" legs {', '.join(names)}, and each needs one"
            )
        return tuple(scenario.phases[name] for name in names)
    if scenario.gait == "own":
        return tuple(leg.phase for leg in robot.description.legs)
    # A leg that touches down later is not as far in its cycle.
    return tuple((1.0 - lag) % 1.0 for lag in lags_of(GAITS[scenario.gait], robot.legs))


@dataclass(frozen=True, slots=True)
class LegGait:
    """One leg's part of a gait."""

    # share of the cycle since the start of its support when the walk begins, 0 or more
    phase: float
    support_share: float  # support's share of the cycle [1]
    stride: float  # length of the support, with the scenario's turn [m]
    height: float  # of the swing [m]
    radius: float  # lateral distance of the foot from the body's long axis [m]


@dataclass(frozen=True, slots=True)
class Sway:
    """Motion of the body relative to its course, while the feet keep their places on the ground."""

    lateral: float  # amplitude to the left and right, once per cycle [m]
    longitudinal: float  # amplitude along the course, twice per cycle [m]
    begin: float  # share of the cycle at the start of the walk since the body was furthest left

    @classmethod
    def of(cls, scenario: Scenario) -> Sway | None:
        if not scenario.sway_lateral and not scenario.sway_longitudinal:
            return None
        begin = scenario.start_phase - scenario.sway_phase
        return cls(scenario.sway_lateral, scenario.sway_longitudinal, begin)

    def body(self, cycles: Floats) -> tuple[Floats, Floats]:
        """Displacement of the body along the course and to the left [m] at times in cycles (T,)."""
        angle = 2.0 * np.pi * (cycles + self.begin)
        # Forward while a left hind leg steps, back while the left front leg does: a lying eight.
        return -self.longitudinal * np.sin(2.0 * angle), self.lateral * np.cos(angle)


def leg_gaits(robot: Robot, scenario: Scenario) -> tuple[LegGait, ...]:
    values = _by_parameter(robot, scenario)
    strides, heights, duties, begins, radii = (
        values.get(name, {})
        for name in ("stride", "height", "duty_factor", "start_phase", "radius")
    )
    return tuple(
        LegGait(
            phase=phase + begins.get(k, scenario.start_phase),
            support_share=scenario.support_share_of(duties.get(k, scenario.duty_factor)),
            stride=scenario.stride_of(leg.side, strides.get(k)),
            height=heights.get(k, scenario.height),
            radius=radii.get(k, scenario.radius),
        )
        for k, (leg, phase) in enumerate(zip(robot.legs, phases_of(robot, scenario), strict=True))
    )


def _by_parameter(robot: Robot, scenario: Scenario) -> dict[str, dict[int, float]]:
    """Values of legs whose groups differ from the scenario, by parameter and leg."""
    of_groups: dict[str, dict[str, float]] = {}
    for name, value in (scenario.by_group or {}).items():
        parameter, group = split_name(name)
        of_groups.setdefault(parameter, {})[str(group)] = value
    return {
        parameter: values_by_leg(robot, of_groups[parameter], parameter)
        for parameter in BY_LEG_GROUP
        if parameter in of_groups
    }


def supporting(gaits: Sequence[LegGait], cycles: Floats) -> NDArray[np.bool_]:
    """Which feet are planned to be on the ground (T, L) at times since the start in cycles (T,)."""
    phases = np.array([gait.phase for gait in gaits])
    shares = np.array([gait.support_share for gait in gaits])
    return np.asarray(np.mod(cycles[:, None] + phases, 1.0) < shares)
