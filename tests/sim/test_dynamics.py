"""The symbolic physics: accelerations against Pinocchio's, and conservation of energy."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.kernel.dynamics.physics_step import PhysicsModel, physics_model
from gaitswarm.sim.kernel.parameters import gravity_on, pack_parameters
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.walks import random_state, short_walk
from tests.sim.pinocchio_oracle import ROBOTS, Oracle, robot_named

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return robot_named(request.param)


@pytest.fixture(scope="module")
def model(robot: Robot) -> PhysicsModel:
    return physics_model(robot)


@pytest.mark.variants("szabadka2", "turned quadruped")
def test_accelerations_agree_with_pinocchio_in_random_states(
    robot: Robot, model: PhysicsModel
) -> None:
    oracle = Oracle(robot)
    rng = np.random.default_rng(7)
    actuators, supply = robot.actuators(), robot.description.supply
    slope = short_walk(slope=20.0)
    oracle.model.gravity.linear = gravity_on(slope.slope)
    p = pack_parameters(robot, slope, 2e-4)
    touching, worst = 0, 0.0
    for _ in range(60):
        q, v = random_state(rng, robot.n_joints)
        duty = rng.uniform(-1.0, 1.0, robot.n_joints)
        disturbance = rng.normal(size=robot.n_joints)
        current, voltage, load, forces, battery, found = (
            np.array(part).ravel() for part in model.observe(q, v, [], duty, disturbance, p)
        )
        # The battery's equation, solved here by its fixed point instead of in closed form.
        assert battery[0] == pytest.approx(
            supply.voltage - supply.resistance * float(duty @ current), rel=1e-12
        )
        expected = (duty * battery[0] - actuators.torque * v[6:]) / actuators.resistance
        np.testing.assert_allclose(current, expected, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(voltage, duty * battery[0], rtol=1e-12)
        torque = actuators.torque * current - actuators.viscous * v[6:] + disturbance
        external, world = oracle.contact_forces(q, v)
        touching += int((world[:, 2] > 0).any())
        tau = np.zeros(oracle.model.nv)
        tau[oracle.v_index[6:]] = torque
        reference = pin.aba(oracle.model, oracle.data, oracle.q(q), oracle.v(v), tau, external)
        reference = reference[oracle.v_index]
        worst = max(worst, float(np.abs(found - reference).max() / np.abs(reference).max()))
        np.testing.assert_allclose(forces.reshape(-1, 3), world, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(
            load, torque - actuators.armature * reference[6:], rtol=1e-7, atol=1e-7
        )
    assert touching > 12
    assert worst < 1e-10


@pytest.mark.variants("szabadka2")
def test_a_load_is_a_rigid_mass_on_the_body(robot: Robot, model: PhysicsModel) -> None:
    oracle = Oracle(robot)
    rng = np.random.default_rng(3)
    loaded = SCENARIOS[2]
    assert loaded.load == 2.0
    oracle.carry(loaded.load)
    p = pack_parameters(robot, loaded, 2e-4)
    actuators, still = robot.actuators(), np.zeros(robot.n_joints)
    for _ in range(20):
        q, v = random_state(rng, robot.n_joints)
        q[2] = 5.0
        current, *_, found = (
            np.array(part).ravel() for part in model.observe(q, v, [], still, still, p)
        )
        tau = np.zeros(oracle.model.nv)
        tau[oracle.v_index[6:]] = actuators.torque * current - actuators.viscous * v[6:]
        reference = pin.aba(oracle.model, oracle.data, oracle.q(q), oracle.v(v), tau)
        np.testing.assert_allclose(found, reference[oracle.v_index], rtol=1e-9, atol=1e-9)


def lossless() -> Robot:
    """The robot without friction, and with motors that neither drive nor brake."""
    folder = resources.files("gaitswarm.sim.robot") / "szabadka2"
    toml = (folder / "robot.toml").read_text(encoding="utf-8")
    for line, replacement in (
        ("efficiency = 0.6", "efficiency = 1.0"),
        ("resistance = 4.09", "resistance = 1e9"),
        ("resistance = 1.9 ", "resistance = 1e9 "),
        ("resistance = 1.9\n", "resistance = 1e9\n"),
        ("viscous_friction = 3.7659e-7", "viscous_friction = 0.0"),
        ("viscous_friction = 1.1851415e-6", "viscous_friction = 0.0"),
    ):
        toml = toml.replace(line, replacement)
    return parse_robot(toml, (folder / "robot.urdf").read_text(encoding="utf-8"))


def energy_drift(robot: Robot, timestep: float) -> float:
    """Relative drift of the energy over a tumbling free flight of 0.05 s."""
    model, oracle = physics_model(robot), Oracle(robot)
    q, v = random_state(np.random.default_rng(11), robot.n_joints)
    q[2] = 10.0
    p = pack_parameters(robot, SCENARIOS[0], timestep)

    def energy() -> float:
        potential = pin.computePotentialEnergy(oracle.model, oracle.data, oracle.q(q))
        return float(oracle.kinetic_energy(q, v) + potential)

    before = energy()
    for _ in range(round(0.05 / timestep)):
        still = np.zeros(18)
        q = np.array(model.drift(q, v, [], 0.5 * timestep)[0]).ravel()
        v = np.array(model.kick(q, v, [], still, still, p)[0]).ravel()
        q = np.array(model.drift(q, v, [], 0.5 * timestep)[0]).ravel()
    assert abs(np.linalg.norm(q[3:7]) - 1.0) < 1e-12
    return abs(energy() - before) / abs(before)


def test_energy_is_conserved_without_contact_and_friction() -> None:
    robot = lossless()
    assert not robot.actuators().viscous.any()
    coarse, fine = energy_drift(robot, 4e-4), energy_drift(robot, 2e-4)
    assert coarse < 1e-3
    assert fine < 0.6 * coarse
