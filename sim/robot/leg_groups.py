"""Groups of a robot's legs, by which they may have gait parameters of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.robot.legs import LegKinematics

if TYPE_CHECKING:
    from gaitswarm.sim.robot.robot import Robot


def rows_of(legs: Sequence[LegKinematics]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Legs of both sides."""
    of_sides: tuple[list[int], list[int]] = [], []
    for number, leg in enumerate(legs):
        of_sides[leg.side < 0.0].append(number)
    left, right = (tuple(sorted(row, key=lambda k: -legs[k].hip[0])) for row in of_sides)
    return left, right


def leg_groups(robot: Robot) -> dict[str, tuple[int, ...]]:
    """The groups that a robot's legs are in."""
    rows = rows_of(robot.legs)
    first = {row[0] for row in rows if row}
    last = {row[-1] for row in rows if row} - first
    members = {
        "all": set(range(len(robot.legs))),
        "left": set(rows[0]),
        "right": set(rows[1]),
        "front": first if last else set[int](),
        "middle": {leg for row in rows for leg in row} - first - last if last else set[int](),
        "hind": last,
    }
    groups = {name: tuple(sorted(group)) for name, group in members.items() if group}
    names = [leg.name for leg in robot.legs]
    groups |= {name: (number,) for number, name in enumerate(names)}
    for name, group in robot.description.leg_groups.items():
        groups[name] = tuple(sorted(names.index(leg) for leg in group))
    return groups


def values_by_leg(robot: Robot, values: Mapping[str, float], parameter: str) -> dict[int, float]:
    """What single legs have of a parameter that groups have values of."""
    groups = leg_groups(robot)
    for name in values:
        if name not in groups:
            raise SimulationInputError(
                f"{parameter}[{name}]: {robot.description.name} has no such group of legs; it has"
                f" {', '.join(groups)}"
            )
    found: dict[int, tuple[int, str]] = {}
    for name in sorted(values, key=lambda name: len(groups[name])):
        group = groups[name]
        for leg in group:
            size, other = found.setdefault(leg, (len(group), name))
            if size == len(group) and other != name:
                raise SimulationInputError(
                    f"{parameter}[{name}]: leg {robot.legs[leg].name!r} is in {other!r}, too, and"
                    " both are of one size; give the leg a value of its own, or name a smaller"
                    " group"
                )
    return {leg: values[name] for leg, (_, name) in found.items()}
