"""How exact a step is: ours, and MuJoCo's semi-implicit Euler under the same forces.

    python -m benchmarks.step_accuracy [--rates 2500 5000 10000 20000 40000] [--json]

The published optimum A walks `normal-fast` on the robot of `benchmarks.engines`. Objectives are
compared with those of our walk at 160 kHz. In MuJoCo the forces of gears and ground are ours,
written anew in NumPy (tests/mujoco), so that nothing but the step differs.
"""

from __future__ import annotations

import argparse
import json
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.physics import ROBOT
from sim.assembly import PHYSICS_RATE
from sim.controllers import CONTROLLERS
from sim.kernel.observation import WalkLog
from sim.robot import load_robot
from sim.scenario import SCENARIOS
from sim.simulate import simulate
from tests.mujoco.controllers import FuzzyPi
from tests.mujoco.walker import walk_by_euler

SCENARIO = SCENARIOS[0]
FINE: Final = 160_000
"""Steps a second [Hz] of what all are compared with."""
COMPARED: Final = 5
"""Objectives f1 to f5; f6 is a difference close to zero."""

Floats = NDArray[np.float64]


def ours(rate: int) -> tuple[Floats, WalkLog]:
    """Objectives and log of our walk at a physics rate [Hz]."""
    design = CONTROLLERS["fuzzy-pi"].published["A"]
    values = np.array([list(design.values())])
    result = simulate(
        SCENARIO, "fuzzy-pi", list(design), values, robot=ROBOT, physics_rate=rate, log=True
    )
    (log,) = result.logs
    assert log is not None
    return result.outcome.objectives[0, :COMPARED], log


def mujocos(rate: int) -> Floats:
    """Objectives in MuJoCo's own steps under our forces."""
    _, log = ours(PHYSICS_RATE)
    robot = load_robot(ROBOT)
    controller = FuzzyPi(robot, log, CONTROLLERS["fuzzy-pi"].published["A"])
    trace = walk_by_euler(robot, SCENARIO, log, controller, timestep=1.0 / rate)
    return trace.objectives[:COMPARED]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    rates = [2_500, 5_000, 10_000, 20_000, 40_000]
    parser.add_argument("--rates", type=int, nargs="+", default=rates, metavar="HZ")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    exact, _ = ours(FINE)
    walked = [("ours", PHYSICS_RATE, ours(PHYSICS_RATE)[0])]
    walked += [("MuJoCo's Euler", rate, mujocos(rate)) for rate in options.rates]
    rows = [
        {"step": step, "rate": rate, "percent": (100.0 * np.abs(found / exact - 1.0)).tolist()}
        for step, rate, found in walked
    ]
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    names = "".join(f"{f'f{k}':>8}" for k in range(1, 1 + COMPARED))
    print(f"{f'deviation from {FINE / 1e3:g} kHz [%]':31}{names}")
    for row in rows:
        percent = "".join(f"{value:8.3f}" for value in row["percent"])
        print(f"{row['step']:16} {row['rate'] / 1e3:10g} kHz{percent}")


if __name__ == "__main__":
    main()
