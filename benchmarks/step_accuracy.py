"""Accuracy of a time step, and of MuJoCo's semi-implicit Euler under the same forces.

    python -m benchmarks.step_accuracy [--rates 2500 5000 10000 20000 40000] [--json]

The published optimum A walks `normal-fast` on the robot of `benchmarks.engines`. Objectives are
compared with those of our walk at 160 kHz. In MuJoCo the laws of gears and ground are ours,
rewritten in NumPy (sim/mujoco), and all steps have one length, so that only the step
differs.
"""

from __future__ import annotations

import argparse
import json
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.physics import ROBOT
from gaitswarm.sim.assembly import PHYSICS_RATE, control_steps, judge, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.mujoco.kernel import MujocoKernel
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate

SCENARIO = SCENARIOS[0]
FINE: Final = 160_000
"""Steps a second [Hz] of what all are compared with."""
COMPARED: Final = 5
"""Objectives f1 to f5; f6 is a difference close to zero."""

Floats = NDArray[np.float64]


def ours(rate: int) -> Floats:
    """Objectives of our walk at a physics rate [Hz]."""
    design = CONTROLLERS["fuzzy-pi"].published["A"]
    values = np.array([list(design.values())])
    result = simulate(SCENARIO, "fuzzy-pi", list(design), values, robot=ROBOT, physics_rate=rate)
    return result.outcome.objectives[0, :COMPARED]


def mujocos(rate: int) -> Floats:
    """Objectives in MuJoCo's own steps under our forces."""
    robot = load_robot(ROBOT)
    coding, timestep = control_steps(robot)
    plan = plan_walk(robot, SCENARIO, timestep)
    assert plan is not None
    setup = plan(CONTROLLERS["fuzzy-pi"].compile(CONTROLLERS["fuzzy-pi"].published["A"]))
    (result,) = MujocoKernel(robot, rate=rate).walk([setup], coding, log=False)
    return judge(setup, result, coding.substeps, timestep)[1][:COMPARED]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    rates = [2_500, 5_000, 10_000, 20_000, 40_000]
    parser.add_argument("--rates", type=int, nargs="+", default=rates, metavar="HZ")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    exact = ours(FINE)
    walked = [("ours", PHYSICS_RATE, ours(PHYSICS_RATE))]
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
