"""Kinematics and energy of the links against Pinocchio."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel.dynamics.articulated_body import LinkState, body_of, body_state
from gaitswarm.sim.kernel.dynamics.limb import links_of, turns
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.dynamics.spatial import (
    Matrix,
    Rotation,
    add,
    apply,
    cross,
    dot,
    inverse,
    matrix,
    scale,
    vector,
)
from gaitswarm.sim.kernel.parameters import gravity_on, pack_parameters
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import Robot
from tests.examples.walks import STEEP, random_state
from tests.sim.pinocchio_oracle import ROBOTS, Oracle, robot_named

pytestmark = pytest.mark.slow

STATES = 100


class Found:
    """Our tree in STATES random states: (S, ...), by link (base first) where there is a B.

    position (S, B, 3) [m]; rotation (S, B, 3, 3) to the world; velocity (S, B, 6) linear and
    angular in the link's own frame; kinetic energy of links and of rotors, potential energy (S,)
    [J]; centre of mass (S, 3).
    """

    def __init__(self, robot: Robot, q: Floats, v: Floats) -> None:
        links = 1 + robot.n_joints
        tree = _symbolic_tree(robot)
        parts = [np.array(part).T for part in tree.map(len(q))(q.T, v.T)]
        self.height, self.centre = parts[0], parts[5]
        self.kinetic, self.rotors, self.potential = parts[4].T
        self.position = parts[1].reshape(-1, links, 3)
        self.rotation = parts[2].reshape(-1, links, 3, 3)
        self.velocity = parts[3].reshape(-1, links, 6)


def _symbolic_tree(robot: Robot) -> Any:
    """A CasADi function (q, v) -> what `Found` holds, of the model's own links and parameters."""
    model = physics_model(robot)
    packed = pack_parameters(robot, STEEP, 2e-4)
    p = {name: packed[where].tolist() for name, where in model.layout.slices.items()}
    inputs = ca.SX.sym("q", 7 + robot.n_joints), ca.SX.sym("v", 6 + robot.n_joints)
    q, v = ([s[k] for k in range(s.numel())] for s in inputs)
    # The model itself has no use for the links' x and y; height is its own.
    states, positions, bodies = (
        [body_state(q, v, p["gravity"])],
        [(q[0], q[1], q[2])],
        [body_of(p)],
    )
    for n, limb in enumerate(limbs_of(robot)):
        angles, rates = q[7 + 3 * n : 10 + 3 * n], v[6 + 3 * n : 9 + 3 * n]
        at, state = positions[0], states[0]
        for link in links_of(limb, *turns(limb, angles), rates):
            at, state = add(at, apply(_to_world(state), link.offset)), state.carries(link)
            states.append(state)
            positions.append(at)
            bodies.append(link.body)
    rotations = [_to_world(state) for state in states]
    kinetic, rotors, mass, moment = 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
    for body, state, rotation, at in zip(bodies, states, rotations, positions, strict=True):
        linear, angular = state.velocity.linear, state.velocity.angular
        kinetic += 0.5 * body.mass * dot(linear, linear) + dot(linear, cross(angular, body.moment))
        kinetic += 0.5 * dot(angular, apply(body.angular, angular))
        mass += body.mass
        moment = add(moment, scale(body.mass, at), apply(rotation, body.moment))
    for armature, rate in zip(robot.actuators().armature.tolist(), v[6:], strict=True):
        rotors += 0.5 * armature * rate * rate
    outputs = [
        [state.height for state in states],
        [x for position in positions for x in position],
        [x for rotation in rotations for row in rotation for x in row],
        [x for s in states for x in (*s.velocity.linear, *s.velocity.angular)],
        [kinetic, rotors, -dot(p["gravity"], moment)],
        list(scale(1.0 / mass, moment)),
    ]
    return ca.Function("tree", list(inputs), [ca.vertcat(*output) for output in outputs])


def _to_world(state: LinkState) -> Matrix:
    """A link's rotation: its rows are the world's axes in the link's frame."""
    return state.ahead, cross(state.up, state.ahead), state.up


