"""Drives side by side, and what the model's simplifications cost."""

from __future__ import annotations

import pytest

from gaitswarm.sim.assembly import PHYSICS_RATE, plan_walk
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.walk import Coding
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotName, load_robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.studies.accuracy import noise_on_links, step_halving, tables_against_inference
from gaitswarm.sim.studies.drives import DRIVES, compare, drive_of_design, find_drive, walk_figures
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


@pytest.mark.thorough("the inference itself walks, which takes the slow kernel")
def test_finer_tables_are_closer_to_the_inference() -> None:
    # Shorter than a cycle, a walk tells more of single steps than of tables.
    cycle = SCENARIOS[0].model_copy(update={"cycles": 1.0})
    coarse, _, fine = tables_against_inference(PUBLISHED_A, [cycle])
    assert (coarse.variant, fine.variant) == ("6x6 bit", "10x6 bit")
    assert fine.relative[:5].max() < 0.02
    assert 0.0 < fine.relative[:5].mean() < coarse.relative[:5].mean() < 0.05


def test_an_inference_is_refused_by_the_compiled_kernel() -> None:
    robot = load_robot("szabadka2")
    kernel = native_kernel(robot)
    assert kernel is not None
    plan = plan_walk(robot, BRIEF, 1.0 / PHYSICS_RATE)
    assert plan is not None
    with pytest.raises(SimulationInputError, match="backend='reference'"):
        kernel.walk([plan(FuzzyPi().without_table(PUBLISHED_A))], Coding.of(robot, 10), log=False)


@pytest.mark.variants
@pytest.mark.parametrize("robot", [DEFAULT_ROBOT, "szabadka2"])
def test_steps_of_walks_are_short_enough(robot: RobotName) -> None:
    """Of a fast and of a slow walk. Landings, which are faster than a step, have shorter ones."""
    walks = [scenario for scenario in SCENARIOS if scenario.name in ("normal-fast", "loaded-slow")]
    found = step_halving("fuzzy-pi", PUBLISHED_A, walks, robot=robot)
    assert [(d.variant, d.scenario) for d in found] == [
        (f"{rate} kHz", scenario.name) for scenario in walks for rate in ("2.5", "5", "10", "20")
    ]
    assert found[0].variant == f"{PHYSICS_RATE / 1000} kHz"
    for deviation in found:
        assert deviation.relative[:5].max() < 0.006


def test_noise_is_reported_for_each_link_against_the_noiseless_walk() -> None:
    found = noise_on_links("pi", {"P": 0.45, "I": 0.1})
    assert [d.variant for d in found] == ["link 1", "link 2", "link 3"]
    # Accelerations grow on every link, as in table 2.9, torque on the first; speed hardly changes.
    for deviation in found:
        assert (deviation.ratio[1:3] > 1.5).all()
        assert deviation.ratio[4] == pytest.approx(1.0, abs=0.15)
    torques = [deviation.ratio[0] for deviation in found]
    assert torques[0] > 1.1
    assert torques == sorted(torques, reverse=True)
