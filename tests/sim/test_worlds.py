"""Designs in worlds that differ from the model."""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.case import run_together
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.kernel import LARGEST_DELAY
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, SHIPPED, RobotSource, RobotVariant, load_robot
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.scenario import HELD_OUT, PRESETS, SCENARIOS, Scenario
from gaitswarm.sim.simulate import plan_of_scenario
from gaitswarm.sim.worlds.perturbations import DRAWN, LIMITS, sample_worlds
from gaitswarm.sim.worlds.walks import MeasuredPerturbedWalk, PerturbedWalk, WorldWalk
from tests.examples.walks import PUBLISHED_A, quadruped_files, short_walk, walk

Floats = NDArray[np.float64]

PI = {"P": 0.45, "I": 0.1}
NAMES = tuple(variable.name for variable in DRAWN)
MAIN: ControllerName = "fuzzy-pi"
NOMINAL_VALUES = {v.name: v.default for v in DRAWN if v.default is not None}
NOMINAL = np.array([[variable.default for variable in DRAWN]])
VARIANTS: dict[str, RobotSource] = {
    "reconstructed": "szabadka2-reconstructed",
    "datasheet": "szabadka2",
    "stick": RobotVariant(name="szabadka2", contact_law="stick"),
    "backlash": RobotVariant(name="szabadka2", backlash=(2.5, 1.0, 1.0)),
    "quadruped": quadruped_files(),
}


def case(
    *variables: str,
    scenario: Scenario | None = None,
    robot: RobotSource = "szabadka2-reconstructed",
    design: Mapping[str, float] = PI,
    controller: ControllerName = "pi",
    **options: Any,
) -> WorldWalk:
    return WorldWalk(
        robot, controller, tuple(design.items()), scenario or short_walk(), variables, **options
    )


def world(values: Mapping[str, float]) -> tuple[tuple[str, ...], Floats]:
    return tuple(values), np.array([list(values.values())])


def in_world(
    scenario: Scenario, values: Mapping[str, float], robot: RobotSource = "szabadka2"
) -> Floats:
    """Objectives of one world."""
    names, row = world(values)
    return np.asarray(case(*names, scenario=scenario, robot=robot).run(row).objectives[0])


def bits(outcome: Outcome) -> tuple[bytes, bytes]:
    return outcome.objectives.tobytes(), outcome.statuses.tobytes()


@pytest.mark.variants("slope-fast")
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: s.name)
def test_the_nominal_world_is_the_model_to_the_bit(scenario: Scenario) -> None:
    walked = case(*NAMES, scenario=scenario, design=PUBLISHED_A, controller=MAIN)
    assert bits(walked.run(NOMINAL)) == bits(walk(scenario).outcome)
    unnamed = case(scenario=scenario, design=PUBLISHED_A, controller=MAIN)
    assert bits(unnamed.run(np.empty((1, 0)))) == bits(walk(scenario).outcome)


@pytest.mark.variants("backlash", "quadruped")
@pytest.mark.parametrize("robot", VARIANTS.values(), ids=VARIANTS)
def test_the_nominal_world_is_the_model_on_any_robot(robot: RobotSource) -> None:
    brief = short_walk(cycle_time=0.4, load=1.0, slope=5.0, slope_direction=70.0, drop=0.002)
    walked = case(*NAMES, scenario=brief, robot=robot).run(NOMINAL)
    assert bits(walked) == bits(walk(brief, PI, "pi", robot=robot).outcome)


FEET = tuple(leg.name for leg in load_robot("szabadka2").description.legs)


