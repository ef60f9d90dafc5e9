"""Mishaps, worlds, falls and abandoned walks in MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers import ControllerName, control_law
from gaitswarm.sim.kernel.parameters import Layout
from gaitswarm.sim.kernel.walk import WalkSetup
from gaitswarm.sim.mujoco.kernel import MujocoKernel, WalkStopped
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.worlds.perturbations import DRAWN, sample_worlds
from gaitswarm.sim.worlds.walks import EngineWalk, WorldWalk
from tests.examples.walks import UPHILL_WALK

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
STEP = Scenario(name="step", cycle_time=0.7, radius=0.16, hip_height=0.15, cycles=1)
MISHAPS: Mapping[str, Mapping[str, Any]] = {
    "backward": {"direction": "backward"},
    "a shove": {"shove": 3.0, "shove_direction": 90.0, "shove_at": 0.5},
    "a jammed leg": {"stuck_leg": "left_middle"},
    "a drop": {"drop": 0.02},
}


def world_walk(scenario: Scenario, controller: ControllerName = "pi") -> WorldWalk:
    names = tuple(variable.name for variable in DRAWN)
    return WorldWalk("szabadka2", controller, tuple(PI.items()), scenario, names)


def rows(worlds: np.ndarray, *engines: float) -> np.ndarray:
    """Each world once in each engine."""
    return np.array([[*world, engine] for world in worlds.tolist() for engine in engines])


NOMINAL = np.array([[variable.default for variable in DRAWN]], dtype=np.float64)


@pytest.mark.variants
@pytest.mark.parametrize("mishap", MISHAPS)
def test_mishaps_act_in_mujoco_as_in_the_kernel(mishap: str) -> None:
    walk = world_walk(STEP.model_copy(update=MISHAPS[mishap]))
    found = EngineWalk(walk, len(DRAWN)).run(rows(NOMINAL, 0, 1))
    calm = world_walk(STEP).run(NOMINAL).objectives[0]
    ours, mujocos = found.objectives
    assert found.statuses.tolist() == [Status.OK, Status.OK]
    apart = np.abs(mujocos[:5] / ours[:5] - 1.0).max()
    assert apart < 0.02
    # It is in both: they are nearer to each other than to a walk without it.
    assert np.abs(ours[:5] / calm[:5] - 1.0).max() > 2.0 * apart


def test_mujoco_measures_a_walk_as_the_kernel_does() -> None:
    case = world_walk(STEP)
    kernel = MujocoKernel(load_robot("szabadka2"))
    ours, mujocos = (case.simulate(NOMINAL, kernel=engine) for engine in (None, kernel))
    np.testing.assert_allclose(mujocos.measurements.array(), ours.measurements.array(), rtol=0.02)


@pytest.mark.thorough("test_mishaps_act_in_mujoco_as_in_the_kernel")
def test_a_world_is_another_one_in_mujoco_too_but_for_our_own_engine_nothing_changes() -> None:
    """All perturbations at once: masses, soles, battery, gears, noise, delays, slope and start."""
    walk, worlds = world_walk(STEP), sample_worlds(2, 3)
    found = EngineWalk(walk, len(DRAWN)).run(rows(worlds, 0, 1))
    ours, mujocos = found.objectives[::2], found.objectives[1::2]
    assert ours.tobytes() == walk.run(worlds).objectives.tobytes()
    np.testing.assert_allclose(mujocos[:, :5], ours[:, :5], rtol=0.03)
    assert np.abs(ours[0, :5] / ours[1, :5] - 1.0).max() > 0.1


def setup_of(scenario: Scenario) -> WalkSetup:
    robot = load_robot("szabadka2")
    plan = plan_walk(robot, scenario, control_steps(robot)[1])
    assert plan is not None
    return plan(control_law("pi", tuple(PI.items())))


def test_a_robot_that_falls_or_diverges_ends_so_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    robot, setup = load_robot("szabadka2"), setup_of(STEP)
    coding, _ = control_steps(robot)
    setup.start.flags.writeable = True
    tipped = np.sin(np.deg2rad(25.0)), np.cos(np.deg2rad(25.0))
    setup.start[[3, 6]] = tipped
    (fell,) = MujocoKernel(robot).walk([setup], coding, log=True)
    assert fell.status is Status.FELL
    assert fell.states is not None and np.isnan(fell.states[-1]).all()
    infinite = setup_of(STEP)
    infinite.parameters.flags.writeable = True
    infinite.parameters[Layout(robot).slices["viscous"]] = -1e6
    with np.errstate(all="ignore"):
        (diverged,) = MujocoKernel(robot).walk([infinite], coding, log=False)
    assert diverged.status is Status.DIVERGED
    assert list(tmp_path.iterdir()) == []


def test_an_abandoned_walk_is_stopped() -> None:
    case = EngineWalk(world_walk(Scenario.model_validate(UPHILL_WALK)), len(DRAWN))
    asked: list[bool] = []

    def should_stop() -> bool:
        asked.append(len(asked) == 2)
        return asked[-1]

    with pytest.raises(WalkStopped):
        case.run_until(rows(NOMINAL, 1), should_stop)
    assert asked == [False, False, True]
