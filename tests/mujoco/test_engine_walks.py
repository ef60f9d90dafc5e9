"""Whole walks in MuJoCo and in the kernel, under equal ground forces and under MuJoCo's own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from itertools import cycle

import numpy as np
import pytest

from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples import walks
from tests.examples.robots import changed
from tests.mujoco.controllers import Coded, FuzzyPi, Pi
from tests.mujoco.engine import walk_in_mujoco
from tests.mujoco.walker import Controller, Floats, Trace, walk

pytestmark = pytest.mark.slow

DEFAULT, PLAIN = RobotVariant(), RobotVariant(name="szabadka2")
DEAD_ZONE, KARNOPP, STICK = (
    RobotVariant(name="szabadka2", contact_law=law) for law in ("dead_zone", "karnopp", "stick")
)
LOOSE = RobotVariant(name="szabadka2", backlash=(2.5, 1.0, 1.0))
NORMAL_FAST, LOADED_FAST, LOADED_SLOW, SLOPE_FAST = (SCENARIOS[k] for k in (0, 2, 3, 4))
DRIVES: Mapping[str, tuple[str, Mapping[str, float], type[Coded]]] = {
    "published optimum A": ("fuzzy-pi", walks.PUBLISHED_A, FuzzyPi),
    "stiff PI": ("pi", {"P": 0.45, "I": 0.2}, Pi),
}
ENERGY, RECIPROCAL_SPEED = 3, 4


def cycles(number: float, scenario: Scenario) -> Scenario:
    """So much of the walk."""
    return scenario.model_copy(update={"cycles": number})


one_cycle = partial(cycles, 1.0)
"""A third of the walk, in which every foot has been lifted and set down."""

into_the_second_cycle = partial(cycles, 1.1)
"""One cycle and a tenth: the second begins where the first one ended."""

half_a_cycle = partial(cycles, 0.5)
"""Half of the feet have been lifted and set down: enough to see how they stand and slip."""

QUICK = {"cycle_time": 0.35}
"""Fields of a scenario whose walk is one of few steps."""


def named(value: object) -> str:
    """What tells a case from the others."""
    if isinstance(value, RobotVariant):
        play = " and backlash" if any(value.backlash) else ""
        return f"{value.name} {value.contact_law}{play}"
    return value.name if isinstance(value, Scenario) else str(value)


@lru_cache(maxsize=4)
def our_walk(
    drive: str, scenario: Scenario, variant: RobotVariant = PLAIN, **options: int
) -> tuple[Floats, WalkLog]:
    """Objectives and log of the compiled kernel's walk. options: of `simulate`."""
    controller, design, _ = DRIVES[drive]
    result = walks.walk(scenario, design, controller, robot=variant, log=True, **options)
    (log,) = result.logs
    assert result.outcome.statuses.tolist() == [Status.OK]
    assert log is not None
    return result.outcome.objectives[0], log


def own_controller(drive: str, log: WalkLog, variant: RobotVariant = PLAIN) -> Controller:
    """The drive's controller in closed loop, in the tests' own integers."""
    _, design, controller = DRIVES[drive]
    return controller(load_robot(variant), log, design)


def deviations(trace: Trace | WalkLog, log: WalkLog, seconds: float = np.inf) -> dict[str, float]:
    """Largest deviation of every trajectory from the log, up to a time."""
    rows = log.time <= seconds + 1e-9
    return {
        name: float(np.abs(getattr(trace, name)[rows] - getattr(log, name)[rows]).max())
        for name in ("base_position", "base_orientation", "joint_angle", "motor_angle")
    }


