"""Robots whose URDF has other axes up and ahead: detected, reported, rotated on request."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.proposal.legs import AXES, Axis, Frame, turned
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import parse_robot
from gaitswarm.sim.robot.urdf import parse_urdf
from tests.robots.radial import radial_robot
from tests.robots.test_proposal import HEXAPOD, QUADRUPED, dog

RIGHT_ANGLED = [
    Frame(up, ahead) for up, ahead in itertools.product(AXES, AXES) if Frame(up, ahead).right_angled
]
UNIT = {axis: (1 - 2 * axis.startswith("-")) * np.eye(3)["xyz".index(axis[-1])] for axis in AXES}


def in_frame(urdf: str, rpy: str) -> str:
    """A robot whose first link is another one, in whose frame all the rest is turned."""
    body = parse_urdf(urdf).body
    first = next(iter(parse_urdf(urdf).links))
    assert body.mass > 0.0
    root = (
        f'<link name="export"/>\n<joint name="export_weld" type="fixed"><parent link="export"/>'
        f'<child link="{first}"/><origin rpy="{rpy}"/></joint>\n</robot>'
    )
    return urdf.replace("</robot>", root)


LEFT = in_frame(dog(), f"0 0 {math.pi / 2.0!r}")
Y_UP = in_frame(dog(), f"{-math.pi / 2.0!r} 0 0")
"""As CAD exports it: y up, x ahead, z to the right."""
CENTAUR = in_frame(
    re.sub(r"(-?)0\.14 (-?)0\.08 0", r"\g<1>0.08 \g<2>0.14 0", QUADRUPED),
    f"0 0 {math.pi / 2.0!r}",
)
"""Long along x, with legs that point ahead and back."""


def feet_of(urdf: str, frame: Frame) -> list[tuple[float, ...]]:
    proposal = propose_robot(urdf, "mine", "auto", frame)
    robot = parse_robot(proposal.toml, proposal.urdf)
    assert all(isinstance(leg, ChainLeg) for leg in robot.legs)
    return [leg.foot(leg.stance.tolist()) for leg in robot.legs if isinstance(leg, ChainLeg)]


def test_all_pairs_of_axes_at_right_angles_come_to_point_up_and_ahead() -> None:
    assert len(RIGHT_ANGLED) == 24
    for frame in RIGHT_ANGLED:
        assert frame.up is not None and frame.forward is not None
        tree = parse_urdf(turned(dog(), "trunk", ["trunk"], frame))
        place = tree.place("trunk")
        np.testing.assert_allclose(place.rotation @ UNIT[frame.up], [0, 0, 1], atol=1e-15)
        np.testing.assert_allclose(place.rotation @ UNIT[frame.forward], [1, 0, 0], atol=1e-15)
        assert np.linalg.det(place.rotation) == pytest.approx(1.0)


def test_a_robot_that_needs_no_turn_keeps_its_text() -> None:
    assert turned(dog(), "trunk", ["trunk"], Frame("z", "x")) == dog()
    taken = turned(dog(), "trunk", ["trunk", "robot_frame"], Frame("y"))
    assert next(iter(parse_urdf(taken).links)) == "robot_frame0"


@pytest.mark.parametrize(
    ("urdf", "frame"),
    [(LEFT, Frame(forward="y")), (Y_UP, Frame(up="y"))],
    ids=["facing y", "y up"],
)
def test_a_robot_that_is_turned_back_stands_as_the_one_that_never_was(
    urdf: str, frame: Frame
) -> None:
    np.testing.assert_allclose(feet_of(urdf, frame), feet_of(dog(), Frame()), atol=2e-6)


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        (
            Y_UP,
            r"line \d+: link 'export': y seems to point up in its frame, as the hips.*--up=y",
        ),
        (in_frame(dog(), f"{math.pi / 2.0!r} 0 0"), "-y seems to point up"),
        (in_frame(dog(), f"0 {math.pi / 2.0!r} 0"), "x seems to point up"),
        (
            in_frame(QUADRUPED, f"{math.pi!r} 0 0"),
            "-z seems to point up .* as feet reach above the hips",
        ),
        (in_frame(HEXAPOD, f"{math.pi!r} 0 0"), "-z seems to point up"),
        (in_frame(radial_robot(6), f"{math.pi!r} 0 0"), "-z seems to point up"),
    ],
    ids=["y", "-y", "x", "quadruped on its back", "hexapod on its back", "round on its back"],
)
def test_a_robot_whose_z_does_not_point_up_is_refused_with_the_axis_that_does(
    urdf: str, said: str
) -> None:
    with pytest.raises(RobotFileError, match=said):
        propose_robot(urdf, "mine")


def test_explicit_z_up_overrides_the_check() -> None:
    urdf = in_frame(QUADRUPED, f"{math.pi!r} 0 0")
    assert len(feet_of(urdf, Frame(up="z"))) == 4


@pytest.mark.variants("urdf1-True", "urdf4-False", "urdf6-False")
@pytest.mark.parametrize(
    ("urdf", "warned"),
    [
        (LEFT, True),
        (in_frame(QUADRUPED, f"0 0 {math.pi / 2.0!r}"), True),
        (in_frame(HEXAPOD, f"0 0 {-math.pi / 2.0!r}"), True),
        (dog(), False),
        (QUADRUPED, False),
        (HEXAPOD, False),
        *((radial_robot(legs, 0.3), False) for legs in (3, 4, 5, 6, 8)),
        (radial_robot(4), False),
        (CENTAUR, False),
    ],
)
def test_a_robot_that_faces_y_is_made_with_a_warning(urdf: str, warned: bool) -> None:
    def notes(forward: Axis | None) -> list[str]:
        made = propose_robot(urdf, "mine", "auto", Frame(forward=forward))
        return [note for note in made.guesses if "it seems to face y" in note]

    assert len(notes(None)) == warned
    assert notes("x") == [], "who says that x points ahead is believed"