@pytest.mark.parametrize(
    ("name", "field", "nominal"),
    [
        ("friction_factor", "friction", 1.0),
        ("stiffness_factor", "stiffness", 10_000.0),
        ("damping_factor", "damping", 150.0),
        ("sole_factor", "sole", 0.010),
    ],
)
def test_a_factor_of_the_contact_is_that_of_every_foot(
    name: str, field: str, nominal: float
) -> None:
    robot = load_robot("szabadka2")
    other = with_parameters(robot, {f"{field}_{foot}": nominal * 0.8 for foot in FEET})
    found = in_world(short_walk(), {name: 0.8})
    alone = walk(short_walk(), PI, "pi", robot=other).outcome.objectives[0]
    # Feet are planned for the nominal sole in both.
    np.testing.assert_allclose(found, alone, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "value", "parameters"),
    [
        ("battery_voltage_factor", 0.9, {"battery_voltage": 11.6 * 0.9}),
        ("battery_resistance_factor", 3.0, {"battery_resistance": 0.24 * 3.0}),
        ("body_mass_factor", 1.2, {"body_mass": 3.25 * 1.2}),
        ("efficiency_factor", 0.5, {"efficiency": 0.3}),
        ("efficiency_factor", 5.0, {"efficiency": 1.0}),
    ],
)
def test_a_factor_of_the_robot_is_that_of_its_parameter(
    name: str, value: float, parameters: dict[str, float]
) -> None:
    robot = with_parameters(load_robot("szabadka2"), parameters)
    found = in_world(short_walk(), {name: value})
    alone = walk(short_walk(), PI, "pi", robot=robot).outcome.objectives[0]
    np.testing.assert_allclose(found, alone, rtol=1e-6)
    assert not np.allclose(found, in_world(short_walk(), {}), rtol=1e-4)


def test_load_and_slope_are_added_to_the_scenarios() -> None:
    uphill = short_walk(load=1.0, slope=4.0, slope_direction=90.0)
    steeper = short_walk(load=1.5, slope=math.hypot(4.0, 3.0), slope_direction=53.13010235415598)
    found = in_world(uphill, {"load_added": 0.5, "slope_added": 3.0, "slope_added_direction": 0.0})
    alone = walk(steeper, PI, "pi", robot="szabadka2").outcome.objectives[0]
    np.testing.assert_allclose(found, alone, rtol=1e-6)


def test_viscous_friction_costs_energy() -> None:
    energy = [in_world(short_walk(), {"viscous_friction_factor": f})[3] for f in (0.5, 1.0, 2.0)]
    assert energy[0] < energy[1] < energy[2]


def test_a_load_to_the_left_presses_the_left_feet_down() -> None:
    names, rows = world({"load_left": 0.05, "load_ahead": 0.05})
    loaded = case(*names, scenario=short_walk(load=2.0), robot="szabadka2")
    middle, aside = (
        loaded.simulate(worlds, log=True).logs[0] for worlds in (np.zeros((1, 2)), rows)
    )
    assert middle is not None and aside is not None
    left = np.array([foot.startswith("left") for foot in FEET])
    front = np.array([foot.endswith("front") for foot in FEET])

    def share(forces: Floats, legs: NDArray[np.bool_]) -> float:
        carried = forces[:, :, 2].mean(axis=0)
        return float(carried[legs].sum() / carried.sum())

    # 2 kg of 8.76, moved by 5 cm, between feet 32 cm apart: 3.6 % of the weight.
    assert share(aside.foot_force, left) - share(middle.foot_force, left) == pytest.approx(
        2.0 / 8.76 * 0.05 / 0.32, rel=0.2
    )
    assert share(aside.foot_force, front) > share(middle.foot_force, front)


def test_a_world_has_the_same_bits_alone_and_in_any_company() -> None:
    worlds = sample_worlds(13, seed=3)
    for precision in ("double", "single"):
        walked = case(*NAMES, precision=precision)
        together = walked.run(worlds)
        for rows in (worlds[5:6], worlds[::-1], worlds[3:12]):
            found = {row.tobytes(): k for k, row in enumerate(worlds)}
            alone = walked.run(rows)
            which = [found[row.tobytes()] for row in rows]
            assert alone.objectives.tobytes() == together.objectives[which].tobytes()


