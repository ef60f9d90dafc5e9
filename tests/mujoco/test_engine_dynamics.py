"""One instant of the robot in MuJoCo and in the kernel: masses, inertia, accelerations, contact."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.parameters import pack_parameters
from gaitswarm.sim.mujoco.forces import Gears, Ground
from gaitswarm.sim.robot import RobotChoice, RobotFiles, RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.walks import STEEP, random_state, torque_quadruped_files
from tests.mujoco.leapfrog import Leapfrog
from tests.mujoco.numbers import even_feet, model, own_gears, own_ground
from tests.mujoco.resistance import Floats, apply_forces, feet_of
from tests.mujoco.walker import LANDING_HORIZON

TIMESTEP = 2e-4
DATASHEET = RobotVariant(name="szabadka2")


def without_dry_friction(files: RobotFiles) -> RobotFiles:
    """The leapfrog over here has none."""
    return files.model_copy(update={"toml": files.toml.replace("coulomb_friction = 0.1", "")})


VARIANTS: dict[str, RobotChoice] = {
    "default": RobotVariant(),
    "linear zone": DATASHEET,
    "karnopp": DATASHEET.model_copy(update={"contact_law": "karnopp"}),
    "dead zone": DATASHEET.model_copy(update={"contact_law": "dead_zone"}),
    "stick": DATASHEET.model_copy(update={"contact_law": "stick"}),
    "default, stick and backlash": RobotVariant(contact_law="stick", backlash=(2.5, 1.0, 1.0)),
    "torque-controlled": without_dry_friction(torque_quadruped_files()),
    "torque-controlled, limited by voltage": without_dry_friction(
        torque_quadruped_files(line=False)
    ),
    "torque-controlled, backlash": without_dry_friction(torque_quadruped_files(backlash=0.02)),
}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("szabadka2")


def into(d: mujoco.MjData, q: Floats, v: Floats) -> Floats:
    """Give MuJoCo our state: quaternion w first, linear velocity in the world. -> attitude."""
    d.qpos[:] = np.concatenate([q[:3], q[[6, 3, 4, 5]], q[7:]])
    attitude: Floats = pin.Quaternion(q[3:7]).toRotationMatrix()
    d.qvel[:] = np.concatenate([attitude @ v[:3], v[3:]])
    return attitude


def test_the_exported_robot_has_our_masses_and_joints_in_our_order(robot: Robot) -> None:
    exported = model(robot)
    total = pin.computeTotalMass(pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer()))
    assert exported.body_mass.sum() == pytest.approx(total, rel=1e-14)
    assert model(robot, scenario=STEEP).body_mass.sum() == pytest.approx(total + 2.0, rel=1e-14)
    names = [exported.joint(k).name for k in range(1, exported.njnt)]
    assert names == list(robot.joint_names)
    np.testing.assert_array_equal(exported.dof_armature[6:], robot.actuators().armature)
    assert not exported.dof_armature[:6].any()
    assert not exported.dof_damping.any()


def test_joint_space_inertia_agrees_in_random_poses(robot: Robot) -> None:
    exported = model(robot)
    d = mujoco.MjData(exported)
    rigid = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    data = rigid.createData()
    joints = [rigid.joints[rigid.getJointId(name)] for name in robot.joint_names]
    order = [*range(6), *(joint.idx_v for joint in joints)]
    rng = np.random.default_rng(2)
    full = np.zeros((exported.nv, exported.nv))
    for _ in range(20):
        q, v = random_state(rng, robot.n_joints)
        attitude = into(d, q, v)
        mujoco.mj_forward(exported, d)
        mujoco.mj_fullM(exported, d, full)
        to_world = np.eye(exported.nv)
        to_world[:3, :3] = attitude
        theirs = np.empty(rigid.nq)
        theirs[[*range(7), *(joint.idx_q for joint in joints)]] = q
        ours = np.triu(pin.crba(rigid, data, theirs))
        ours = (ours + np.triu(ours, 1).T)[np.ix_(order, order)]
        ours[range(6, exported.nv), range(6, exported.nv)] += robot.actuators().armature
        np.testing.assert_allclose(to_world.T @ full @ to_world, ours, rtol=1e-9, atol=1e-12)


@pytest.mark.variants("default-normal-fast", "torque-controlled-steep")
@pytest.mark.parametrize("scenario", [SCENARIOS[0], STEEP], ids=lambda s: s.name)
@pytest.mark.parametrize(
    "variant",
    [pytest.param(name, marks=[pytest.mark.slow] * (name != "default")) for name in VARIANTS],
)
def test_driven_on_the_ground_both_engines_accelerate_alike(
    variant: str, scenario: Scenario
) -> None:
    """Rigid bodies, motors, gears, battery, contact, load and slope, each computed twice.

    From creeping to violent, so that every law of friction is seen on both sides of its threshold.
    """
    robot = load_robot(VARIANTS[variant])
    ours = physics_model(robot)
    parameters = pack_parameters(robot, scenario, TIMESTEP)
    exported = model(robot, scenario=scenario)
    d = mujoco.MjData(exported)
    ground = own_ground(robot)
    feet = [int(exported.site_bodyid[exported.site(leg.foot).id]) for leg in robot.description.legs]
    friction = np.array([contact.friction for contact in robot.contacts()])
    rng = np.random.default_rng(7)
    held, slid, worst = 0, 0, 0.0
    for _ in range(150):
        q, v = random_state(rng, robot.n_joints)
        v *= 10.0 ** rng.uniform(-4.0, 0.0)
        gears = own_gears(robot, q[7:])
        remembered = remember_anything(rng, gears, ground, v[6:])
        duty = rng.uniform(-1.0, 1.0, robot.n_joints)
        disturbance = rng.normal(size=robot.n_joints)
        state = q, v, remembered, duty, disturbance, parameters
        found = np.array(ours.observe(*state)[-1]).ravel()
        attitude = into(d, q, v)
        mujoco.mj_step1(exported, d)
        d.qfrc_applied[:6] = 0.0
        d.qfrc_applied[6:] = gears.actuate(duty, q[7:], v[6:])[1] + disturbance
        forces, _ = ground.forces(*feet_of(d), 0.0)
        apply_forces(exported, d, feet, forces)
        limit = friction * forces[:, 2]
        rub = np.hypot(forces[:, 0], forces[:, 1])
        slid += int((rub > 0.99 * limit)[limit > 0.0].sum())
        held += int((rub < 0.99 * limit).sum())
        mujoco.mj_forward(exported, d)
        # Pinocchio's base acceleration is the twist's derivative in the base's own frame.
        twist = attitude.T @ d.qacc[:3] - np.cross(v[3:6], v[:3])
        expected = np.concatenate([twist, d.qacc[3:]])
        worst = max(worst, float(np.abs(found - expected).max() / np.abs(expected).max()))
    assert min(held, slid) > 8
    assert worst < 1e-9


@pytest.mark.variants("default-0.0004")
@pytest.mark.parametrize("timestep", [1.0 / 2500, 1.0 / 40_000])
@pytest.mark.parametrize(
    "variant",
    [pytest.param(name, marks=[pytest.mark.slow] * (name != "default")) for name in VARIANTS],
)
def test_a_kick_changes_velocities_and_what_is_carried_alike(variant: str, timestep: float) -> None:
    """The linearly implicit step, by limbs here and by MuJoCo's whole inertia matrix there."""
    robot = load_robot(VARIANTS[variant])
    ours = physics_model(robot)
    parameters = pack_parameters(robot, STEEP, timestep)
    exported = model(robot, scenario=STEEP)
    d = mujoco.MjData(exported)
    rng = np.random.default_rng(11)
    landings, carried, damped, worst = 0, 0.0, 0.0, 0.0
    for _ in range(100):
        q, v = random_state(rng, robot.n_joints)
        v *= 10.0 ** rng.uniform(-4.0, 0.0)
        into(d, q, v)
        mujoco.mj_forward(exported, d)
        # A foot comes down or lifts off about now.
        foot = rng.integers(len(robot.legs))
        height, rising = (part[foot, 2] for part in feet_of(d))
        q[2] += robot.contacts()[foot].sole - height
        q[2] += rng.uniform(-2.0, 2.0) * LANDING_HORIZON * rising
        gears, ground = own_gears(robot, q[7:]), own_ground(robot)
        remembered = remember_anything(rng, gears, ground, v[6:])
        duty = rng.uniform(-1.0, 1.0, robot.n_joints)
        disturbance = rng.normal(size=robot.n_joints)
        inputs = q, v, remembered, duty, disturbance, parameters
        out = [np.array(part).ravel() for part in ours.kick(*inputs)]
        faster, after, current, landing = *out[:3], out[-1]
        explicit = timestep * np.array(ours.observe(*inputs)[-1]).ravel()
        attitude = into(d, q, v)
        leapfrog = Leapfrog(exported, d, robot, gears, ground)
        middle = leapfrog.kick(duty, timestep, disturbance)
        expected = np.concatenate([attitude.T @ d.qvel[:3], d.qvel[3:]])
        gain = np.abs(expected - v).max()
        worst = max(worst, float(np.abs(faster - expected).max() / gain))
        damped = max(damped, float(np.abs(expected - v - explicit).max() / gain))
        np.testing.assert_allclose(after, internal_state_of(gears, ground), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(current, middle.current, rtol=1e-9, atol=1e-9)
        assert landing == leapfrog.landing(LANDING_HORIZON)
        landings += int(landing.item())
        carried = max(carried, np.abs(after - remembered).max(initial=0.0))
    assert worst < 1e-9
    assert damped > 1e-3
    assert carried > 0.0 or remembered.size == 0
    assert 5 < landings < 95


def remember_anything(
    rng: np.random.Generator, gears: Gears, ground: Ground, rates: Floats
) -> Floats:
    """Give gears and ground any past, with rotors inside the play and beyond; our x of it."""
    if gears.loose:
        gears.angles = gears.angles + rng.uniform(-0.03, 0.03, len(rates))
        gears.rates = rates + rng.normal(size=len(rates))
    if ground.law == "stick":
        ground.memory = rng.normal(size=ground.memory.shape) * 5e-3
    return internal_state_of(gears, ground)


def internal_state_of(gears: Gears, ground: Ground) -> Floats:
    """The kernel's internal state: rotors, then springs along the ground."""
    return np.concatenate([*gears.memory, ground.memory.ravel(), []])


def test_mujocos_own_contact_can_be_our_spring_and_damper(robot: Robot) -> None:
    """Its normal force is ours; below the friction's limit, its drag is the one asked for."""
    scenario = SCENARIOS[0]
    feet = even_feet(robot, scenario)
    exported = model(robot, scenario=scenario, feet=feet)
    d = mujoco.MjData(exported)
    ground, legs = own_ground(robot), robot.description.legs
    rng = np.random.default_rng(5)
    q, _ = random_state(rng, robot.n_joints)
    seen = 0
    for _ in range(200):
        q[:] = 0.0
        q[2], q[6] = rng.uniform(0.0, 0.01), 1.0
        into(d, q, rng.normal(size=6 + robot.n_joints) * 0.03)
        mujoco.mj_forward(exported, d)
        position, velocity = d.sensordata.reshape(2, len(legs), 3)
        expected, _ = ground.forces(position, velocity, 0.0)
        for k in range(d.ncon):
            (sole,) = (name for name in _geoms(exported, d.contact[k]) if name != "ground")
            leg = [f"{leg.foot}_sole" for leg in legs].index(sole)
            wrench = np.zeros(6)
            mujoco.mj_contactForce(exported, d, k, wrench)
            force = d.contact[k].frame.reshape(3, 3).T @ wrench[:3] * _upwards(d.contact[k])
            assert force[2] == pytest.approx(expected[leg, 2], rel=0.01, abs=0.5)
            point = _velocity_of(exported, d, d.contact[k].pos, legs[leg].foot)
            pull = -feet.drags[leg] * point[:2]
            if np.hypot(*pull) < 0.8 * robot.description.contact.friction * force[2]:
                np.testing.assert_allclose(force[:2], pull, rtol=0.05, atol=1.0)
                seen += 1
    assert seen > 100


def _geoms(m: mujoco.MjModel, contact: mujoco.MjContact) -> list[str]:
    return [m.geom(int(geom)).name for geom in contact.geom]


def _upwards(contact: mujoco.MjContact) -> float:
    """Contact forces are given as they act on the second geom, along a normal towards it."""
    return float(np.sign(contact.frame[2]))


def _velocity_of(m: mujoco.MjModel, d: mujoco.MjData, point: Floats, foot: str) -> Floats:
    jacobian = np.zeros((3, m.nv))
    mujoco.mj_jac(m, d, jacobian, None, point, int(m.site_bodyid[m.site(foot).id]))
    velocity: Floats = jacobian @ d.qvel
    return velocity
