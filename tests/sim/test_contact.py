"""Resistances of the contact laws: forces of the ground on a slightly faster foot."""

from __future__ import annotations

from typing import Any, Final, get_args

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.kernel.dynamics.articulated_body import LinkState
from gaitswarm.sim.kernel.dynamics.contact import FRICTION, foot_on_ground
from gaitswarm.sim.kernel.dynamics.spatial import Motion
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS
from gaitswarm.sim.robot.bounds import ContactLaw

Floats = NDArray[np.float64]

LAWS: Final[tuple[ContactLaw, ...]] = get_args(ContactLaw)

GROUND: Final = {
    "stiffness": 10_000.0,
    "damping": 150.0,
    "sole": 0.01,
    "friction": 0.8,
    "slip_velocity": 0.05,
    "stick_velocity": 0.01,
    "stick_stiffness": 3000.0,
    "stick_damping": 40.0,
}
TIMESTEP: Final = 4e-4
SURE: Final = 0.0
"""A mobility by which no friction stops a foot."""

AT: Final = (0.01, 0.12, -0.02)
TURNED = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0].T
AHEAD, UP = TURNED[0], TURNED[2]
"""The world's x axis and the ground's normal in the link's frame."""


def link_at(velocity: Any, up: Any, ahead: Any, height: Any) -> LinkState:
    """A link that does not turn; its origin over the ground [m] and velocity [m/s]."""
    still = (0.0, 0.0, 0.0)
    return LinkState(
        velocity=Motion(velocity, still),
        up=up,
        ahead=ahead,
        gravity=still,
        height=height,
        bias=Motion(still, still),
        tensor=(still, still, still),
    )


class Ground:
    """A law of contact as numbers: a foot 2 mm deep at a velocity of the link in its own frame."""

    def __init__(self, law: ContactLaw, mobility: float = SURE, timestep: float = TIMESTEP) -> None:
        v, depth = ca.SX.sym("v", 3), ca.SX.sym("depth")
        ahead, up = (tuple(axis.tolist()) for axis in (AHEAD, UP))
        height = GROUND["sole"] - depth - sum(a * b for a, b in zip(up, AT, strict=True))
        link = link_at((v[0], v[1], v[2]), up, ahead, height)
        self.foot = foot_on_ground(link, AT, GROUND, mobility)
        carried = (0.0005, -0.0002)[: CONTACT_LAWS[law].internal_state_size]
        reaction = FRICTION[law](self.foot, GROUND, carried, timestep)
        resistance = ca.vertcat(*(ca.horzcat(*row) for row in reaction.resistance))
        outputs = [ca.vertcat(*reaction.force), resistance, self.foot.normal, self.foot.damping]
        self._function = ca.Function("ground", [v, depth], outputs)

    def at(self, velocity: Floats, depth: float = 0.002) -> tuple[Floats, Floats, float, float]:
        """Force, resistance, normal force and its damping."""
        force, resistance, normal, damping = self._function(velocity, depth)
        return np.array(force).ravel(), np.array(resistance), float(normal), float(damping)

    def slope(self, velocity: Floats) -> Floats:
        """-dF/dv by central differences."""
        h = 1e-7
        steps = h * np.eye(3)
        columns = [(self.at(velocity - d)[0] - self.at(velocity + d)[0]) / (2 * h) for d in steps]
        return np.array(columns).T


def world(ahead: float, left: float, up: float) -> Floats:
    """A velocity in the link's frame."""
    return ahead * AHEAD + left * np.cross(UP, AHEAD) + up * UP


SMOOTH: Final = {
    "slides": world(0.3, -0.2, 0.01),
    "creeps": world(0.02, 0.015, -0.01),
    "rests": world(0.004, -0.003, 0.002),
}
"""Velocities away from the laws' kinks: beyond v_lin, between v_d and v_lin, below v_d."""


def expected_resistance(ground: Ground, velocity: Floats, *, follows_normal: bool) -> Floats:
    """-dF/dv without the part by which friction follows the normal force."""
    force, _, normal, damping = ground.at(velocity)
    friction = force - normal * UP
    share = np.outer(friction / normal, damping * UP) if follows_normal else 0.0
    return ground.slope(velocity) - share


