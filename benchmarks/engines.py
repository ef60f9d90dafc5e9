"""The same robot in three engines: our compiled kernel, MuJoCo's rollout, Pinocchio's ABA.

    python -m benchmarks.engines [--rounds 5] [--mjx] [--json]

One thread each, and each at the physics rate of our kernel; MuJoCo also at higher ones, since its
semi-implicit Euler needs shorter steps to be as exact. Under the same forces its worst objective is
off by 2.6 % at 2.5 kHz, 0.7 % at 10 kHz and 0.14 % at 40 kHz, ours by 0.07 % at 2.5 kHz
(`python -m benchmarks.step_accuracy`). The contestants take turns, so that a busy machine slows all
of them alike; medians are compared. Two figures are not one:

    throughput   many walks at once: wall time over all walkers' steps. What a search needs.
    latency      one simulation alone: wall time over its steps.

What they compute is not the same either, and each row says it: the kernel walks, with control,
battery, ground and objectives; MuJoCo rolls out logged motor voltages, with its own contacts or in
free flight; Pinocchio computes accelerations only. MuJoCo and Pinocchio step one robot at a time,
so that on one core both figures are the same.

In one row the motors are MuJoCo's as well, its `dcmotor` with resistance, inductance, back-EMF and
friction: an independent implementation, which must draw the energy of ours within 1 %. `--mjx` adds
MuJoCo's steps in JAX (`pip install mujoco-mjx`; minutes to compile), with all cores and in single
precision.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Final

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from benchmarks.physics import ROBOT, pinocchio_aba
from gaitswarm.sim.assembly import PHYSICS_RATE, control_steps, plan_walk
from gaitswarm.sim.compiler.compilation import Target, target
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import load_kernel
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.mujoco.mjcf import Rig, Surroundings, mjcf
from gaitswarm.sim.mujoco.model import Feet, even_drags, with_contacts
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate

SCENARIO = SCENARIOS[0]
PRECISIONS: Final[tuple[Precision, ...]] = ("double", "single")
AVX2: Final = Target(4, "x86-64-v3")
MUJOCO_RATES: Final = (PHYSICS_RATE, 2 * PHYSICS_RATE, 4 * PHYSICS_RATE)
"""Steps a second [Hz] of MuJoCo with its own contacts."""
WALKERS: Final = 64
"""Walks at once: lanes of every kernel are full."""
MJX_TICKS: Final = 20
"""Control ticks of a walk in MJX."""


def stiff_walk() -> WalkLog:
    """A walk whose voltages are played back."""
    designs = np.array([[0.45, 0.0]])
    (log,) = simulate(SCENARIO, "pi", ["P", "I"], designs, robot=ROBOT, log=True).logs
    assert log is not None
    return log


def mujoco_walk(
    log: WalkLog, *, contacts: bool, rate: int, dc_motors: bool = False
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The robot at the walk's start, with motors as affine actuators or as MuJoCo's `dcmotor`."""
    robot = load_robot(ROBOT)
    surroundings = Surroundings.of(robot, SCENARIO)
    rig = Rig(timestep=1.0 / rate, voltage_motors=True)
    if contacts:
        drags = even_drags(robot, surroundings, SCENARIO.duty_factor * len(robot.legs))
        rig = with_contacts(robot, surroundings, rig, Feet(drags))
    spec, a = mujoco.MjSpec.from_string(mjcf(robot, surroundings, rig)), robot.actuators()
    if dc_motors:
        numbers = (robot.joint_names, a.torque, a.resistance, a.inductance, a.viscous)
        for motor, joint, k, r, inductance, friction in zip(spec.actuators, *numbers, strict=True):
            motor.gainprm[:], motor.biasprm[:] = 0.0, 0.0
            motor.set_to_dcmotor([k, k], r, inductance=[inductance, 0.0])
            spec.joint(joint).damping[0] = friction
    m = spec.compile()
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    d = mujoco.MjData(m)
    d.qpos[:] = np.concatenate(
        [log.base_position[0], log.base_orientation[0, [3, 0, 1, 2]], log.joint_angle[0]]
    )
    return m, d


def mujoco_rollout(
    log: WalkLog, *, contacts: bool, rate: int, dc_motors: bool = False
) -> Callable[[], float]:
    """A whole walk in `mujoco.rollout`; us a step."""
    m, d = mujoco_walk(log, contacts=contacts, rate=rate, dc_motors=dc_motors)
    substeps = round(CONTROL_PERIOD * rate)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty((1, mujoco.mj_stateSize(m, kind)))
    mujoco.mj_getState(m, d, start[0], kind)
    voltage = np.repeat(log.voltage, substeps, axis=0)[None]
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
        if dc_motors:
            currents = states[0, :, -m.na :]
            energy, ours = (voltage[0] * currents).sum() / rate, (log.voltage * log.current).sum()
            assert abs(energy / (ours * CONTROL_PERIOD) - 1.0) < 0.01
        return elapsed / len(log.time) / substeps * 1e6

    return run


