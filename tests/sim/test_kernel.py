"""The compiled kernel: same physics as the Python one, same bits in any lane."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.compiler.compilation import X86, Target, host_architecture, target
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.native import NativeKernel, load_kernel, native_kernel
from gaitswarm.sim.kernel.observation import walk_log
from gaitswarm.sim.kernel.reference import ReferenceKernel, reference_kernel
from gaitswarm.sim.kernel.walk import Coding, Kernel, WalkSetup
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulate
from tests.examples import walks
from tests.examples.walks import PUBLISHED_A

FUZZY = CONTROLLERS["fuzzy-pi"]
BACKLASH = RobotVariant(backlash=(2.5, 1.0, 1.0))
SHORT = SCENARIOS[0].model_copy(update={"cycles": 1.0, "cycle_time": 0.4})


def swarm(n: int, seed: int = 5) -> np.ndarray:
    """Random designs inside the bounds, (n, 9)."""
    low = np.array([v.low for v in FUZZY.variables])
    high = np.array([v.high for v in FUZZY.variables])
    designs = np.random.default_rng(seed).uniform(low, high, (n, len(low)))
    designs[:, 4] = np.rint(designs[:, 4])
    return designs


NAMES = [v.name for v in FUZZY.variables]


def walk(designs: np.ndarray, scenario: Scenario = SHORT) -> np.ndarray:
    return simulate(scenario, "fuzzy-pi", NAMES, designs, backend="native").outcome.objectives


@pytest.mark.variants("loaded-fast", "slope-fast", "turn-right-fast")
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: s.name)
def test_compiled_and_readable_kernel_agree(scenario: Scenario) -> None:
    brief = scenario.model_copy(update={"cycles": 1.0, "cycle_time": 0.25})
    results = [walks.walk(brief, backend=b, log=True) for b in ("native", "reference")]
    fast, slow = results
    assert fast.outcome.statuses.tolist() == slow.outcome.statuses.tolist() == [Status.OK]
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-9)
    for field in ("base_position", "joint_angle", "current", "foot_force"):
        ours, theirs = (getattr(result.logs[0], field) for result in results)
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_kernels_take_the_same_short_steps_where_feet_come_down(robot: Robot) -> None:
    kernel, reference = native_kernel(robot), reference_kernel(robot)
    assert kernel is not None
    coding, _ = control_steps(robot)
    setup = _setup(robot, kernel, SHORT)
    fast, slow = (k.walk([setup], coding, log=False) for k in (kernel, reference))
    ticks, rounds = setup.ticks, fast.lane_use.walked
    assert ticks < rounds < coding.refinement * ticks
    assert slow.lane_use.walked == rounds
    np.testing.assert_allclose(fast[0].sums, slow[0].sums, rtol=1e-9)
    # A kernel that took long steps there would walk elsewhere.
    (coarse,) = kernel.walk([setup], dataclasses.replace(coding, refinement=1), log=False)
    assert np.abs(coarse.sums / fast[0].sums - 1.0).max() > 1e-3


def test_a_log_does_not_change_the_walk() -> None:
    designs = swarm(3)
    logged = simulate(SHORT, "fuzzy-pi", NAMES, designs, log=True)
    np.testing.assert_array_equal(logged.outcome.objectives, walk(designs))
    assert all(log is not None and len(log.time) == 200 for log in logged.logs)


def _setup(robot: Robot, kernel: Kernel, scenario: Scenario) -> WalkSetup:
    plan = plan_walk(robot, scenario, control_steps(robot)[1])
    assert plan is not None
    return plan(FUZZY.compile(PUBLISHED_A))


def _sums(kernel: Kernel, setups: Sequence[WalkSetup], robot: Robot) -> list[tuple[Status, bytes]]:
    results = kernel.walk(setups, control_steps(robot)[0], log=False)
    return [(result.status, result.sums.tobytes()) for result in results]


def _falling(setup: WalkSetup, kernel: NativeKernel | ReferenceKernel) -> WalkSetup:
    """The same walk over ground that carries nothing."""
    parameters = setup.parameters.copy()
    for name in ("stiffness", "damping"):
        parameters[kernel.layout.slices[name]] = 0.0
    return dataclasses.replace(setup, parameters=parameters)


def test_a_fallen_walks_log_is_the_same_alone_and_with_others(robot: Robot) -> None:
    kernel, reference = native_kernel(robot), reference_kernel(robot)
    assert kernel is not None
    good = _setup(robot, kernel, SHORT)
    falling = _falling(good, kernel)
    coding = control_steps(robot)[0]
    (alone,) = kernel.walk([falling], coding, log=True)
    company = kernel.walk([good, falling, good], coding, log=True)
    (readable,) = reference.walk([falling], coding, log=True)
    assert [result.status for result in company] == [Status.OK, Status.FELL, Status.OK]
    assert alone.states is not None and company[1].states is not None
    assert readable.states is not None
    assert company[1].states.tobytes() == alone.states.tobytes()
    rows = np.asarray(np.isfinite(alone.states).all(axis=1))
    fell_at = int(rows.sum())
    assert 0 < fell_at < falling.ticks
    assert rows[:fell_at].all()
    assert np.isnan(alone.states[fell_at:]).all()
    np.testing.assert_array_equal(np.isnan(readable.states), np.isnan(alone.states))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["native", "reference"])
def test_a_walk_whose_internal_state_is_undefined_has_diverged(kind: str) -> None:
    machine = load_robot(BACKLASH)
    kernel = native_kernel(machine) if kind == "native" else reference_kernel(machine)
    assert kernel is not None
    setup = _setup(machine, kernel, SHORT)
    brief = dataclasses.replace(setup, desired=setup.desired[:3])
    undefined = brief.internal_state.copy()
    # The angle of a motor: comparisons of the play hide it from the links.
    undefined[0] = np.nan
    lost = dataclasses.replace(brief, internal_state=undefined)
    results = kernel.walk([brief, lost], control_steps(machine)[0], log=True)
    assert [result.status for result in results] == [Status.OK, Status.DIVERGED]
    assert np.isfinite(results[1].end).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["native", "reference"])
@pytest.mark.parametrize(
    "name", ["start", "internal_state", "parameters", "desired", "disturbance"]
)
def test_an_array_of_another_shape_is_refused_by_name(kind: str, name: str) -> None:
    machine = load_robot(BACKLASH)
    kernel = native_kernel(machine) if kind == "native" else reference_kernel(machine)
    assert kernel is not None
    setup = _setup(machine, kernel, SHORT)
    good = dataclasses.replace(setup, disturbance=np.zeros(setup.desired.shape))
    right = getattr(good, name)
    for wrong in (right[..., :-1], np.repeat(right, 2, axis=-1), right[:0], right[np.newaxis]):
        change: dict[str, Any] = {name: wrong}
        bad = dataclasses.replace(good, **change)
        with pytest.raises(ValueError, match=rf"^{name}: .*shape"):
            kernel.walk([good, bad], control_steps(machine)[0], log=True)


@pytest.mark.parametrize("shape", [(4, 0, 1), (4, 4)], ids=str)
def test_a_table_that_a_kernel_cannot_look_up_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"^values: .*three axes"):
        LookupTable(np.zeros(shape, dtype=np.int8), output_gain=1, error_gain=1, current_gain=1)


@pytest.mark.parametrize(
    "name", ["angle_step", "current_step", "pwm_step", "pwm_counts", "substeps", "refinement"]
)
def test_resolutions_below_one_are_refused(robot: Robot, name: str) -> None:
    with pytest.raises(ValueError, match=f"^{name}: 0 "):
        dataclasses.replace(control_steps(robot)[0], **{name: 0})


def test_a_nan_reading_is_coded_as_0_and_a_large_one_as_the_largest_code(
    robot: Robot,
) -> None:
    coding, _ = control_steps(robot)
    readings = np.array([np.nan, np.inf, -np.inf, 0.5 / coding.angle_counts])
    last = coding.angle_codes(np.array([1e300]))[0]
    assert last > 100_000
    assert coding.angle_codes(readings).tolist() == [0, last, -last, 0]
    assert coding.current_codes(readings[:3]).tolist() == [
        0,
        coding.current_codes(readings[1:2])[0],
        0,
    ]


@pytest.mark.parametrize(
    "name",
    ["proportional_gain", "integral_gain", "derivative_gain", "output_gain", "error_gain"],
)
def test_a_gain_beyond_the_controllers_integers_is_refused_by_name(robot: Robot, name: str) -> None:
    kernel = native_kernel(robot)
    assert kernel is not None
    setup = _setup(robot, kernel, SHORT)
    law = setup.control_law
    beyond: dict[str, Any] = {name: 2**45}
    if not hasattr(law, name):
        assert isinstance(law.direct, LookupTable)
        beyond = {"direct": dataclasses.replace(law.direct, **beyond)}
    bad = dataclasses.replace(setup, control_law=dataclasses.replace(law, **beyond))
    with pytest.raises(ValueError, match=rf"^(direct\.)?{name}: too large"):
        kernel.walk([bad], control_steps(robot)[0], log=False)


def _random_law(rng: np.random.Generator) -> ControlLaw:
    """Gains of any size that is allowed, tables of any shape."""

    def gain(bits: int) -> int:
        return int(rng.choice([-1, 1]) * 2.0 ** rng.uniform(0, bits))

    def table() -> LookupTable:
        shape = 2 ** rng.integers(0, 7, size=3)
        values = rng.integers(-128, 128, size=shape).astype(np.int8)
        return LookupTable(values, gain(44), gain(35), gain(35), gain(34))

    gains = gain(35), gain(35), gain(34)
    direct, integrated = [table() if rng.random() < 0.7 else None for _ in range(2)]
    return ControlLaw(*gains, direct, integrated)


def test_any_control_law_has_the_same_outputs_in_both_kernels(robot: Robot) -> None:
    kernel, reference = native_kernel(robot), reference_kernel(robot)
    assert kernel is not None
    setup, rng = _setup(robot, kernel, SHORT), np.random.default_rng(3)
    setups = [
        dataclasses.replace(
            setup,
            desired=setup.desired[:6] + rng.integers(-40, 40, size=(6, robot.n_joints), dtype="i4"),
            control_law=_random_law(rng),
        )
        for _ in range(60)
    ]
    coding = dataclasses.replace(Coding.of(robot, 1), angle_step=5, current_step=3, pwm_step=7)
    ours, theirs = (k.walk(setups, coding, log=True) for k in (kernel, reference))
    compiled, readable = (
        np.array([np.asarray(result.states)[:, -robot.n_joints :] for result in results])
        for results in (ours, theirs)
    )
    np.testing.assert_array_equal(compiled, readable)
    below_full_scale = np.abs(compiled) < coding.duty_per_count * coding.pwm_counts
    assert 0.1 < below_full_scale.mean() < 0.9


@pytest.mark.parametrize("kind", ["native", "reference"])
def test_a_standing_robot_carries_its_weight(robot: Robot, kind: str) -> None:
    kernel = native_kernel(robot) if kind == "native" else reference_kernel(robot)
    assert kernel is not None
    setup = _setup(robot, kernel, SHORT)
    still = dataclasses.replace(setup, desired=np.repeat(setup.desired[:1], 300, axis=0))
    (result,) = kernel.walk([still], control_steps(robot)[0], log=True)
    assert result.states is not None
    log = walk_log(robot, still, result.states)
    carried = log.foot_force[:, :, 2].sum(axis=1)
    assert carried[0] == pytest.approx(66.3, abs=0.1)
    assert carried[150:].mean() == pytest.approx(66.3, abs=0.1)
    assert abs(log.base_velocity[-1, :3]).max() < 0.01


def test_quasi_static_current_equals_the_exact_one(robot: Robot) -> None:
    """The winding's inductance, solved exactly over the logged voltages and speeds."""
    log = walks.logged_walk(SHORT)
    actuators = robot.actuators()
    steps = 10
    decay = np.exp(-actuators.resistance / actuators.inductance * CONTROL_PERIOD / steps)
    exact = np.zeros(robot.n_joints)
    charge = quasi = 0.0
    for k in range(len(log.time) - 1):
        for n in range(steps):
            speed = log.joint_velocity[k] + n / steps * (
                log.joint_velocity[k + 1] - log.joint_velocity[k]
            )
            settled = (log.voltage[k] - actuators.torque * speed) / actuators.resistance
            exact = settled + (exact - settled) * decay
            charge += float(log.voltage[k] @ exact)
            quasi += float(log.voltage[k] @ settled)
    assert charge == pytest.approx(quasi, rel=0.02)


@pytest.mark.variants("Target(lanes=4,*")
@pytest.mark.slow
@pytest.mark.parametrize(
    "narrower", [Target(4, "x86-64-v3"), Target(2, "x86-64-v2"), Target(2)], ids=str
)
def test_a_walk_has_the_same_bits_at_every_vector_width(narrower: Target, robot: Robot) -> None:
    if host_architecture() != X86 or target().lanes < narrower.lanes:
        narrower = target()
    wide = native_kernel(robot)
    assert wide is not None
    narrow = load_kernel(robot, compile_for=narrower)
    assert narrow is not None
    assert narrow.lanes == narrower.lanes
    setups = [_setup(robot, wide, s.model_copy(update={"cycles": 1.0})) for s in SCENARIOS]
    ours, theirs = (k.walk(setups, control_steps(robot)[0], log=True) for k in (wide, narrow))
    for a, b in zip(ours, theirs, strict=True):
        assert (a.status, a.sums.tobytes(), a.end.tobytes()) == (
            b.status,
            b.sums.tobytes(),
            b.end.tobytes(),
        )
        assert a.states is not None
        assert b.states is not None
        assert a.states.tobytes() == b.states.tobytes()