@pytest.mark.parametrize("motion", SMOOTH)
@pytest.mark.parametrize("law", LAWS)
def test_a_resistance_is_how_the_force_falls_with_speed(law: ContactLaw, motion: str) -> None:
    # Without a step a spring does not stretch, and none stops a foot.
    ground, velocity = Ground(law, timestep=0.0), SMOOTH[motion]
    _, found, normal, damping = ground.at(velocity)
    assert normal > 0.0
    assert damping == GROUND["damping"]
    np.testing.assert_array_equal(found, found.T)
    slips = law != "stick" or motion == "slides"
    expected = expected_resistance(ground, velocity, follows_normal=slips)
    if law == "stick" and slips:
        # Taken by the share of its damper that is left, which is more along the slip alone.
        assert np.linalg.eigvalsh(found - expected).min() > -1e-4
        assert np.linalg.matrix_rank(found - expected, tol=1e-3) == 1
    else:
        np.testing.assert_allclose(found, expected, atol=1e-4)
    sideways = found - damping * np.outer(UP, UP)
    assert (np.abs(sideways).max() > 1.0) == RESISTS[law, motion]


RESISTS: Final = {
    **{("linear_zone", motion): True for motion in SMOOTH},
    **{("dead_zone", motion): motion != "rests" for motion in SMOOTH},
    **{("karnopp", motion): False for motion in SMOOTH},
    **{("stick", motion): True for motion in SMOOTH},
}
"""Whether friction depends on the velocity's size or direction in it."""


@pytest.mark.parametrize("law", ["linear_zone", "dead_zone"])
def test_friction_that_may_stop_a_foot_within_a_step_is_taken_by_its_secant(
    law: ContactLaw,
) -> None:
    velocity = SMOOTH["slides"]
    ground = Ground(law, mobility=1e3)
    force, found, normal, damping = ground.at(velocity)
    sideways = found - damping * np.outer(UP, UP)
    np.testing.assert_allclose(sideways @ velocity, normal * UP - force, atol=1e-9)
    # One that does not is all but constant along the slip.
    _, sure, _, _ = Ground(law).at(velocity)
    slip = velocity - UP * (UP @ velocity)
    np.testing.assert_allclose((sure - damping * np.outer(UP, UP)) @ slip, 0.0, atol=1e-9)


def test_a_foot_surely_slides_if_friction_takes_little_of_its_speed_in_a_step() -> None:
    def sliding(mobility: float) -> float:
        foot = Ground("karnopp", mobility).foot
        return float(ca.evalf(foot.sliding(drag=10.0 / 0.1, timestep=1e-3)))

    # A force of 10 N changes the speed of 1 kg by 0.01 m/s in a millisecond.
    assert [sliding(mobility) for mobility in (0.0, 1.0, 5.0, 10.0, 20.0)] == pytest.approx(
        [1.0, 0.9, 0.5, 0.0, 0.0]
    )


@pytest.mark.parametrize(
    ("height", "rising", "lands"),
    [(1e-3, -0.5, True), (1e-3, -0.3, False), (1e-3, 0.5, False), (-1e-3, -0.5, False)],
    ids=["falls", "falls slowly", "rises", "on the ground"],
)
def test_a_foot_in_the_air_lands_that_falls_far_enough_in_time(
    height: float, rising: float, lands: bool
) -> None:
    link = link_at((0.1, 0.0, rising), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.01 + height)
    foot = foot_on_ground(
        link, (0.0, 0.0, 0.0), {"sole": 0.01, "stiffness": 1.0, "damping": 1.0}, 1.0
    )
    assert bool(foot.lands_within(2.5e-3)) is lands


@pytest.mark.parametrize("law", LAWS)
def test_a_foot_in_the_air_is_neither_pushed_nor_held(law: ContactLaw) -> None:
    force, found, _, _ = Ground(law).at(SMOOTH["slides"], depth=-1e-3)
    np.testing.assert_array_equal(force, 0.0)
    np.testing.assert_array_equal(found, 0.0)


@pytest.mark.parametrize("law", LAWS)
def test_a_foot_that_leaves_the_ground_faster_than_its_spring_pushes_is_not_held(
    law: ContactLaw,
) -> None:
    force, found, _, _ = Ground(law).at(world(0.1, 0.0, 0.5))
    np.testing.assert_array_equal(force, 0.0)
    np.testing.assert_allclose(found, 0.0, atol=1e-12)