@pytest.mark.variants
@pytest.mark.parametrize(
    ("variant", "drive", "scenario"),
    [
        (
            DEFAULT,
            "published optimum A",
            into_the_second_cycle(LOADED_FAST.model_copy(update=QUICK)),
        ),
        (PLAIN, "stiff PI", half_a_cycle(SLOPE_FAST)),
        (KARNOPP, "stiff PI", half_a_cycle(NORMAL_FAST)),
        (DEAD_ZONE, "stiff PI", half_a_cycle(NORMAL_FAST)),
        (STICK, "published optimum A", half_a_cycle(SLOPE_FAST)),
        # Impacts in the gears amplify rounding: a longer walk would not stay as near.
        (LOOSE, "published optimum A", cycles(0.15, SLOPE_FAST)),
    ],
    ids=named,
)
def test_a_walk_is_the_same_in_mujoco_to_rounding(
    variant: RobotVariant, drive: str, scenario: Scenario
) -> None:
    """Same step, on MuJoCo's inertia and bias forces: only rounding is left between the engines."""
    objectives, log = our_walk(drive, scenario, variant)
    controller = own_controller(drive, log, variant)
    trace = walk(load_robot(variant), scenario, log, controller)
    assert max(deviations(trace, log).values()) < 1e-9
    np.testing.assert_allclose(trace.foot_force, log.foot_force, atol=1e-6)
    np.testing.assert_allclose(trace.objectives, objectives, rtol=1e-8)


@pytest.mark.thorough("test_a_walk_is_the_same_in_mujoco_to_rounding")
@pytest.mark.variants
@pytest.mark.parametrize("variant", [PLAIN, KARNOPP, STICK, LOOSE], ids=named)
def test_what_parts_us_from_mujocos_own_steps_vanishes_with_their_length(
    variant: RobotVariant,
) -> None:
    """Semi-implicit Euler is of first order: at 160 kHz it is near our step at the same rate."""
    # With backlash a shorter walk covers no distance.
    scenario = cycles(0.07 if variant is LOOSE else 0.04, NORMAL_FAST)
    _, log = our_walk("stiff PI", scenario, variant, physics_rate=160_000)
    controller, design, _ = DRIVES["stiff PI"]
    (_, coarse), (_, fine) = (
        walk_in_mujoco(variant, scenario, controller, design, rate=rate)
        for rate in (40_000, 160_000)
    )
    apart = max(deviations(fine, log).values())
    assert apart < 1e-5
    assert apart < 0.6 * max(deviations(coarse, log).values())


@pytest.mark.variants
@pytest.mark.parametrize(
    ("variant", "drive"),
    [
        (DEFAULT, "published optimum A"),
        (PLAIN, "stiff PI"),
        (KARNOPP, "published optimum A"),
        (STICK, "stiff PI"),
        (LOOSE, "stiff PI"),
    ],
    ids=named,
)
@pytest.mark.thorough("test_a_walk_is_the_same_in_mujoco_to_rounding, with MuJoCo's steps")
def test_in_mujocos_own_steps_a_walk_is_worth_the_same_within_two_percent(
    variant: RobotVariant, drive: str
) -> None:
    """As a certificate has it: MuJoCo's steps are shorter where a foot comes down."""
    # In one cycle, a foot at the jump of its friction may make a shock that differs by 3 %.
    # Backlash asks for steps that are 16 times as short.
    scenario = cycles({KARNOPP: NORMAL_FAST.cycles, LOOSE: 0.25}.get(variant, 1.0), NORMAL_FAST)
    objectives, log = our_walk(drive, scenario, variant)
    controller, design, _ = DRIVES[drive]
    found, trace = walk_in_mujoco(variant, scenario, controller, design)
    # A foot at the jump of its friction may be on either side of it.
    first = 1e-3 if variant is KARNOPP else 2e-4
    assert max(deviations(trace, log, seconds=0.1).values()) < first
    # Half a play of 2.5 degrees is 0.022 rad: loose joints may lie at either end of it.
    assert max(deviations(trace, log).values()) < (5e-2 if variant is LOOSE else 5e-3)
    np.testing.assert_allclose(found[:5], objectives[:5], rtol=0.02)


@pytest.mark.variants
@pytest.mark.parametrize(
    ("scenario", "drive"),
    list(
        zip(
            [half_a_cycle(NORMAL_FAST), *map(one_cycle, SCENARIOS[1:])],
            cycle(DRIVES),
            strict=False,
        )
    ),
    ids=named,
)
def test_speed_and_energy_agree_within_15_percent_under_mujocos_own_contacts(
    scenario: Scenario, drive: str
) -> None:
    """Spherical soles as stiff and damped as ours, whose forces act 10 mm below the tibia's end."""
    objectives, _ = our_walk(drive, scenario)
    controller, design, _ = DRIVES[drive]
    walked, _ = walk_in_mujoco(PLAIN, scenario, controller, design, soles="spheres")
    found = walked / objectives
    assert found[ENERGY] == pytest.approx(1.0, abs=0.15)
    assert found[RECIPROCAL_SPEED] == pytest.approx(1.0, abs=0.15)
    # Not asked for, but as near: shocks of body and attitude.
    np.testing.assert_allclose(found[1:3], 1.0, atol=0.15)


