"""Gaits as data: order of footfalls, support, sway, leg groups; and walks in all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.errors import RobotFileError, SimulationInputError
from gaitswarm.sim.gait.curves import foot_curve
from gaitswarm.sim.gait.gaits import GAITS, find_gait, lags_of, leg_gaits, supporting
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.limbs import feet_in_body
from gaitswarm.sim.robot.robot import Robot, leg_groups, parse_robot
from gaitswarm.sim.scenario import GAIT_NAMES, GaitName, Scenario, find_scenario
from tests.examples.walks import logged_walk, quadruped_files, short_walk

CYCLE = np.arange(1000) / 1000 + 0.0005
CRAWL: dict[str, Any] = {"cycle_time": 2.0, "radius": 0.22, "hip_height": 0.16, "stride": 0.08}


@pytest.fixture(scope="module")
def hexapod() -> Robot:
    return load_robot("szabadka2")


@pytest.fixture(scope="module")
def quadruped() -> Robot:
    return load_robot(quadruped_files())


def level(**changes: object) -> Scenario:
    return short_walk(**{"duty_factor": 0.5} | changes)


def standing(robot: Robot, scenario: Scenario) -> dict[str, np.ndarray]:
    """By leg whether it stands, through one cycle."""
    feet = supporting(leg_gaits(robot, scenario), CYCLE)
    return {leg.name: feet[:, k] for k, leg in enumerate(robot.legs)}


def footfalls(robot: Robot, name: GaitName) -> dict[float, set[str]]:
    """Lag -> legs that come down then."""
    lags = [round(lag, 9) for lag in lags_of(find_gait(name), robot.legs)]
    legs = [leg.name for leg in robot.legs]
    return {
        lag: {leg for leg, of in zip(legs, lags, strict=True) if of == lag}
        for lag in sorted(set(lags))
    }


def test_every_name_but_own_is_a_gait() -> None:
    assert ("own", *GAITS) == GAIT_NAMES


@pytest.mark.parametrize(
    ("gait", "expected"),
    [
        ("trot", [{"left_front", "right_rear"}, {"right_front", "left_rear"}]),
        ("pace", [{"left_front", "left_rear"}, {"right_front", "right_rear"}]),
        ("bound", [{"left_rear", "right_rear"}, {"left_front", "right_front"}]),
        ("crawl", [{"left_rear"}, {"left_front"}, {"right_rear"}, {"right_front"}]),
        ("wave", [{"left_rear"}, {"left_front"}, {"right_rear"}, {"right_front"}]),
        ("alternating", [{"left_front", "right_rear"}, {"right_front", "left_rear"}]),
    ],
)
def test_feet_of_a_quadruped_come_down_in_hildebrands_order(
    quadruped: Robot, gait: GaitName, expected: list[set[str]]
) -> None:
    found = footfalls(quadruped, gait)
    assert list(found.values()) == expected
    np.testing.assert_allclose(list(found), np.arange(len(expected)) / len(expected))


def test_feet_of_a_hexapod_come_down_from_hind_to_front(hexapod: Robot) -> None:
    left, right = (
        [f"{side}_{place}" for place in ("rear", "middle", "front")] for side in ("left", "right")
    )
    assert list(footfalls(hexapod, "wave").values()) == [{leg} for leg in (*left, *right)]
    ripple = footfalls(hexapod, "ripple")
    assert [leg for legs in ripple.values() for leg in legs if leg in left] == left
    for lag, legs in ripple.items():
        across = ripple[round((lag + 0.5) % 1.0, 9)]
        assert {leg.replace("left", "right") for leg in legs | across} == {
            leg.replace("left", "right") for leg in across
        }, "the sides are half a cycle apart"
    tripod = list(footfalls(hexapod, "tripod").values())
    assert tripod == [
        {"left_front", "right_middle", "left_rear"},
        {"right_front", "left_middle", "right_rear"},
    ]


@pytest.mark.parametrize(
    ("gait", "duty", "feet"), [("tripod", 0.5, 3), ("ripple", 2 / 3, 4), ("wave", 5 / 6, 5)]
)
def test_as_many_feet_stand_at_any_time_as_the_duty_factor_says(
    hexapod: Robot, gait: str, duty: float, feet: int
) -> None:
    scenario = level(gait=gait, duty_factor=duty)
    assert GAITS[scenario.gait].duty_factor(6) == pytest.approx(duty)
    stood = np.sum(list(standing(hexapod, scenario).values()), axis=0)
    assert set(stood.tolist()) == {feet}


def test_each_foot_stands_for_its_duty_factor_and_lifts_when_it_should(quadruped: Robot) -> None:
    crawl = standing(quadruped, level(gait="crawl", duty_factor=0.75))
    for feet in crawl.values():
        assert feet.mean() == pytest.approx(0.75)
    # The left hind foot comes down when the walk begins, and leaves the ground first.
    assert crawl["left_rear"][0] and not crawl["left_rear"][-1]
    assert not crawl["left_front"][0], "the front foot of a side follows the hind one"


def test_the_tripod_by_name_is_the_thesiss_half_a_cycle_on(hexapod: Robot) -> None:
    own = desired_angles(hexapod, level())
    named = desired_angles(hexapod, level(gait="tripod", start_phase=0.5))
    np.testing.assert_array_equal(named.angles, own.angles)


def test_custom_phases_are_given_by_leg(hexapod: Robot) -> None:
    phases = {leg.name: leg.phase for leg in hexapod.description.legs}
    own = level(phases=phases)
    np.testing.assert_array_equal(
        desired_angles(hexapod, own).angles, desired_angles(hexapod, level()).angles
    )
    other = level(phases=phases | {"left_rear": 0.25})
    assert leg_gaits(hexapod, other)[5].phase == 0.25
    assert hash(own) != hash(other)


@pytest.mark.parametrize(
    ("gait", "said"),
    [
        ("tripod", "tripod is for 6 legs.*choose alternating, wave, trot, pace, bound"),
        ("ripple", "ripple is for 6 or 8 or 10 or 12 legs"),
    ],
)
def test_a_gait_for_another_number_of_legs_is_refused_with_those_that_fit(
    quadruped: Robot, gait: str, said: str
) -> None:
    with pytest.raises(SimulationInputError, match=f"^gait: {said}"):
        require_reachable(quadruped, level(gait=gait))


def test_phases_of_other_legs_than_the_robots_are_refused_with_its_legs(hexapod: Robot) -> None:
    with pytest.raises(SimulationInputError, match=r"^phases: given for FL; .*right_front"):
        desired_angles(hexapod, level(phases={"FL": 0.0}))


def test_two_gaits_at_once_are_refused() -> None:
    with pytest.raises(ValueError, match="phases: the gait wave has its own"):
        level(gait="wave", phases={"a": 0.0, "b": 0.5})


@pytest.mark.parametrize("robot", ["hexapod", "quadruped"])
def test_feet_keep_their_places_on_the_ground_while_the_body_sways(
    robot: str, request: pytest.FixtureRequest
) -> None:
    machine: Robot = request.getfixturevalue(robot)
    posture = CRAWL if robot == "quadruped" else {}
    plain = level(**posture, gait="wave", duty_factor=0.85, fir_ms=0)
    swaying = plain.model_copy(
        update={"sway_lateral": 0.02, "sway_longitudinal": 0.01, "sway_phase": 0.5}
    )
    require_reachable(machine, swaying)
    feet, still = (
        np.array([feet_in_body(machine, q) for q in desired_angles(machine, scenario).angles])
        for scenario in (swaying, plain)
    )
    moved = still - feet
    # All feet move alike, against the body; so those on the ground stay where they are.
    np.testing.assert_allclose(moved, np.broadcast_to(moved[:, :1], moved.shape), atol=1e-9)
    cycles = np.arange(len(moved)) * 0.002 / plain.cycle_time
    np.testing.assert_allclose(moved[:, 0, 1], -0.02 * np.cos(2 * np.pi * cycles), atol=1e-9)
    np.testing.assert_allclose(moved[:, 0, 0], -0.01 * np.sin(4 * np.pi * cycles), atol=1e-9)
    np.testing.assert_allclose(moved[:, 0, 2], 0.0, atol=1e-9)


def test_a_cycloid_leaves_the_ground_and_comes_down_without_speed() -> None:
    phase = np.linspace(0.0, 1.0, 10001)[:-1]
    forward, lift = foot_curve("cycloid", phase, stride=0.1, height=0.03, duty_factor=0.6)
    stands = phase < 0.6
    np.testing.assert_allclose(np.diff(forward[stands]), -0.1 / 0.6 * 1e-4, rtol=1e-6)
    assert not lift[stands].any()
    assert lift.max() == pytest.approx(0.03) and (lift >= 0.0).all()
    lift_off = int(np.argmin(stands))
    assert forward[[0, lift_off, -1]] == pytest.approx([0.05, -0.05, 0.05], abs=1e-6)
    speeds = np.hypot(np.diff(forward), np.diff(lift)) / 1e-4
    assert max(speeds[6001], speeds[-1]) < 1e-4 < speeds[6100]


def test_groups_of_legs_are_rows_sides_and_legs(hexapod: Robot, quadruped: Robot) -> None:
    names = {
        group: {hexapod.legs[k].name for k in legs} for group, legs in leg_groups(hexapod).items()
    }
    assert names["front"] == {"left_front", "right_front"}
    assert names["middle"] == {"left_middle", "right_middle"}
    assert names["hind"] == {"left_rear", "right_rear"}
    assert names["left"] == {"left_front", "left_middle", "left_rear"}
    assert names["left_rear"] == {"left_rear"} and len(names["all"]) == 6
    assert "middle" not in leg_groups(quadruped)


def test_a_group_may_have_its_own_stride_and_the_smallest_group_takes_precedence(
    hexapod: Robot,
) -> None:
    scenario = level(
        by_group={"stride[front]": 0.05, "stride[left_front]": 0.04, "height[left]": 0.02}
    )
    found = leg_gaits(hexapod, scenario)
    names = [leg.name for leg in hexapod.legs]
    strides = {name: gait.stride for name, gait in zip(names, found, strict=True)}
    assert strides["left_front"] == 0.04 and strides["right_front"] == 0.05
    assert {strides[leg] for leg in strides if "front" not in leg} == {0.06}
    heights = {name: gait.height for name, gait in zip(names, found, strict=True)}
    assert {heights[leg] for leg in heights if "left" in leg} == {0.02}
    assert desired_angles(hexapod, level(by_group={"stride[all]": 0.06})) is desired_angles(
        hexapod, level()
    )


def test_a_robot_may_define_groups(quadruped: Robot) -> None:
    files = quadruped_files()
    group = '[leg_groups]\ndiagonal = ["left_front", "right_rear"]\n'
    spine = parse_robot(files.toml + group, files.urdf)
    gaits = leg_gaits(spine, level(by_group={"duty_factor[diagonal]": 0.7}))
    assert [gait.support_share for gait in gaits] == [0.5, 0.7, 0.7, 0.5]
    with pytest.raises(RobotFileError, match=r"leg_groups\.odd: no leg 'fifth' is described"):
        parse_robot(files.toml + "[leg_groups]\nodd = ['fifth']\n", files.urdf)
    assert "leg_groups" not in quadruped.description.model_dump()


@pytest.mark.parametrize(
    ("by_group", "said"),
    [
        ({"stride[nose]": 0.05}, r"^stride\[nose\]: szabadka2 has no such group.*front, middle"),
        ({"stride[front]": 0.05, "stride[hind]": 0.04, "stride[middle]": 0.05}, None),
        ({"stride[left]": 0.05, "stride[right]": 0.04, "stride[front]": 0.03}, None),
    ],
)
def test_groups_that_a_robot_does_not_have_are_refused_with_those_that_it_has(
    hexapod: Robot, by_group: dict[str, float], said: str | None
) -> None:
    if said is None:
        leg_gaits(hexapod, level(by_group=by_group))
        return
    with pytest.raises(SimulationInputError, match=said):
        leg_gaits(hexapod, level(by_group=by_group))


def test_two_groups_of_one_size_that_share_a_leg_are_refused(quadruped: Robot) -> None:
    both = level(by_group={"stride[front]": 0.05, "stride[left]": 0.04})
    with pytest.raises(SimulationInputError, match=r"leg 'left_front' is also in 'fro"):
        leg_gaits(quadruped, both)
    # A value of its own decides.
    own = level(by_group={**(both.by_group or {}), "stride[left_front]": 0.045})
    assert leg_gaits(quadruped, own)[1].stride == 0.045


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"fir_ms[front]": 12}, "not a value of leg groups; those are stride"),
        ({"stride": 0.05}, "not a value of leg groups"),
        ({"stride[front]": -1.0}, r"by_group.stride\[front\]: .*greater than 0"),
        ({"duty_factor[front]": float("nan")}, "duty_factor"),
    ],
)
def test_values_that_no_group_can_have_are_refused(entry: dict[str, float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        level(by_group=entry)


def test_a_design_gives_values_of_groups_by_name() -> None:
    scenario = with_gait(
        level(by_group={"height[hind]": 0.03}), {"stride[front]": 0.05, "gait": 2.0, "stride": 0.07}
    )
    assert scenario.by_group == {"height[hind]": 0.03, "stride[front]": 0.05}
    assert (scenario.gait, scenario.stride) == ("tripod", 0.07)
    assert GAIT_CATALOGUE["stride[front]"].low == GAIT_CATALOGUE["stride"].low
    assert "fir_ms[front]" not in GAIT_CATALOGUE and "stride[]" not in GAIT_CATALOGUE
    with pytest.raises(SimulationInputError, match=r"^stride\[front\]: must be at most 10"):
        with_gait(level(), {"stride[front]": 70.0})


QUICK: dict[str, Any] = {"cycle_time": 0.3, "cycles": 5, "height": 0.05, "fir_ms": 4}
QUADRUPED_S: dict[str, Any] = {"hip_height": 0.16, "radius": 0.22, "stride": 0.04, "height": 0.03}


@pytest.mark.variants("hexapod-wave", "quadruped-trot")
@pytest.mark.parametrize(
    ("robot", "scenario"),
    [
        ("hexapod", {"gait": "wave", "duty_factor": 0.85, "cycle_time": 2.0}),
        ("hexapod", {"gait": "ripple", "duty_factor": 0.7, "cycle_time": 2.0}),
        ("quadruped", {"gait": "trot", "duty_factor": 0.55, "cycle_time": 0.8, "cycles": 2}),
        ("quadruped", QUICK | {"gait": "pace", "duty_factor": 0.55, "radius": 0.1}),
        ("quadruped", QUICK | {"gait": "bound", "duty_factor": 0.55}),
        ("quadruped", {"gait": "crawl", "duty_factor": 0.8, "cycle_time": 2.0}),
    ],
    ids=lambda value: value.get("gait") if isinstance(value, dict) else value,
)
def test_feet_touch_the_ground_when_the_gait_plans_it(
    robot: str, scenario: dict[str, Any], request: pytest.FixtureRequest
) -> None:
    machine: Robot = request.getfixturevalue(robot)
    posture = QUADRUPED_S if robot == "quadruped" else {}
    walked = short_walk(**posture | scenario)
    log = logged_walk(walked, {"P": 1.0, "I": 0.0}, "pi", robot=machine)
    cycles = log.time / walked.cycle_time
    # The robot stands on all feet at the start, whatever the gait.
    moving = np.isfinite(log.base_position[:, 2]) & (cycles > 0.5)
    stood = log.foot_force[moving, :, 2] > 0.0
    planned, half_a_cycle_off = (
        supporting(leg_gaits(machine, walked), at)[moving] for at in (cycles, cycles + 0.5)
    )
    assert (stood == planned).mean() > max(0.75, 0.1 + (stood == half_a_cycle_off).mean())


def test_presets_are_in_the_robots_own_gait() -> None:
    scenario = find_scenario("normal-fast")
    assert (scenario.gait, scenario.phases, scenario.by_group) == ("own", None, None)


@pytest.mark.parametrize(
    ("given", "support"),
    [
        ({"gait": "wave"}, 0.85),
        ({"gait": "crawl"}, 0.85),
        ({"gait": "ripple"}, 0.7),
        ({"gait": "ripple", "duty_phase": "swing"}, 0.7),
        ({"gait": "trot"}, 0.56),
        ({}, 0.56),
        ({"gait": "wave", "duty_factor": 0.56}, 0.56),
    ],
)
def test_gaits_that_need_more_support_have_it_unless_it_is_given(
    given: dict[str, Any], support: float
) -> None:
    walk = Scenario(**CRAWL | {"name": "one"} | given)
    assert walk.support_share == pytest.approx(support)
    assert Scenario.model_validate(walk.model_dump()) == walk
    assert walk.model_dump()["duty_factor"] == walk.duty_factor
    renamed = with_gait(walk, {"gait": float(GAIT_NAMES.index("wave"))})
    assert renamed.gait == "wave" and renamed.duty_factor == walk.duty_factor
