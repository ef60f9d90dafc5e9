"""Torque-controlled actuators: their law against Pinocchio, energy, and a PD in closed form."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.assembly import control_steps, kernel_of, plan_walk
from gaitswarm.sim.compiler.compilation import X86, Target, host_architecture, target
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.controllers.base import ControlLaw, JointPd
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.native import load_kernel, native_kernel
from gaitswarm.sim.kernel.observation import split_states
from gaitswarm.sim.kernel.parameters import HOLDING_FREQUENCY, pack_parameters
from gaitswarm.sim.kernel.walk import WalkResult, WalkSetup
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.description import TorqueActuator
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate
from tests.examples.walks import random_state, short_walk, torque_quadruped_files
from tests.sim.pinocchio_oracle import Oracle

pytestmark = pytest.mark.slow

WALK = short_walk(cycles=1.0, cycle_time=0.3)
DRIVES: Mapping[str, Mapping[str, float]] = {
    "joint-pd": {"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.8},
    "pid": {"P": 0.5, "I": 0.1, "D": 0.01},
    "fuzzy-pi": {
        "I": 0.3, "FI1R": 3000.0, "FI2R": 12000.0, "FOR": 1500.0, "FOMF": 2.0,
        "FW1": 0.2, "FW23": 0.9, "FW4": 0.5, "FW56": 0.2,
    },
}  # fmt: skip


@lru_cache
def made(*, line: bool = True, backlash: float = 0.0, rate: int = 1000) -> Robot:
    return load_robot(torque_quadruped_files(line=line, backlash=backlash, rate=rate))


def law_of(controller: str) -> ControlLaw:
    return control_law(controller, tuple(DRIVES[controller].items()))


def setup_of(robot: Robot, law: ControlLaw) -> WalkSetup:
    plan = plan_walk(robot, WALK, control_steps(robot)[1])
    assert plan is not None
    return plan(law)


@pytest.mark.variants("joint-pd", "fuzzy-pi")
@pytest.mark.parametrize("controller", DRIVES)
def test_every_controller_walks_and_both_kernels_agree(controller: str) -> None:
    design = DRIVES[controller]
    results = [
        simulate(WALK, controller, list(design), np.array([list(design.values())]), robot=made(),
                 backend=backend, log=True)
        for backend in ("native", "reference")
    ]  # fmt: skip
    fast, slow = results
    assert fast.outcome.statuses.tolist() == slow.outcome.statuses.tolist() == [Status.OK]
    assert 1.0 / fast.outcome.objectives[0, 4] > 0.05
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-9)
    for field in ("base_position", "joint_angle", "current", "voltage", "foot_force", "supply"):
        ours, theirs = (getattr(result.logs[0], field) for result in results)
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.variants
@pytest.mark.parametrize(
    "options", [{"rate": 2500}, {"rate": 500}, {"backlash": 0.02}, {"line": False}], ids=str
)
def test_both_kernels_agree_at_any_inner_rate_with_backlash_and_either_limit(
    options: dict[str, float],
) -> None:
    robot = made(**options)
    setup, (coding, _) = setup_of(robot, law_of("joint-pd")), control_steps(robot)
    fast, slow = (
        kernel_of(robot, backend).walk([setup], coding, log=True)[0]
        for backend in ("native", "reference")
    )
    assert fast.status is slow.status is Status.OK
    np.testing.assert_allclose(fast.sums, slow.sums, rtol=1e-9)
    assert fast.states is not None
    assert slow.states is not None
    np.testing.assert_allclose(fast.states, slow.states, rtol=1e-8, atol=1e-8)


def test_the_inner_rate_matters() -> None:
    ends = []
    for rate in (500, 1000, 2500):
        robot = made(rate=rate)
        setup, (coding, _) = setup_of(robot, law_of("joint-pd")), control_steps(robot)
        assert coding.inner_ticks == rate // 500
        ends.append(kernel_of(robot).walk([setup], coding, log=False)[0].end)
    assert np.abs(ends[0] - ends[1]).max() > 1e-6
    assert np.abs(ends[1] - ends[2]).max() > 1e-6


def bytes_of(result: WalkResult) -> tuple[object, ...]:
    assert result.states is not None
    return result.status, result.sums.tobytes(), result.end.tobytes(), result.states.tobytes()


@pytest.mark.variants("Target(lanes=4,*")
@pytest.mark.parametrize(
    "narrower", [Target(4, "x86-64-v3"), Target(2, "x86-64-v2"), Target(2)], ids=str
)
def test_a_walk_has_the_same_bits_at_every_vector_width(narrower: Target) -> None:
    if host_architecture() != X86 or target().lanes < narrower.lanes:
        narrower = target()
    robot = made()
    wide, narrow = native_kernel(robot), load_kernel(robot, compile_for=narrower)
    assert wide is not None
    assert narrow is not None
    setups = [setup_of(robot, law_of(controller)) for controller in DRIVES]
    coding, _ = control_steps(robot)
    ours, theirs = (kernel.walk(setups, coding, log=True) for kernel in (wide, narrow))
    assert list(map(bytes_of, ours)) == list(map(bytes_of, theirs))


def test_single_precision_differs_by_its_rounding() -> None:
    robot = made()
    coding, _ = control_steps(robot)
    setups = [setup_of(robot, law_of(controller)) for controller in DRIVES]
    single, double = (native_kernel(robot, precision) for precision in ("single", "double"))
    assert single is not None
    assert double is not None
    for ours, theirs in zip(
        single.walk(setups, coding, log=False), double.walk(setups, coding, log=False), strict=True
    ):
        assert ours.status is theirs.status is Status.OK
        # What a few units in a float's last place grow to: the body's way, and energy spent.
        np.testing.assert_allclose(ours.end[:3], theirs.end[:3], atol=2e-3)
        assert ours.sums[3] == pytest.approx(theirs.sums[3], rel=0.02)


@pytest.mark.variants
@pytest.mark.parametrize("line", [True, False], ids=["knee", "voltage"])
def test_accelerations_agree_with_pinocchio_in_random_states(line: bool) -> None:
    robot = made(line=line)
    model, oracle, a = physics_model(robot), Oracle(robot), robot.actuators()
    kinds = []
    for name in (name for leg in robot.description.legs for name in leg.actuators):
        kind = robot.description.actuators[name]
        assert isinstance(kind, TorqueActuator)
        kinds.append(kind)
    supply, rng = robot.description.supply, np.random.default_rng(5)
    p = pack_parameters(robot, WALK, 2e-4)
    springs = np.zeros(2 * robot.n_joints)
    limited, worst = 0, 0.0
    for _ in range(100):
        q, v = random_state(rng, robot.n_joints)
        v[6:] *= 5.0
        duty = rng.uniform(-1.0, 1.0, robot.n_joints)
        current, voltage, _, _, battery, found = (
            np.array(part).ravel() for part in model.observe(q, v, springs, duty, 0.0 * duty, p)
        )
        wanted = duty * np.array([kind.torque_limit for kind in kinds])
        k = np.array([kind.gear_ratio * kind.torque_constant for kind in kinds])
        resistance = np.array([kind.resistance for kind in kinds])
        power = float((resistance * (wanted / k) ** 2 + wanted * v[6:]).sum())
        # The battery's balance; where it cannot give the power, the load's optimum.
        if power < supply.voltage**2 / (4.0 * supply.resistance):
            balance = battery[0] * (supply.voltage - battery[0]) / supply.resistance
            assert balance == pytest.approx(power, rel=1e-9, abs=1e-6)
        assert battery[0] >= 0.5 * supply.voltage
        torque = np.array(
            [
                knee(wanted[j], v[6 + j], kinds[j].torque_limit)
                if line
                else of_voltage(wanted[j], v[6 + j], k[j], resistance[j], battery[0])
                for j in range(robot.n_joints)
            ]
        )
        limited += int((np.abs(torque - wanted) > 1e-9).sum())
        np.testing.assert_allclose(current, torque / k, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(voltage, resistance * current + k * v[6:], rtol=1e-9, atol=1e-9)
        tau = np.zeros(oracle.model.nv)
        damper = 2.0 * HOLDING_FREQUENCY * a.armature * v[6:]
        rub = np.clip(damper, -a.coulomb_friction, a.coulomb_friction)
        tau[oracle.v_index[6:]] = torque - a.viscous * v[6:] - rub
        external, _ = oracle.contact_forces(q, v)
        reference = pin.aba(oracle.model, oracle.data, oracle.q(q), oracle.v(v), tau, external)
        reference = reference[oracle.v_index]
        worst = max(worst, float(np.abs(found - reference).max() / np.abs(reference).max()))
    assert limited > 16
    assert worst < 1e-10


def knee(wanted: float, rate: float, limit: float) -> float:
    """Full torque up to 12 rad/s, none from 30 rad/s on, along the motion."""
    if wanted * rate <= 0.0 or abs(rate) <= 12.0:
        most = limit
    else:
        most = limit * max(0.0, (30.0 - abs(rate)) / (30.0 - 12.0))
    return float(np.clip(wanted, -most, most))


def of_voltage(wanted: float, rate: float, k: float, resistance: float, supply: float) -> float:
    """|R I + k omega| at the supply at most where torque is along the motion, or none is left."""
    if wanted * rate <= 0.0 and abs(resistance * wanted / k + k * rate) <= supply:
        return wanted
    most = max(0.0, k * (supply - k * rate) / resistance)
    least = min(0.0, k * (-supply - k * rate) / resistance)
    return float(np.clip(wanted, least, most))


@pytest.mark.variants
@pytest.mark.parametrize("timestep", [2e-4, 1e-4])
def test_electrical_energy_is_heat_and_what_the_bodies_gain(timestep: float) -> None:
    """Free flight without friction: of the integrands, power less heat is the mechanical work."""
    files = torque_quadruped_files()
    toml = files.toml.replace("viscous_friction = 0.02", "").replace("coulomb_friction = 0.1", "")
    robot = load_robot(files.model_copy(update={"toml": toml}))
    model, oracle, rng = physics_model(robot), Oracle(robot), np.random.default_rng(3)
    q, v = random_state(rng, robot.n_joints)
    v *= 0.3
    q[2], p = 10.0, pack_parameters(robot, SCENARIOS[0], timestep)
    duty, none = rng.uniform(-0.3, 0.3, robot.n_joints), np.zeros(robot.n_joints)

    def energy() -> float:
        potential = pin.computePotentialEnergy(oracle.model, oracle.data, oracle.q(q))
        return float(oracle.kinetic_energy(q, v) + potential)

    before, spent, heat = energy(), 0.0, 0.0
    for _ in range(round(0.04 / timestep)):
        q = np.array(model.drift(q, v, [], 0.5 * timestep)[0]).ravel()
        v, _, _, integrands, *_ = (np.array(x).ravel() for x in model.kick(q, v, [], duty, none, p))
        q = np.array(model.drift(q, v, [], 0.5 * timestep)[0]).ravel()
        spent += integrands[3] * timestep
        heat += integrands[7] * timestep
    gained = energy() - before
    assert heat > 0.1 * spent > 0.0
    assert gained == pytest.approx(spent - heat, rel=50.0 * timestep)


@lru_cache
def rotors_alone(rate: int) -> Robot:
    """Links that weigh nothing to speak of, on a body that nothing moves."""
    files = torque_quadruped_files(rate=rate)
    number = re.compile(r'(<mass value=|i[xyz]{2}=)"([^"]+)"')
    urdf = number.sub(lambda m: f'{m[1]}"{float(m[2]) * 1e-9!r}"', files.urdf)
    # No friction to speak of either, so that it shares its kernel with others.
    toml = re.sub(r"(viscous|coulomb)_friction = .*", r"\1_friction = 1e-15", files.toml)
    heavy = toml.replace('name = "quadruped"', 'name = "quadruped"\nbody_mass = 1e9', 1)
    return load_robot(files.model_copy(update={"toml": heavy, "urdf": urdf}))


@pytest.mark.variants("native-1000", "reference-1000")
@pytest.mark.parametrize("rate", [500, 1000, 2500])
@pytest.mark.parametrize("backend", ["native", "reference"])
def test_the_step_response_of_a_joint_is_that_of_a_held_pd_in_closed_form(
    rate: int, backend: str
) -> None:
    """J q'' = u, u = -Kp q - Kd q' held for T: x' = (A - B K) x, exactly from tick to tick."""
    robot = rotors_alone(rate)
    law, coding = ControlLaw(joint_pd=JointPd(2.0, 0.05)), control_steps(robot)[0]
    usual = setup_of(robot, law)
    parameters, start = usual.parameters.copy(), usual.start.copy()
    slices = kernel_of(robot).layout.slices  # type: ignore[attr-defined]
    parameters[slices["gravity"]] = 0.0
    start[2], start[7:] = 5.0, 0.3
    setup = dataclasses.replace(
        usual,
        start=start,
        parameters=parameters,
        desired=np.zeros_like(usual.desired),
        feed_forward=None,
    )
    (found,) = kernel_of(robot, backend).walk([setup], coding, log=True)  # type: ignore[arg-type]
    assert found.states is not None
    angle = split_states(robot, found.states).joint_angle
    period = 1.0 / rate
    for joint, inertia in enumerate(robot.actuators().armature):
        held = np.array([[1.0, period], [0.0, 1.0]]) - np.outer(
            [period**2 / (2.0 * inertia), period / inertia], [2.0, 0.05]
        )
        per_tick = np.linalg.matrix_power(held, rate // 500)
        state = np.array([0.3, 0.0])
        expected = []
        for _ in range(len(angle)):
            expected.append(state[0])
            state = per_tick @ state
        np.testing.assert_allclose(angle[:, joint], expected, atol=1e-6)
    # It swings through and settles: the gains are neither nothing nor overdamped.
    assert angle[:, 0].min() < -0.01
    assert np.abs(angle[-1]).max() < 0.15


def test_full_output_is_the_torque_limit() -> None:
    robot = made()
    usual = setup_of(robot, ControlLaw(proportional_gain=100 << 16))
    far = np.full_like(usual.desired, 20_000)
    coding, _ = control_steps(robot)
    setup = dataclasses.replace(usual, desired=far)
    (found,) = kernel_of(robot).walk([setup], coding, log=True)
    assert found.states is not None
    np.testing.assert_allclose(split_states(robot, found.states).duty[0], 1.0)
    assert found.peaks[0] == pytest.approx(float(12.0 / (9.0 * 0.06)), rel=1e-6)


def test_feed_forward_carries_the_robot_that_stands() -> None:
    """With nothing else but damping, the body stays up; without it, it sinks."""
    standing = short_walk(cycles=1.0, cycle_time=0.5, stride=1e-9, height=0.0)
    names, designs = ["Kp", "Kd", "feed_forward"], np.array([[0.0, 0.5, 1.0], [0.0, 0.5, 0.0]])
    result = simulate(standing, "joint-pd", names, designs, robot=made(), log=True)
    carried, dropped = (log.base_position[-1, 2] for log in result.logs if log is not None)
    begun = result.logs[0].base_position[0, 2] if result.logs[0] else 0.0
    assert carried > begun - 0.02
    assert dropped < begun - 0.03


def test_a_robot_with_dc_motors_refuses_a_joint_pd() -> None:
    design = DRIVES["joint-pd"]
    with pytest.raises(SimulationInputError, match=r"DC motors.*kind = \"torque\""):
        simulate(WALK, "joint-pd", list(design), np.array([list(design.values())]))
