"""Static stability of a planned gait: whether its feet support the centre of mass at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.gait.gaits import leg_gaits, supporting
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.robot.limbs import feet_and_centre_of_mass
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario

_SAMPLES: Final = 240
"""Number of sampled times in a cycle."""


@dataclass(frozen=True, slots=True)
class Stability:
    """Static stability of a gait."""

    # smallest distance of the centre of mass, projected along gravity, from the edge of the polygon
    # of the supporting feet [m]; negative outside of it, as with fewer than three feet. The static
    # stability margin of McGhee and Frank (1968), Mathematical Biosciences 3. None if at some time
    # no foot is on the ground.
    margin: float | None
    fewest_feet: int  # minimum of feet on the ground
    duty_factor: float  # mean of the legs' shares of support [1]

    @property
    def stable(self) -> bool:
        return self.margin is not None and self.margin > 0.0


@lru_cache(maxsize=64)
def static_stability(robot: Robot, scenario: Scenario) -> Stability:
    """Evaluate a planned cycle, without simulation."""
    require_reachable(robot, scenario)
    plan = scenario.model_copy(update={"cycles": 1.0, "fir_ms": 0, "trajectory_rate": 500.0})
    angles = desired_angles(robot, plan).angles
    ticks = np.unique(np.linspace(0, len(angles) - 1, _SAMPLES).astype(np.intp))
    gaits = leg_gaits(robot, scenario)
    cycles = np.asarray(ticks * CONTROL_PERIOD / scenario.cycle_time, dtype=np.float64)
    stands = supporting(gaits, cycles)
    feet, centre = feet_and_centre_of_mass(robot, angles[ticks], scenario.load)
    duty = float(np.mean([gait.support_share for gait in gaits]))
    result = Stability(None, int(stands.sum(axis=1).min()), duty)
    if not result.fewest_feet:
        return result
    ground = np.min(np.where(stands, feet[:, :, 2], np.inf), axis=1)
    downhill = math.radians(scenario.slope_direction) + math.pi
    lean = (centre[:, 2] - ground) * math.tan(math.radians(scenario.slope))
    below = centre[:, :2] + lean[:, None] * np.array([math.cos(downhill), math.sin(downhill)])
    margins = [
        support_margin(points[standing, :2], at)
        for points, standing, at in zip(feet, stands, below, strict=True)
    ]
    return replace(result, margin=min(margins))


def support_margin(feet: Floats, point: Floats) -> float:
    """Distance of a point (2,) from the edge of the convex hull of feet (n, 2) [m]."""
    hull = _convex_hull([(x, y) for x, y in feet.tolist()])
    x, y = point.tolist()
    distances, inside = [], len(hull) > 2
    for (ax, ay), (bx, by) in zip(hull, hull[1:] + hull[:1], strict=True):
        along = (bx - ax, by - ay)
        square = along[0] ** 2 + along[1] ** 2
        share = ((x - ax) * along[0] + (y - ay) * along[1]) / square if square else 0.0
        share = min(1.0, max(0.0, share))
        distances.append(math.hypot(x - ax - share * along[0], y - ay - share * along[1]))
        inside = inside and along[0] * (y - ay) - along[1] * (x - ax) > 0.0
    return min(distances) if inside else -min(distances)


def _convex_hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Corners, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    halves = []
    for direction in (ordered, ordered[::-1]):
        half: list[tuple[float, float]] = []
        for x, y in direction:
            # Drop corners at which the path does not turn left.
            while len(half) > 1:
                (ax, ay), (bx, by) = half[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                half.pop()
            half.append((x, y))
        halves.append(half[:-1])
    return halves[0] + halves[1]
