"""Noise on the angle between gearheads and links, through shafts that yield (table 2.9)."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.sim.assembly import plan_walk
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.parameters import pack_parameters
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot, with_shafts
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.walks import short_walk, walk

PI = {"P": 0.45, "I": 0.1}
BRIEF = short_walk(cycle_time=0.25)


@pytest.fixture(scope="module")
def elastic() -> Robot:
    return with_shafts(load_robot("szabadka2"))


def noise_on(link: int, deviation: float = 0.001) -> LinkNoise:
    return LinkNoise.model_validate({"link": link, "deviation": deviation, "kind": "angle"})


def test_shafts_of_a_robot_without_play_yield(elastic: Robot) -> None:
    assert elastic.has_backlash
    assert not elastic.actuators().backlash.any()
    assert with_shafts(elastic) is elastic
    rigid, yielding = (
        walk(BRIEF, PI, "pi", robot=robot).outcome.objectives[0]
        for robot in (load_robot("szabadka2"), elastic)
    )
    assert (rigid != yielding).all()
    np.testing.assert_allclose(rigid[[0, 3, 4]], yielding[[0, 3, 4]], rtol=0.1)


@pytest.mark.parametrize("displaced", [False, True])
def test_a_displaced_angle_is_a_turn_of_the_gearhead_against_its_shaft(
    elastic: Robot, displaced: bool
) -> None:
    rng = np.random.default_rng(3)
    angles = np.tile([0.0, -0.2, -1.6], 6)
    ahead, disturbance = rng.normal(scale=0.01, size=(2, 18))
    q, v = np.concatenate([[0, 0, 1.0, 0, 0, 0, 1], angles]), np.zeros(24)
    motors = np.concatenate([angles + ahead, np.zeros(18)])
    p = pack_parameters(elastic, SCENARIOS[0], 5e-5, displaced=displaced)
    observed = physics_model(elastic).observe(q, v, motors, np.zeros(18), disturbance, p)
    stiffness = elastic.actuators().shaft_stiffness
    turned = stiffness * (ahead + disturbance)
    expected = turned if displaced else stiffness * ahead + disturbance
    np.testing.assert_allclose(np.array(observed[2]).ravel(), expected, rtol=1e-9)


@pytest.mark.thorough("test_compiled_and_readable_kernel_agree, with noise")
@pytest.mark.variants
@pytest.mark.parametrize("link", [1, 2, 3])
def test_kernels_agree_on_noisy_angles_which_cost_torque(link: int, elastic: Robot) -> None:
    noise = noise_on(link)
    fast, slow = (
        walk(BRIEF, PI, "pi", robot="szabadka2", noise=noise, backend=backend).outcome.objectives[0]
        for backend in ("native", "reference")
    )
    np.testing.assert_allclose(fast, slow, rtol=1e-6)
    calm = walk(BRIEF, PI, "pi", robot=elastic).outcome.objectives[0]
    assert (fast[:3] > calm[:3]).all()


def test_an_angle_cannot_be_displaced_without_shafts_that_yield() -> None:
    with pytest.raises(SimulationInputError, match="elastic_shafts"):
        plan_walk(load_robot("szabadka2"), BRIEF, 2e-4, noise_on(1))


def test_a_torque_that_is_meant_as_an_angle_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"10 rad is more than 0\.5 rad"):
        noise_on(1, 10.0)
