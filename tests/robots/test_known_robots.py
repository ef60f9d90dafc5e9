"""Published robots, unedited: `robot init`, kinematics, inertia, acceleration, standing."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from gaitswarm.cli.main import run
from gaitswarm.robots import init_robot, standing_drive, standing_scenario
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.kernel.dynamics.physics_step import PhysicsModel, physics_model
from gaitswarm.sim.kernel.parameters import pack_parameters
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from tests.examples.walks import random_state, short_walk
from tests.robots.known import BIPED, CENTAURO, FOLDER, QUADRUPEDS, urdf_of
from tests.sim.pinocchio_oracle import Oracle

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]

STATES = 20


def read(folder: Path) -> Robot:
    """A robot's folder."""
    toml, urdf = (
        (folder / f"robot.{kind}").read_text(encoding="utf-8") for kind in ("toml", "urdf")
    )
    return parse_robot(toml, urdf)


@pytest.fixture(scope="module", params=QUADRUPEDS)
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot made from its unedited URDF."""
    path = tmp_path_factory.mktemp("known") / request.param
    init_robot(urdf_of(QUADRUPEDS[request.param]), path)
    return path


@pytest.fixture(scope="module")
def robot(folder: Path) -> Robot:
    return read(folder)


@pytest.fixture(scope="module")
def model(robot: Robot) -> PhysicsModel:
    return physics_model(robot)


@pytest.fixture(scope="module")
def whole(folder: Path, robot: Robot) -> tuple[pin.Model, Floats]:
    """Pinocchio's model of the file, no joint of it held by us; and where held joints are."""
    text = (folder / "robot.urdf").read_text(encoding="utf-8")
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    place = pin.neutral(model)
    for name, angle in robot.description.held_joints.items():
        turn(model, place, name, angle)
    return model, place


def turn(model: pin.Model, q: Floats, name: str, angle: float) -> None:
    """Set a joint of Pinocchio's; one without ends has a cosine and a sine."""
    joint = model.joints[model.getJointId(name)]
    at = joint.idx_q
    q[at : at + joint.nq] = [math.cos(angle), math.sin(angle)] if joint.nq == 2 else [angle]


@pytest.mark.variants("a1", "solo12")
def test_it_has_four_legs_and_its_walks_can_be_planned(folder: Path, robot: Robot) -> None:
    assert len(robot.legs) == 4
    assert sorted(leg.phase for leg in robot.description.legs) == [0.0, 0.0, 0.5, 0.5]
    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    assert [walk["name"] for walk in job["scenarios"]] == ["slow", "fast"]
    for walk in job["scenarios"]:
        require_reachable(robot, Scenario.model_validate(walk))


def test_its_feet_are_where_pinocchio_has_them(
    robot: Robot, whole: tuple[pin.Model, Floats]
) -> None:
    model, q = whole
    data = model.createData()
    rng = np.random.default_rng(1)
    for _ in range(STATES):
        angles = rng.uniform(-math.pi, math.pi, robot.n_joints)
        for name, angle in zip(robot.joint_names, angles, strict=True):
            turn(model, q, name, angle)
        pin.framesForwardKinematics(model, data, q)
        for k, (leg, said) in enumerate(zip(robot.legs, robot.description.legs, strict=True)):
            found = leg.foot(angles[3 * k : 3 * k + 3].tolist())
            expected = data.oMf[model.getFrameId(said.foot)].translation
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10)