@pytest.mark.thorough(
    "explains the difference that is bounded by",
    "test_speed_and_energy_agree_within_15_percent_under_mujocos_own_contacts",
)
def test_most_of_the_torques_difference_is_the_lever_of_the_sole() -> None:
    """In long strides, MuJoCo's forces at the tibia's end bring the gear torques nearer."""
    scenario = one_cycle(LOADED_SLOW.model_copy(update=walks.LONG_STRIDES))
    objectives, _ = our_walk("stiff PI", scenario)
    controller, design, _ = DRIVES["stiff PI"]
    away = {}
    for soles in ("spheres", "points"):
        found, _ = walk_in_mujoco(PLAIN, scenario, controller, design, soles=soles)
        away[soles] = abs(found[0] / objectives[0] - 1.0)
    assert away["spheres"] < 0.25
    assert away["points"] < 0.5 * away["spheres"]


@pytest.mark.variants("0.0")
@pytest.mark.parametrize("backlash", [0.0, 0.02])
def test_dry_friction_is_that_of_mujoco(backlash: float) -> None:
    """Springs cut at the limit here, MuJoCo's constraint (or a clamped stop of rotors) there."""
    friction = {"coulomb_friction": 0.1, "stribeck_friction": 0.1, "load_friction": 0.1}
    robot = changed(load_robot(PLAIN), gearheads=friction, actuators={"backlash": backlash})
    scenario, design = half_a_cycle(walks.short_walk(**QUICK)), DRIVES["stiff PI"][1]
    ours = walks.walk(scenario, design, "pi", robot=robot).outcome.objectives[0]
    theirs, log = walk_in_mujoco(robot, scenario, "pi", design)
    np.testing.assert_allclose(theirs[:5], ours[:5], rtol=0.01)
    assert np.isfinite(log.current).all()


def on_rubble(amplitude: float, number: float) -> Scenario:
    """So many cycles on ground of this amplitude [m], which is a plane at 0."""
    terrain = {"kind": "rough", "amplitude": amplitude} if amplitude else {"kind": "plane"}
    document = NORMAL_FAST.model_dump() | {"cycle_time": 0.35, "terrain": terrain}
    return cycles(number, Scenario.model_validate(document))


def test_mujocos_height_field_is_the_kernels_uneven_ground() -> None:
    drive = "published optimum A"
    controller, design, _ = DRIVES[drive]
    rough = on_rubble(0.01, 0.5)
    ours, _ = our_walk(drive, rough, DEFAULT)
    mujocos, _ = walk_in_mujoco(DEFAULT, rough, controller, design)
    flat, _ = our_walk(drive, on_rubble(0.0, 0.5), DEFAULT)
    apart = np.abs(mujocos[:5] / ours[:5] - 1.0).max()
    assert apart < 0.1
    assert apart < 0.5 * np.abs(ours[:5] / flat[:5] - 1.0).max()


def test_mujocos_own_contacts_follow_uneven_ground() -> None:
    """On ground that is all but flat as on a plane; on rubble as near to the kernel as there."""
    controller, design, _ = DRIVES["stiff PI"]
    found = {}
    for amplitude in (0.0, 1e-6, 0.01):
        scenario = on_rubble(amplitude, 0.3 if amplitude > 1e-3 else 0.15)
        ours, _ = our_walk("stiff PI", scenario)
        theirs, _ = walk_in_mujoco(PLAIN, scenario, controller, design, soles="spheres")
        found[amplitude] = theirs[:5] / ours[:5]
    np.testing.assert_allclose(found[1e-6], found[0.0], rtol=1e-3)
    assert np.abs(found[0.01] - 1.0).max() < np.abs(found[0.0] - 1.0).max() + 0.1