def test_worlds_of_several_scenarios_share_a_call_of_the_kernel() -> None:
    worlds = sample_worlds(5, seed=3)
    cases = [case(*NAMES), case(*NAMES, scenario=short_walk(name="b", turn=-0.5))]
    together = run_together(cases, [worlds, worlds])
    assert [bits(o) for o in together] == [bits(c.run(worlds)) for c in cases]
    assert bits(together[0]) != bits(together[1])


def test_a_world_can_be_looked_at_again() -> None:
    worlds = sample_worlds(9, seed=4)
    walked = case(*NAMES)
    again = walked.simulate(worlds[6:7], log=True)
    assert bits(again.outcome)[0] == walked.run(worlds).objectives[6:7].tobytes()
    (log,) = again.logs
    assert log is not None
    distance = log.base_position[-1, 0] - log.base_position[0, 0]
    assert distance == pytest.approx(again.measurements.speed[0] * walked.duration, rel=0.05)


def test_a_gait_out_of_reach_is_so_in_every_world() -> None:
    far = case(*NAMES, scenario=short_walk(stride=0.5)).run(sample_worlds(3, seed=1))
    assert far.statuses.tolist() == [Status.UNREACHABLE] * 3


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"friction_factor": -0.1}, "friction_factor"),
        ({"body_mass_factor": 0.0}, "body_mass_factor"),
        ({"load_added": math.nan}, "load_added"),
        ({"angle_delay": 16.0}, "angle_delay"),
        ({"angle_delay": 1.4}, "angle_delay"),
        ({"moon": 1.0}, "moon"),
    ],
)
def test_a_world_that_cannot_be_simulated_is_refused_by_name(
    values: dict[str, float], named: str
) -> None:
    names, row = world(values)
    with pytest.raises(SimulationInputError, match=f"^{named}: "):
        case(*names).run(row)


def test_worlds_are_drawn_by_seed_and_index_and_variable() -> None:
    many, few = sample_worlds(200, seed=7), sample_worlds(20, seed=7)
    np.testing.assert_array_equal(many[:20], few)
    low, high = (np.array([getattr(v, end) for v in DRAWN]) for end in ("low", "high"))
    assert ((many >= low) & (many <= high)).all()
    shares = (many - low) / (high - low)
    np.testing.assert_allclose(shares.mean(axis=0), 0.5, atol=0.08)
    even = [v.high - v.low > 2.0 or v.kind == "continuous" for v in DRAWN]
    np.testing.assert_allclose(shares[:, even].std(axis=0), 12.0**-0.5, atol=0.04)
    some = DRAWN[3:7][::-1]
    np.testing.assert_array_equal(sample_worlds(20, seed=7, choice=some), few[:, 3:7][:, ::-1])
    assert not np.array_equal(few, sample_worlds(20, seed=8))
    correlated = np.abs(np.corrcoef(many.T) - np.eye(len(DRAWN)))
    assert correlated.max() < 0.3
    delays = many[:, NAMES.index("angle_delay")]
    assert np.unique(delays, return_counts=True)[1].tolist() == pytest.approx([67] * 3, abs=20)


def test_bounds_of_table_2_7_span_the_intervals_of_all_legs() -> None:
    folder = resources.files("gaitswarm.sim.robot") / "szabadka2-identified"
    intervals, document = (
        tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8"))
        for name in ("intervals", "parameters")
    )
    spans = defaultdict(list)
    for name, ends in intervals.items():
        whole = name.startswith(("battery", "body"))
        factor = f"{name if whole else name.split('_')[0]}_factor"
        spans[factor].append([end / document["parameters"][name] for end in ends])
    bounds = {v.name: (v.low, v.high) for v in DRAWN if "table 2.7" in v.description}
    assert bounds.keys() == spans.keys()
    for name, (low, high) in bounds.items():
        # Rounded outwards.
        assert low <= np.min(spans[name]) < low + 0.01
        assert high - 0.01 < np.max(spans[name]) <= high