def test_its_bodies_have_the_inertia_that_pinocchio_reads(
    robot: Robot, whole: tuple[pin.Model, Floats]
) -> None:
    """With held joints locked by Pinocchio, in our place of them."""
    model, q = whole
    held = [model.getJointId(name) for name in robot.description.held_joints]
    locked = pin.buildReducedModel(model, held, q) if held else model
    assert locked.nv == 6 + robot.n_joints
    bodies = robot.urdf.bodies
    carried = {joint.name: joint.child for joint in robot.urdf.joints}
    for name, theirs in zip(list(locked.names)[1:], list(locked.inertias)[1:], strict=True):
        ours = bodies[carried[name]] if name in carried else robot.urdf.body
        assert ours.mass == pytest.approx(theirs.mass, rel=1e-10)
        np.testing.assert_allclose(ours.centre, theirs.lever, rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(ours.rotational, theirs.inertia, rtol=1e-10, atol=1e-10)


@pytest.mark.variants("a1", "solo12")
def test_its_accelerations_and_mass_matrix_are_pinocchios(
    robot: Robot, model: PhysicsModel
) -> None:
    """Random torques on the joints: accelerations, and what a newton-metre changes of them."""
    oracle, rng = Oracle(robot), np.random.default_rng(7)
    p = pack_parameters(robot, short_walk(), 2e-4)
    actuators, n = robot.actuators(), robot.n_joints

    def accelerations(q: Floats, v: Floats, torque: Floats) -> tuple[Floats, Floats]:
        """Ours, and Pinocchio's for the same torques on links and forces on soles."""
        current, *_, found = (
            np.array(part).ravel() for part in model.observe(q, v, [], np.zeros(n), torque, p)
        )
        external, _ = oracle.contact_forces(q, v)
        tau = np.zeros(oracle.model.nv)
        tau[oracle.v_index[6:]] = actuators.torque * current - actuators.viscous * v[6:] + torque
        reference = pin.aba(oracle.model, oracle.data, oracle.q(q), oracle.v(v), tau, external)
        return found, reference[oracle.v_index]

    for state in range(STATES):
        q, v = random_state(rng, n)
        found, reference = accelerations(q, v, rng.normal(size=n))
        np.testing.assert_allclose(found, reference, rtol=0.0, atol=1e-10 * abs(reference).max())
        if state == 0:
            matrix = np.triu(pin.crba(oracle.model, oracle.data, oracle.q(q)))
            matrix = (matrix + np.triu(matrix, 1).T)[np.ix_(oracle.v_index, oracle.v_index)]
            rest, _ = accelerations(q, v, np.zeros(n))
            columns = [accelerations(q, v, unit)[0] - rest for unit in np.eye(n)]
            shares = matrix @ np.transpose(columns)
            # Accelerations cancel in their difference: rounding is of the size of the larger ones.
            room = 1e-10 * max(1.0, float(abs(rest).max() * abs(matrix).max()))
            np.testing.assert_allclose(shares, np.eye(6 + n)[:, 6:], rtol=0.0, atol=room)


@pytest.mark.variants("a1", "solo12")
def test_it_stands_with_its_weight_on_all_feet(robot: Robot) -> None:
    """In the interpreter, which walks the same second as a compiled kernel."""
    controller, design = standing_drive(robot)
    stood = simulate(
        standing_scenario(robot),
        controller,
        list(design),
        np.array([list(design.values())]),
        robot=robot,
        log=True,
        backend="reference",
    )
    # It does not get ahead, and so is no walk; what ends one early would be seen.
    assert stood.outcome.statuses.tolist() == [Status.STALLED]
    (log,) = stood.logs
    assert log is not None
    last = log.foot_force[-len(log.time) // 5 :, :, 2].mean(axis=0)
    weight = robot.mass * 9.81
    assert last.sum() == pytest.approx(weight, rel=0.01)
    assert (last > 0.05 * weight).all()
    # It neither tilts nor sinks, by more than its soles and motors yield.
    assert abs(log.base_orientation[-1, :2]).max() < 0.03
    sunk = log.base_position[0, 2] - log.base_position[-1, 2]
    assert abs(sunk) < 0.1 * log.base_position[0, 2]


def test_other_files_of_the_package_are_refused_with_the_supported_kinds() -> None:
    """Arms, hands, humanoids with legs of six joints, quadrotors, wheels, objects."""
    urdf_of(BIPED)
    legged = {FOLDER / file for file in (*QUADRUPEDS.values(), BIPED, CENTAURO)}
    others = sorted(set(FOLDER.glob("**/*.urdf")) - legged)
    assert len(others) > 40
    for path in others:
        with pytest.raises(RobotFileError, match=r"^robot\.urdf") as refused:
            propose_robot(path.read_text(encoding="utf-8"), path.stem)
        assert any(
            said in str(refused.value)
            for said in ("legs need three revolute joints", "no <link>", "seems to point up")
        ), (path.name, str(refused.value))


def test_a_centaur_walks_on_three_joints_of_each_leg(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["robot", "init", str(urdf_of(CENTAURO)), "--output", str(tmp_path / "it")]) == 0
    said = capsys.readouterr().out
    assert "'torso_yaw' is held at 0 rad" in said and "seems to face y" not in said
    robot = read(tmp_path / "it")
    assert len(robot.legs) == 4 and robot.n_joints == 12
    assert {"ankle_yaw_1", "j_wheel_1"} <= set(robot.description.held_joints)


def test_a_biped_is_made_with_a_warning_that_it_may_not_stand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["robot", "init", str(urdf_of(BIPED)), "--output", str(tmp_path / "bolt")]) == 0
    assert "two legs" in capsys.readouterr().out
    assert len(read(tmp_path / "bolt").legs) == 2
