"""Named drives compared in the same scenarios."""

from __future__ import annotations

import pytest

from gaitswarm.sim.assembly import PHYSICS_RATE, plan_walk
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.drives import DRIVES, compare, drive_of_design, find_drive, walk_figures
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.walk import Coding
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.walks import PUBLISHED_A

pytestmark = pytest.mark.slow

BRIEF = SCENARIOS[0].model_copy(update={"cycles": 1.0, "cycle_time": 0.5})


def test_figures_of_a_drive_are_those_of_its_objectives() -> None:
    figures = walk_figures(find_drive("pi"), SCENARIOS[0])
    assert figures.status is Status.OK
    energy, pace = figures.objectives["energy"], figures.objectives["reciprocal_speed"]
    assert energy is not None
    assert pace is not None
    assert figures.speed == pytest.approx(1.0 / pace)
    assert figures.power == pytest.approx(energy / pace)
    assert figures.effectivity == pytest.approx(1.0 / energy)


def test_the_steps_of_2011_shake_the_body() -> None:
    old = find_drive("2011")
    smooth = drive_of_design("smooth", "p", {**old.design, "trajectory_rate": 500.0})
    # On the dampers of table 2.7 touch-downs shake it as well, whatever the drive.
    rough, calm = (walk_figures(drive, SCENARIOS[0], robot="szabadka2") for drive in (old, smooth))
    assert rough.objectives["angular_acceleration"] > 2.0 * calm.objectives["angular_acceleration"]  # type: ignore[operator]


def test_every_named_drive_is_compared_in_every_scenario() -> None:
    figures = compare(list(DRIVES.values()), [BRIEF, SCENARIOS[0]])
    assert [(f.scenario, f.drive) for f in figures] == [
        (scenario, drive) for scenario in ("normal-fast", "normal-fast") for drive in DRIVES
    ]


def test_an_unknown_drive_is_answered_with_those_that_exist() -> None:
    with pytest.raises(SimulationInputError, match="unknown '2012'; known are 2011, 2016"):
        find_drive("2012")


def test_an_inference_is_refused_by_the_compiled_kernel() -> None:
    robot = load_robot("szabadka2")
    kernel = native_kernel(robot)
    assert kernel is not None
    plan = plan_walk(robot, BRIEF, 1.0 / PHYSICS_RATE)
    assert plan is not None
    with pytest.raises(SimulationInputError, match="backend='reference'"):
        kernel.walk([plan(FuzzyPi().without_table(PUBLISHED_A))], Coding.of(robot, 10), log=False)