def test_readings_may_be_as_late_as_the_kernel_allows() -> None:
    assert LIMITS["angle_delay"] == LIMITS["current_delay"] == (0.0, LARGEST_DELAY)


def test_every_perturbation_matters() -> None:
    others = {"slope_added": 1.0, "start_angle": 0.01, "angle_noise": 1e-4}
    scenario = short_walk(load=1.0, cycle_time=0.5)
    # Two ticks are short compared with the current's low-pass.
    values = {v.name: v.high for v in DRAWN} | {"current_delay": 15.0}
    rows = [others, *(others | {name: values[name]} for name in NAMES)]
    worlds = np.array([[(NOMINAL_VALUES | row)[name] for name in NAMES] for row in rows])
    for robot in (DEFAULT_ROBOT, RobotVariant(backlash=(2.5, 1.0, 1.0))):
        walked = case(*NAMES, scenario=scenario, robot=robot, design=PUBLISHED_A, controller=MAIN)
        nominal, *found = walked.run(worlds).objectives
        same = [
            v.name
            for v, objectives in zip(DRAWN, found, strict=True)
            if np.allclose(objectives, nominal, rtol=1e-9)
        ]
        assert same == (["backlash_factor"] if robot == DEFAULT_ROBOT else [])


@pytest.mark.parametrize("robot", [DEFAULT_ROBOT, VARIANTS["backlash"]], ids=["rigid", "play"])
def test_a_robot_begins_on_its_soles_however_it_is_tilted(robot: RobotSource) -> None:
    scenario = short_walk(load=1.0, cycle_time=0.4)
    names, row = world(
        {"start_roll": 4.0, "start_pitch": -3.0, "start_angle": 0.02, "world_seed": 5.0}
    )
    (log,) = case(*names, scenario=scenario, robot=robot).simulate(row, log=True).logs
    assert log is not None
    weight = (load_robot(robot).mass + 1.0) * GRAVITY
    assert log.foot_force[0, :, 2].sum() == pytest.approx(weight, rel=1e-9)
    roll, pitch = np.radians([4.0, -3.0])
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_quat(log.base_orientation[0]).apply([[0, 1, 0], [1, 0, 0]])
    assert turned[0, 2] == pytest.approx(math.cos(pitch) * math.sin(roll))
    assert turned[1, 2] == pytest.approx(-math.sin(pitch))
    # The play in the gears is all around the motors' angles.
    np.testing.assert_array_equal(log.motor_angle[0], log.joint_angle[0])


def test_angles_at_the_start_are_off_by_the_worlds_seed() -> None:
    seeds = np.arange(40.0)
    names = ("world_seed", "start_angle")
    worlds = np.stack([seeds, np.full(40, 0.02)], axis=1)
    scenario = short_walk(cycle_time=0.2)
    logs = case(*names, scenario=scenario).simulate(worlds, log=True).logs
    begun = np.array([log.joint_angle[0] - log.desired_angle[0] for log in logs if log])
    assert begun.shape == (40, 18)
    assert begun.std() == pytest.approx(0.02, rel=0.06)
    assert abs(begun.mean()) < 0.002
    assert np.abs(np.corrcoef(begun.T) - np.eye(18)).max() < 0.55


def test_a_start_above_the_stance_is_a_drop() -> None:
    found = in_world(short_walk(), {"start_height": 0.004})
    dropped = walk(short_walk(drop=0.004), PI, "pi", robot="szabadka2").outcome
    np.testing.assert_array_equal(found, dropped.objectives[0])


def test_a_jammed_leg_is_held_where_the_world_has_it() -> None:
    names, row = world({"start_angle": 0.05, "world_seed": 3.0})
    scenario = short_walk(stuck_leg="right_middle")
    (log,) = case(*names, scenario=scenario).simulate(row, log=True).logs
    assert log is not None
    held = log.joint_angle[:, 6:9]
    assert np.abs(held[0] - log.desired_angle[0, 6:9]).max() > 0.02
    assert np.abs(held - held[0]).max() < 0.02


