"""A walker's physics step: compiled kernel, CasADi's interpreter, Pinocchio's ABA alone.

    python -m benchmarks.physics [--rounds 5] [--json]

The contestants take turns, so that a busy machine slows all of them alike; medians are compared.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from typing import Final

import numpy as np
import pinocchio as pin

from benchmarks.simulator import measure
from gaitswarm.sim.assembly import PHYSICS_RATE, control_steps, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.reference import Stepper
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS

ROBOT: Final = "szabadka2"
"""Whose feet all touch the ground alike: MuJoCo's own contacts are fitted to that."""


def native() -> float:
    """Whole walks: control, physics and objectives; us a step and walker."""
    return measure(repeats=1, backend="native", robot=ROBOT).us_per_step_per_walker


def interpreter() -> Callable[[], float]:
    """The same physics step in CasADi's virtual machine, without control; us a step."""
    robot = load_robot(ROBOT)
    plan = plan_walk(robot, SCENARIOS[0], 1.0 / PHYSICS_RATE)
    assert plan is not None
    setup = plan(CONTROLLERS["p"].compile({"P": 0.25}))
    coding, _ = control_steps(robot)
    stepper = Stepper(physics_model(robot), setup, coding, loose=robot.has_backlash)

    def step() -> None:
        stepper.kick()
        stepper.drift(1.0)

    def run() -> float:
        stepper.q[:] = setup.start
        stepper.v[:] = 0.0
        return per_call(step, 5000)

    return run


def pinocchio_aba() -> Callable[[], float]:
    """Pinocchio's articulated-body algorithm alone, called from Python; us a call."""
    model = pin.buildModelFromXML(load_robot(ROBOT).urdf.text, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    v, tau = np.zeros(model.nv), np.zeros(model.nv)
    return lambda: per_call(lambda: pin.aba(model, data, q, v, tau), 20000)


def per_call(call: Callable[[], object], times: int) -> float:
    """Microseconds a call."""
    start = time.perf_counter()
    for _ in range(times):
        call()
    return (time.perf_counter() - start) / times * 1e6


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    contestants = {
        "compiled kernel, whole walk": native,
        "CasADi interpreter, step only": interpreter(),
        "pinocchio.aba from Python, dynamics only": pinocchio_aba(),
    }
    seen: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(options.rounds):
        for name, run in contestants.items():
            seen[name].append(run())
    medians = {name: statistics.median(values) for name, values in seen.items()}
    base = next(iter(medians.values()))
    rows = [
        {
            "what": name,
            "us_per_step": median,
            "fastest": min(seen[name]),
            "times_the_kernel": median / base,
            "real_time_factor": 1e6 / PHYSICS_RATE / median,
        }
        for name, median in medians.items()
    ]
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    print(f"{'':42} {'us/step':>8} {'fastest':>8} {'ratio':>7} {'x real time':>12}")
    for row in rows:
        print(
            f"{row['what']:42} {row['us_per_step']:8.3f} {row['fastest']:8.3f}"
            f" {row['times_the_kernel']:7.1f} {row['real_time_factor']:12.0f}"
        )


if __name__ == "__main__":
    main()
