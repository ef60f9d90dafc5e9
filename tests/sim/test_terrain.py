"""Ground that is not flat: heights, contact, statuses and worlds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.replay import ReplayRequest, run_replay
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.assembly import control_steps, kernel_of, plan_walk
from gaitswarm.sim.compiler.compilation import X86, Target, host_architecture, target
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.native import load_kernel
from gaitswarm.sim.kernel.parameters import pack_parameters
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotVariant, load_robot
from gaitswarm.sim.robot.shapes import body_corners
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.terrain import Grid, Rough, Stairs, Steps, height_grid
from gaitswarm.sim.worlds.walks import PerturbedWalk, WorldWalk
from tests.examples.walks import PUBLISHED_A, short_walk, walk

ROUGH = {"kind": "rough", "amplitude": 0.01}
STAIRS = {"kind": "stairs", "height": 0.02, "start": 0.2}
BRIEF = {"cycle_time": 0.4}


def on(terrain: dict[str, Any], **changes: object) -> Scenario:
    return short_walk(terrain=terrain, **changes)


def rough_worlds() -> WorldWalk:
    names = ("roughness", "world_seed")
    return WorldWalk(DEFAULT_ROBOT, "fuzzy-pi", tuple(PUBLISHED_A.items()), short_walk(), names)


def level(height: float) -> dict[str, Any]:
    return {"kind": "grid", "cell": 1.0, "heights": [[height] * 2] * 2}


def test_heights_between_measured_ones_are_bilinear_and_go_on_beyond_the_edge() -> None:
    ground = height_grid(Grid(kind="grid", cell=0.5, heights=((0.0, 1.0), (2.0, 5.0), (2.0, 2.0))))
    assert ground is not None
    x, y = np.array([-0.5, -0.5, -0.25, 0.5, 9.0]), np.array([-0.25, 0.25, 0.0, 0.0, 0.0])
    height, along, across = ground.under(x, y)
    assert height.tolist() == [0.0, 1.0, 2.0, 2.0, 2.0]
    assert along[2:].tolist() == [6.0, -3.0, 0.0] and across[2] == 4.0


def test_rough_ground_is_random_bounded_smooth_and_repeats() -> None:
    ground = height_grid(Rough(kind="rough", amplitude=0.01, correlation_length=0.1))
    assert ground is not None
    x, y = np.meshgrid(np.linspace(0.0, 6.4, 321), np.linspace(-3.2, 3.2, 321))
    heights, along, _ = ground.under(x, y)
    assert np.abs(heights).max() == pytest.approx(0.01, rel=1e-2)
    assert 0.002 < heights.std() < 0.005 and abs(heights.mean()) < 2e-4
    assert 0.02 < along.std() < 0.1
    np.testing.assert_allclose(ground.height(x + 6.4, y - 12.8), heights, atol=1e-12)
    far = ground.height(x + 0.3, y)
    assert abs(np.corrcoef(heights.ravel(), far.ravel())[0, 1]) < 0.1
    other = height_grid(Rough(kind="rough", amplitude=0.01, seed=2))
    assert other is not None and abs(other.height(x, y) - heights).max() > 0.01


def test_steps_rise_and_fall_where_stairs_go_on_rising() -> None:
    places = np.array([0.29, 0.4, 0.65, 0.9])
    for kind, levels in ((Steps, [0, 1, 0, 1]), (Stairs, [0, 1, 2, 3])):
        ground = height_grid(kind(kind=kind.__name__.lower(), height=0.02))
        assert ground is not None
        np.testing.assert_allclose(ground.height(places, 0.0 * places), 0.02 * np.array(levels))


@pytest.mark.variants
@pytest.mark.parametrize("variant", [{}, {"contact_law": "stick"}, {"contact_law": "karnopp"}])
def test_a_foot_at_rest_is_pressed_along_the_normal_of_its_ground(variant: dict[str, Any]) -> None:
    robot = load_robot(RobotVariant(**variant))
    model, scenario = physics_model(robot, uneven=True), SCENARIOS[0]
    plan = plan_walk(robot, scenario, 4e-4)
    assert plan is not None
    setup = plan(control_law("pi", (("P", 0.4), ("I", 0.0))))
    n, legs = robot.n_joints, len(robot.legs)
    along, across, p = 0.3, -0.2, pack_parameters(robot, scenario, 0.0)
    foot_z = np.asarray(model.places(setup.start)).reshape(legs, 6)[:, 2]
    patches = np.array([[z - 0.008, along, across] for z in foot_z])
    still = [np.zeros(6 + n), setup.internal_state, np.zeros(n), np.zeros(n), p]
    force = np.asarray(model.observe(setup.start, *still, patches.ravel())[3]).reshape(legs, 3)
    normal = np.array([-along, -across, 1.0]) / np.sqrt(1.0 + along**2 + across**2)
    contacts = robot.contacts()
    pressed = [c.stiffness * max(c.sole - 0.008 * normal[2], 0.0) for c in contacts]
    np.testing.assert_allclose(force, np.outer(pressed, normal), rtol=1e-9, atol=1e-12)


def test_ground_that_is_level_at_any_height_is_flat_ground() -> None:
    flat, raised = walk(short_walk()).outcome, walk(on(level(-0.2))).outcome
    assert raised.statuses[0] == Status.OK
    np.testing.assert_allclose(raised.objectives, flat.objectives, rtol=1e-4)


@pytest.mark.variants("rough")
@pytest.mark.parametrize("terrain", [ROUGH, STAIRS], ids=["rough", "stairs"])
def test_the_compiled_kernel_walks_as_the_reference_does(terrain: dict[str, Any]) -> None:
    native, reference = (
        walk(on(terrain, **BRIEF), backend=backend, log=True) for backend in ("native", "reference")
    )
    np.testing.assert_allclose(
        native.outcome.objectives, reference.outcome.objectives, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(
        native.measurements.array(), reference.measurements.array(), rtol=1e-9
    )
    ours, theirs = native.logs[0], reference.logs[0]
    assert ours is not None and theirs is not None
    np.testing.assert_allclose(ours.foot_force, theirs.foot_force, atol=1e-6)
    flat = walk(short_walk(**BRIEF)).outcome.objectives
    assert np.abs(native.outcome.objectives / flat - 1.0)[0, :5].max() > 0.005


def test_a_walk_on_rough_ground_has_the_same_bits_in_any_company() -> None:
    case, worlds = rough_worlds(), np.array([[0.01, k] for k in range(11)])
    together = case.run(worlds)
    for k in (0, 3, 10):
        assert case.run(worlds[k : k + 1]).objectives.tobytes() == together.objectives[k].tobytes()
    assert len(set(together.objectives[:, 0].tolist())) == len(worlds)


@pytest.mark.variants("Target(lanes=4,*double")
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("narrower", [Target(4, "x86-64-v3"), Target(2)], ids=str)
def test_rough_ground_has_the_same_bits_at_every_vector_width(
    narrower: Target, precision: Precision
) -> None:
    if host_architecture() != X86 or target().lanes < narrower.lanes:
        narrower = target()
    robot = load_robot(DEFAULT_ROBOT)
    narrow = load_kernel(robot, precision, compile_for=narrower, uneven=True)
    assert narrow is not None
    case = replace(rough_worlds(), precision=precision)
    worlds = np.array([[0.02, k] for k in range(5)])
    wide, thin = case.simulate(worlds), case.simulate(worlds, kernel=narrow)
    assert wide.outcome.objectives.tobytes() == thin.outcome.objectives.tobytes()
    assert wide.measurements.array().tobytes() == thin.measurements.array().tobytes()


def test_single_precision_is_close_to_double() -> None:
    single, double = (
        walk(on(ROUGH), precision=precision).outcome.objectives[0, :5]
        for precision in ("single", "double")
    )
    np.testing.assert_allclose(single, double, rtol=0.01)


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_a_body_on_a_stone_has_struck_the_ground(backend: Any) -> None:
    x, y, _ = body_corners(load_robot(DEFAULT_ROBOT))[3]
    heights = np.zeros((41, 41))
    heights[20 + round(x / 0.01), 20 + round(y / 0.01)] = 0.15
    stone = {"kind": "grid", "cell": 0.01, "heights": heights.tolist()}
    found = walk(on(stone, **BRIEF), backend=backend)
    assert found.outcome.statuses.tolist() == [Status.STRUCK]
    assert np.isnan(found.outcome.objectives).all()


def test_a_robot_begins_on_the_highest_stones() -> None:
    robot = load_robot(DEFAULT_ROBOT)
    (flat, high) = (
        plan_walk(robot, scenario, control_steps(robot)[1])
        for scenario in (short_walk(), on(level(0.03)))
    )
    assert flat is not None and high is not None
    law = control_law("pi", (("P", 0.4), ("I", 0.0)))
    assert high(law).start[2] - flat(law).start[2] == pytest.approx(0.03, abs=1e-12)


def test_a_world_without_roughness_has_the_bits_of_the_model() -> None:
    case = WorldWalk(
        DEFAULT_ROBOT, "fuzzy-pi", tuple(PUBLISHED_A.items()), short_walk(), ("roughness",)
    )
    flat, rough = case.run(np.array([[0.0], [0.01]])).objectives
    assert flat.tobytes() == walk(short_walk()).outcome.objectives[0].tobytes()
    assert not np.array_equal(flat, rough)
    same = walk(on({"kind": "rough", "amplitude": 0.01})).outcome.objectives[0]
    assert rough.tobytes() == same.tobytes()


def test_designs_in_a_rough_world_have_the_bits_of_worlds_of_a_design() -> None:
    world = (("roughness", 0.01), ("world_seed", 7.0))
    names = tuple(name for name, _ in world)
    of_worlds = WorldWalk(
        DEFAULT_ROBOT, "fuzzy-pi", tuple(PUBLISHED_A.items()), short_walk(), names
    ).run(np.array([[value for _, value in world]]))
    of_designs = PerturbedWalk(
        "any", DEFAULT_ROBOT, "fuzzy-pi", short_walk(), world, tuple(PUBLISHED_A)
    ).run(np.array([list(PUBLISHED_A.values())]))
    assert of_designs.objectives.tobytes() == of_worlds.objectives.tobytes()


def test_worlds_do_not_roughen_stairs() -> None:
    case = WorldWalk(
        DEFAULT_ROBOT, "fuzzy-pi", tuple(PUBLISHED_A.items()), on(STAIRS), ("roughness",)
    )
    with pytest.raises(SimulationInputError, match=r"roughness: .* kind stairs"):
        case.run(np.array([[0.01]]))


def test_jobs_do_not_roughen_stairs() -> None:
    stairs = {**on(STAIRS).model_dump()}
    worlds = {"count": 2, "ranges": ["roughness"]}
    spec = JobSpec.model_validate({"controller": "pi", "scenarios": [stairs], "worlds": worlds})
    with pytest.raises(InvalidRequest, match=r"roughness: .* kind stairs"):
        spec.check_can_be_simulated()


def test_a_simulation_or_replay_in_a_world_does_not_roughen_stairs() -> None:
    asked = {"controller": "fuzzy-pi", "design": PUBLISHED_A, "world": {"roughness": 0.01}}
    scenario = on(STAIRS).model_dump()
    several = SimulationRequest.model_validate(asked | {"scenarios": [scenario]})
    single = ReplayRequest.model_validate(asked | {"scenario": scenario})
    with pytest.raises(InvalidRequest, match=r"roughness: .* kind stairs") as refused:
        several.check_walks()
    assert refused.value.field == "world"
    with pytest.raises(InvalidRequest, match=r"roughness: .* kind stairs") as refused:
        run_replay(single)
    assert refused.value.field == "world"


@pytest.mark.parametrize(
    ("terrain", "message"),
    [
        ({"kind": "rough", "amplitude": -1.0}, "amplitude"),
        ({"kind": "sand"}, "kind"),
        ({"kind": "grid", "cell": 0.1, "heights": [[0, 1], [0]]}, "heights: rows"),
        ({"kind": "grid", "cell": 0.1, "heights": [[0] * 201] * 200}, "larger cells"),
    ],
)
def test_a_wrong_terrain_is_named(terrain: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        on(terrain)


def test_flat_ground_shares_the_kernel_without_terrain() -> None:
    robot = load_robot(DEFAULT_ROBOT)
    assert kernel_of(robot) is kernel_of(robot, uneven=False)
    assert kernel_of(robot) is not kernel_of(robot, uneven=True)