def test_what_is_late_or_noisy_in_a_world_is_so_by_its_seed() -> None:
    noisy = [
        in_world(short_walk(), {"angle_noise": 2e-3, "world_seed": seed})
        for seed in (1.0, 1.0, 2.0)
    ]
    np.testing.assert_array_equal(noisy[0], noisy[1])
    assert noisy[0][0] != noisy[2][0]
    # A stiff drive that learns of its errors late swings.
    stiff = case("angle_delay", robot="szabadka2", design={"P": 2.0, "I": 0.0})
    prompt, late = stiff.run(np.array([[0.0], [12.0]])).objectives
    assert late[2] > 1.5 * prompt[2]


@pytest.mark.parametrize("scenario", HELD_OUT, ids=lambda s: s.name)
def test_held_out_scenarios_are_none_of_the_table_and_can_be_walked(scenario: Scenario) -> None:
    assert scenario in PRESETS and scenario not in SCENARIOS
    for robot in SHIPPED:
        assert desired_angles(load_robot(robot), scenario).reachable
    outcome = walk(scenario).outcome
    assert outcome.statuses.tolist() == [Status.OK]


@pytest.mark.variants("backlash")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["reconstructed", "backlash"])
def test_designs_in_one_world_have_the_bits_of_worlds_of_one_design(name: str) -> None:
    (drawn,) = sample_worlds(1, 5)
    known = tuple(zip(NAMES, drawn.tolist(), strict=True))
    designs = np.array([[0.45, 0.1], [0.2, 0.0]])
    scenario = short_walk(cycle_time=0.4)
    robot, gains = VARIANTS[name], ("P", "I")
    perturbed = PerturbedWalk("short", robot, "pi", scenario, known, gains)
    together = perturbed.simulate(designs, log=True)
    measured = MeasuredPerturbedWalk("short", robot, "pi", scenario, known, gains).run(designs)
    for row, (p, i) in enumerate(designs.tolist()):
        alone = case(*NAMES, scenario=scenario, robot=robot, design={"P": p, "I": i}).simulate(
            drawn[np.newaxis], log=True
        )
        columns = [alone.outcome.objectives, alone.measurements.array()]
        assert np.array_equal(measured.objectives[[row]], np.concatenate(columns, axis=1))
        assert np.array_equal(together.outcome.objectives[[row]], alone.outcome.objectives)
        logs = together.logs[row], alone.logs[0]
        assert logs[0] is not None and logs[1] is not None
        assert np.array_equal(logs[0].base_position, logs[1].base_position)


def test_worlds_share_the_plans_of_gaits() -> None:
    scenario, variables = short_walk(), ("P", "I", "stride")
    designs = np.array([[0.45, 0.1, 0.123], [0.2, 0.0, 0.131], [0.45, 0.1, 0.9], [0.3, 0.1, 0.123]])
    names, worlds = ("world_seed", "roughness"), [(1.0, 0.0), (2.0, 0.01), (3.0, 0.0)]
    cases = [
        PerturbedWalk(f"world-{k}", DEFAULT_ROBOT, "pi", scenario, known, variables)
        for k, known in enumerate(tuple(zip(names, world, strict=True)) for world in worlds)
    ]
    before = plan_of_scenario.cache_info().misses
    outcomes = run_together(cases, [designs] * len(cases))
    assert plan_of_scenario.cache_info().misses == before + 3
    for row, (p, i, stride) in enumerate(designs.tolist()):
        alone = case(*names, design={"P": p, "I": i, "stride": stride}).run(np.array(worlds))
        for world, outcome in enumerate(outcomes):
            assert outcome.statuses[row] == alone.statuses[world]
            assert np.array_equal(outcome.objectives[row], alone.objectives[world], equal_nan=True)
    assert outcomes[0].statuses[2] == Status.UNREACHABLE