def mjx_steps(log: WalkLog) -> Callable[[], float]:
    """The beginning of the walk in MJX, with its own contacts; us a step and walker."""
    jax, mjx = import_module("jax"), import_module("mujoco.mjx")
    m, d = mujoco_walk(log, contacts=True, rate=PHYSICS_RATE)
    here, begun = mjx.put_model(m), mjx.put_data(m, d)
    substeps = round(CONTROL_PERIOD * PHYSICS_RATE)
    voltage = np.repeat(log.voltage[:MJX_TICKS], substeps, axis=0)

    def walk(start: Any) -> Any:
        def step(data: Any, ctrl: Any) -> tuple[Any, None]:
            return mjx.step(here, data.replace(ctrl=ctrl)), None

        return jax.lax.scan(step, begun.replace(qpos=start), voltage)[0].qpos

    walks, starts = jax.jit(jax.vmap(walk)), jax.numpy.tile(begun.qpos, (WALKERS, 1))
    walks(starts).block_until_ready()

    def run() -> float:
        before = time.perf_counter()
        walks(starts).block_until_ready()
        return (time.perf_counter() - before) / (WALKERS * len(voltage)) * 1e6

    return run


@dataclass(frozen=True)
class Contestant:
    """What is timed: us a step and walker; figure is throughput or latency; rate in Hz."""

    name: str
    figure: str
    computes: str
    run: Callable[[], float]
    rate: int = PHYSICS_RATE


def kernel(precision: Precision, wanted: Target | None, walkers: int) -> Callable[[], float]:
    """Whole walks in our kernel, as compiled for a target; us a step and walker."""
    robot = load_robot(ROBOT)
    coding, timestep = control_steps(robot)
    plan = plan_walk(robot, SCENARIO, timestep)
    compiled = load_kernel(robot, precision, compile_for=wanted)
    assert plan is not None
    assert compiled is not None
    law = CONTROLLERS["fuzzy-pi"].compile(CONTROLLERS["fuzzy-pi"].published["A"])
    setups = [plan(law)] * walkers
    steps = walkers * setups[0].ticks * coding.substeps

    def run() -> float:
        before = time.perf_counter()
        compiled.walk(setups, coding, log=False)
        return (time.perf_counter() - before) / steps * 1e6

    return run


def contestants_here(*, mjx: bool) -> list[Contestant]:
    """All that this machine can run; the first is what ratios are of."""
    log = stiff_walk()
    walk = "whole walks: control, motors, ground, objectives"
    targets: dict[str, Target] = {target().level or "plain": target()}
    if target().lanes > AVX2.lanes:
        targets[AVX2.level] = AVX2
    kernels = [
        Contestant(
            f"kernel, {level}, {precision}",
            figure,
            walk,
            kernel(precision, wanted, 1 if figure == "latency" else WALKERS),
        )
        for level, wanted in targets.items()
        for precision in PRECISIONS
        for figure in ("throughput", "latency")
    ]
    ways = [("its own contacts", True, rate) for rate in MUJOCO_RATES]
    rollouts = [
        Contestant(
            f"mujoco.rollout, {name}, {rate / 1e3:g} kHz",
            "both",
            f"dynamics under logged voltages, {name}",
            mujoco_rollout(log, contacts=contacts, rate=rate),
            rate,
        )
        for name, contacts, rate in [*ways, ("free flight", False, PHYSICS_RATE)]
    ]
    motors = Contestant(
        f"mujoco.rollout, dcmotor, {PHYSICS_RATE / 1e3:g} kHz",
        "both",
        "dynamics and motors under logged voltages, its own contacts",
        mujoco_rollout(log, contacts=True, rate=PHYSICS_RATE, dc_motors=True),
    )
    aba = Contestant("pinocchio.aba, from Python", "both", "accelerations only", pinocchio_aba())
    contestants = [*kernels, *rollouts, motors, aba]
    if mjx:
        steps = "dynamics under logged voltages, its own contacts, single precision"
        contestants.append(Contestant("mjx on the CPU", "throughput", steps, mjx_steps(log)))
    return contestants


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--mjx", action="store_true", help="also time MuJoCo in JAX")
    options = parser.parse_args()
    mjx = options.mjx and find_spec("mujoco.mjx") is not None
    if options.mjx and not mjx:
        print("MJX is left out: pip install mujoco-mjx", file=sys.stderr)
    runs = contestants_here(mjx=mjx)
    seen: dict[int, list[float]] = {k: [] for k in range(len(runs))}
    for _ in range(options.rounds):
        for k, contestant in enumerate(runs):
            seen[k].append(contestant.run())
    medians = [statistics.median(values) for values in seen.values()]
    rows = [
        {
            "what": contestant.name,
            "figure": contestant.figure,
            "computes": contestant.computes,
            "us_per_step": median,
            "fastest": min(seen[k]),
            "rate": contestant.rate,
            "times_the_kernel": median * contestant.rate / (medians[0] * runs[0].rate),
            "real_time_factor": 1e6 / contestant.rate / median,
        }
        for k, (contestant, median) in enumerate(zip(runs, medians, strict=True))
    ]
    if options.json:
        print(json.dumps({"mujoco": mujoco.__version__, "rows": rows}, indent=2))
        return
    print(f"{'':41} {'figure':10} {'us/step':>8} {'fastest':>8} {'ratio':>7} {'x real time':>12}")
    for row in rows:
        print(
            f"{row['what']:41} {row['figure']:10} {row['us_per_step']:8.3f} {row['fastest']:8.3f}"
            f" {row['times_the_kernel']:7.1f} {row['real_time_factor']:12.1f}  {row['computes']}"
        )


if __name__ == "__main__":
    main()
