"""Walks and tables in a process that loads libraries built with sanitizers."""

from __future__ import annotations

import ctypes
import dataclasses
import hashlib
import itertools
import os
import struct
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.base import JointPd
from gaitswarm.sim.controllers.fuzzy_pi import CURRENT, ERROR, inference_system
from gaitswarm.sim.controllers.mamdani import Shape
from gaitswarm.sim.controllers.quantisation import compiled_table
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import NativeKernel
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.walks import torque_quadruped_files

ROBOTS = {
    "plain": load_robot("szabadka2"),
    "karnopp": load_robot(RobotVariant(contact_law="karnopp")),
    "dead zone": load_robot(RobotVariant(contact_law="dead_zone")),
    "all internal state": load_robot(RobotVariant(contact_law="stick", backlash=(2.5, 1.0, 1.0))),
    "torque": load_robot(torque_quadruped_files()),
}
"""One of every law of friction, one with backlash, and one with torque-controlled actuators."""

Kind = tuple[str, Precision]
"""A robot's name among `ROBOTS`, and the precision of its kernel."""


def digest_of_walks(
    kernel: NativeKernel,
    robot: Robot,
    *,
    logs: Sequence[bool] = (True, False),
    scenarios: Sequence[Scenario] = SCENARIOS,
) -> str:
    """Published optimum A in some scenarios, with a fall and a divergence, an uneven number."""
    law = CONTROLLERS["fuzzy-pi"].compile(CONTROLLERS["fuzzy-pi"].published["A"])
    if robot.is_torque_controlled:
        law = dataclasses.replace(law, joint_pd=JointPd(40.0, 1.0, 0.8))
    coding, timestep = control_steps(robot)
    setups = []
    for number, scenario in enumerate(scenarios):
        brief = scenario.model_copy(update={"cycles": 1.0, "cycle_time": 0.3 + 0.05 * number})
        plan = plan_walk(robot, brief, timestep)
        assert plan is not None
        setups.append(plan(law))
    disturbance = np.random.default_rng(3).normal(size=setups[0].desired.shape)
    setups.append(dataclasses.replace(setups[0], disturbance=disturbance))
    for stiffness in (0.0, 1e12):
        parameters = setups[0].parameters.copy()
        parameters[kernel.layout.slices["stiffness"]] = stiffness
        parameters[kernel.layout.slices["damping"]] = 0.0
        setups.append(dataclasses.replace(setups[0], parameters=parameters))
    digest = hashlib.sha256()
    statuses = set()
    for log in logs:
        for result in kernel.walk(setups, coding, log=log):
            statuses.add(result.status)
            states = np.empty(0) if result.states is None else result.states
            for array in (result.sums, result.end, result.peaks, states):
                # What sign a NaN has is the compiler's choice.
                digest.update(np.where(np.isnan(array), np.nan, array).tobytes())
    assert statuses == {Status.OK, Status.FELL, Status.DIVERGED}
    return digest.hexdigest()


def digest_of_odd_batches(kernel: NativeKernel, robot: Robot) -> str:
    """Every control law, and NaN in all that can hold one, in batches that leave lanes empty."""
    coding, timestep = control_steps(robot)
    plan = plan_walk(robot, SCENARIOS[0].model_copy(update=BRIEFEST), timestep)
    assert plan is not None
    setups = [
        plan(controller.compile(design))
        for controller in CONTROLLERS.values()
        for design in controller.published.values()
    ]
    usual = setups[0]
    nowhere = np.full(usual.desired.shape, np.nan)
    late = np.where(np.arange(usual.ticks)[:, np.newaxis] < usual.ticks // 2, 0.0, nowhere)
    unknown = [
        dataclasses.replace(usual, start=np.full_like(usual.start, np.nan)),
        dataclasses.replace(usual, parameters=np.full_like(usual.parameters, np.nan)),
        dataclasses.replace(usual, internal_state=np.full_like(usual.internal_state, np.nan)),
        dataclasses.replace(usual, disturbance=late),
        dataclasses.replace(usual, desired=np.full_like(usual.desired, np.iinfo(np.int32).min)),
    ]
    mixed = [setup for pair in zip(setups, unknown, strict=False) for setup in pair]
    digest = hashlib.sha256()

    def walked(size: int, *, log: bool) -> list[bytes]:
        results = kernel.walk(list(itertools.islice(itertools.cycle(mixed), size)), coding, log=log)
        return [
            bytes([result.status]) + np.where(np.isnan(result.end), np.nan, result.end).tobytes()
            for result in results
        ]

    for size in (0, 1, kernel.lanes - 1, kernel.lanes + 3):
        batch = walked(size, log=size % 2 == 1)
        assert len(batch) == size
        digest.update(b"".join(batch))
    # A thread that takes over a walk must not use the memory of its call after that has ended. With
    # backlash a walk has sixteen times as many steps.
    with ThreadPoolExecutor(4) as pool:
        calls = [
            pool.submit(walked, 2 * kernel.lanes + n % 3, log=False)
            for n in range(4 if robot.has_backlash else 8)
        ]
        for call in calls:
            digest.update(b"".join(call.result()))
    statuses = [r.status for r in kernel.walk(unknown, coding, log=False)]
    assert {statuses[0], statuses[1], statuses[3]} == {Status.DIVERGED}
    return digest.hexdigest()


def digests(kernel: NativeKernel, robot: Robot) -> str:
    """Of walks and of odd batches: what is compared with a build with sanitizers."""
    scenarios = SCENARIOS[: 1 if robot.has_backlash else 6]
    walks = digest_of_walks(kernel, robot, scenarios=scenarios)
    return walks + digest_of_odd_batches(kernel, robot)


BRIEFEST = {"cycles": 1.0, "cycle_time": 0.2}
"""Changes of a scenario that leave a hundred control ticks."""


def sanitized_walks(kinds: Sequence[Kind]) -> str:
    """Digests of kernels, of a library each."""
    found = []
    for (name, precision), library in zip(kinds, _sanitized_libraries(), strict=True):
        kernel = NativeKernel(ROBOTS[name], library)
        assert kernel.precision == precision
        found.append(digests(kernel, ROBOTS[name]))
    return "\n".join(found)


def digest_of_tables(library: ctypes.CDLL | None) -> str:
    """Tables that are estimated mostly, and one of which every cell is summed."""
    digest = hashlib.sha256()
    grid = {"error": ERROR.grid(), "current": CURRENT.grid()}
    for weights in ((0.187, 0.961, 0.789, 0.927), (0.0, 0.9, 0.0, 0.0)):
        table = compiled_table(inference_system(*weights, Shape.GAUSS), grid, library=library)
        assert table is not None
        digest.update(table[0].tobytes() + struct.pack("d", table[1]))
    return digest.hexdigest()


def sanitized_tables() -> str:
    (library,) = _sanitized_libraries()
    return digest_of_tables(library)


def _sanitized_libraries() -> list[ctypes.CDLL]:
    assert "LD_PRELOAD" not in os.environ or hasattr(ctypes.CDLL(None), "__asan_init")
    return [ctypes.CDLL(path) for path in os.environ["LIBRARIES"].split(os.pathsep)]
