"""The same robot in three engines: our compiled kernel, MuJoCo's rollout, Pinocchio's ABA.

    python -m benchmarks.engines [--rounds 5] [--json]

One thread each, the same step of 0.2 ms. The contestants take turns, so that a busy machine slows
all of them alike; medians are compared. What they do is not the same: the kernel walks, with
control, battery, ground and objectives; MuJoCo rolls out the logged motor voltages, with its own
contacts or in free flight; Pinocchio computes accelerations only.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from benchmarks.physics import ROBOT, native, pinocchio_aba
from sim.assembly import PHYSICS_RATE
from sim.kernel.observation import WalkLog
from sim.robot import load_robot
from sim.scenario import SCENARIOS
from sim.simulate import simulate
from tests.mujoco.export import Feet, model
from tests.mujoco.walker import CONTROL_PERIOD, drag_of

SCENARIO = SCENARIOS[0]
SUBSTEPS = round(CONTROL_PERIOD * PHYSICS_RATE)


def stiff_walk() -> WalkLog:
    """A walk whose voltages are played back."""
    designs = np.array([[0.45, 0.0]])
    (log,) = simulate(SCENARIO, "pi", ["P", "I"], designs, robot=ROBOT, log=True).logs
    assert log is not None
    return log


def mujoco_rollout(log: WalkLog, *, contacts: bool) -> Callable[[], float]:
    """A whole walk in `mujoco.rollout`, motors as affine actuators; us a step."""
    robot = load_robot(ROBOT)
    feet = Feet(drag_of(robot, SCENARIO)) if contacts else None
    m = model(robot, scenario=SCENARIO, feet=feet, motor_voltage=True)
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    d = mujoco.MjData(m)
    d.qpos[:] = np.concatenate(
        [log.base_position[0], log.base_orientation[0, [3, 0, 1, 2]], log.joint_angle[0]]
    )
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty((1, mujoco.mj_stateSize(m, kind)))
    mujoco.mj_getState(m, d, start[0], kind)
    voltage = np.repeat(log.voltage, SUBSTEPS, axis=0)[None]
    states = np.empty((1, voltage.shape[1], start.shape[1]))
    rollout = Rollout(nthread=0)

    def run() -> float:
        before = time.perf_counter()
        rollout.rollout(m, d, start, voltage, state=states)
        elapsed = time.perf_counter() - before
        # FULLPHYSICS begins with the time; then comes the position.
        walked = float(states[0, -1, 1] - log.base_position[0, 0])
        if contacts:
            assert walked > 0.8 * (log.base_position[-1, 0] - log.base_position[0, 0])
        return elapsed / len(log.time) / SUBSTEPS * 1e6

    return run


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    log = stiff_walk()
    contestants = {
        "compiled kernel, whole walk": native,
        "mujoco.rollout, own contacts": mujoco_rollout(log, contacts=True),
        "mujoco.rollout, free flight": mujoco_rollout(log, contacts=False),
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
        print(json.dumps({"mujoco": mujoco.__version__, "rows": rows}, indent=2))
        return
    print(f"{'':42} {'us/step':>8} {'fastest':>8} {'ratio':>7} {'x real time':>12}")
    for row in rows:
        print(
            f"{row['what']:42} {row['us_per_step']:8.3f} {row['fastest']:8.3f}"
            f" {row['times_the_kernel']:7.1f} {row['real_time_factor']:12.1f}"
        )


if __name__ == "__main__":
    main()