@pytest.fixture(scope="module", params=ROBOTS)
def oracle(request: pytest.FixtureRequest) -> Oracle:
    oracle = Oracle(robot_named(request.param))
    oracle.carry(STEEP.load)
    oracle.model.gravity.linear = gravity_on(STEEP.slope, STEEP.slope_direction)
    return oracle


@pytest.fixture(scope="module")
def states(oracle: Oracle) -> list[tuple[Floats, Floats]]:
    rng = np.random.default_rng(19)
    return [random_state(rng, oracle.robot.n_joints) for _ in range(STATES)]


@pytest.fixture(scope="module")
def found(oracle: Oracle, states: list[tuple[Floats, Floats]]) -> Found:
    q, v = (np.array(part) for part in zip(*states, strict=True))
    return Found(oracle.robot, q, v)


def same(ours: Floats | float, theirs: Floats | float) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-10)


@pytest.mark.variants("szabadka2")
def test_every_link_is_where_pinocchio_has_it(
    oracle: Oracle, states: list[tuple[Floats, Floats]], found: Found
) -> None:
    assert len(found.position) == STATES
    for k, (q, _) in enumerate(states):
        pin.forwardKinematics(oracle.model, oracle.data, oracle.q(q))
        places = [oracle.data.oMi[joint] for joint in (1, *oracle.joints)]
        same(found.position[k], np.array([place.translation for place in places]))
        same(found.height[k], np.array([place.translation[2] for place in places]))
        same(found.rotation[k], np.array([place.rotation for place in places]))


@pytest.mark.variants("szabadka2", "turned quadruped")
def test_every_link_moves_as_in_pinocchio(
    oracle: Oracle, states: list[tuple[Floats, Floats]], found: Found
) -> None:
    for k, (q, v) in enumerate(states):
        pin.forwardKinematics(oracle.model, oracle.data, oracle.q(q), oracle.v(v))
        twists = [oracle.data.v[joint].vector for joint in (1, *oracle.joints)]
        same(found.velocity[k], np.array(twists))


@pytest.mark.variants("szabadka2", "turned quadruped")
def test_energy_is_pinocchios_with_a_load_and_on_a_slope(
    oracle: Oracle, states: list[tuple[Floats, Floats]], found: Found
) -> None:
    links = pin.Model(oracle.model)
    links.armature = np.zeros(links.nv)
    data = links.createData()
    for k, (q, v) in enumerate(states):
        same(found.kinetic[k], pin.computeKineticEnergy(links, data, oracle.q(q), oracle.v(v)))
        same(found.kinetic[k] + found.rotors[k], oracle.kinetic_energy(q, v))
        same(found.potential[k], pin.computePotentialEnergy(links, data, oracle.q(q)))


@pytest.mark.variants("szabadka2", "turned quadruped")
def test_the_centre_of_mass_is_pinocchios(
    oracle: Oracle, states: list[tuple[Floats, Floats]], found: Found
) -> None:
    for k, (q, _) in enumerate(states):
        same(found.centre[k], pin.centerOfMass(oracle.model, oracle.data, oracle.q(q)))


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8)]
)
@pytest.mark.parametrize("symmetric", [True, False])
def test_vectors_and_tensors_turn_as_by_pinocchios_rotation(
    axis: tuple[float, float, float], *, symmetric: bool
) -> None:
    rng = np.random.default_rng(3)
    rest = pin.AngleAxis(0.7, np.array([0.0, 0.6, 0.8])).matrix()
    for angle in (0.0, 0.4, -2.0, 3.0):
        rotation = Rotation(matrix(rest), axis, np.sin(angle), np.cos(angle))
        to_parent = rest @ pin.AngleAxis(angle, np.array(axis)).matrix()
        a, m = rng.normal(size=3), rng.normal(size=(3, 3))
        m = m + m.T if symmetric else m
        same(np.array(rotation.inwards(vector(a))), to_parent @ a)
        same(np.array(rotation.outwards(vector(a))), to_parent.T @ a)
        same(np.array(rotation.tensor_inwards(matrix(m))), to_parent @ m @ to_parent.T)


def test_a_symmetric_matrix_is_inverted_by_its_adjugate() -> None:
    for m in np.random.default_rng(4).normal(size=(20, 3, 3)):
        definite = m @ m.T + np.eye(3)
        same(np.array(inverse(matrix(definite))), np.linalg.inv(definite))
