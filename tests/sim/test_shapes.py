"""Shapes of robots, with geometry in their URDF and without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import Shape, VisibleLink, visible_links
from gaitswarm.sim.robot.urdf import parse_urdf

WITHOUT = '<link name="body">'


def with_geometry(robot: Robot, geometry: str) -> Robot:
    return replace(robot, urdf=parse_urdf(robot.urdf.text.replace(WITHOUT, WITHOUT + geometry)))


def link(robot: Robot, name: str, **options: float) -> VisibleLink:
    (found,) = (link for link in visible_links(robot, **options) if link.name == name)
    return found


def ends(shape: Shape) -> np.ndarray:
    """Both ends of a capsule's axis in its link's frame, (2, 3)."""
    half = np.array([0.0, 0.0, 0.5 * shape.size[1]])
    place = pin.XYZQUATToSE3(np.array(shape.origin))
    return np.array([place.act(-half), place.act(half)])


def test_every_link_of_the_urdf_is_there_with_its_parent_before_it(robot: Robot) -> None:
    links = visible_links(robot)
    names = [link.name for link in links]
    assert len(names) == len(set(names)) == 1 + 6 * 4
    assert (links[0].name, links[0].parent) == ("body", None)
    assert all(names.index(str(link.parent)) < k for k, link in enumerate(links[1:], start=1))
    assert link(robot, "left_rear_foot").parent == "left_rear_tibia_link"


def test_a_leg_is_capsules_from_joint_to_joint(robot: Robot) -> None:
    lengths = {"coxa": 0.06, "femur": 0.08, "tibia": 0.12}
    for leg in robot.legs:
        for role, length in lengths.items():
            (shape,) = link(robot, f"{leg.name}_{role}_link").shapes
            assert (shape.type, shape.role) == ("capsule", role)
            np.testing.assert_allclose(
                ends(shape), [[0.0, 0.0, 0.0], [0.0, leg.side * length, 0.0]], atol=1e-15
            )


def test_a_foot_is_a_sphere_as_long_as_its_sole(robot: Robot) -> None:
    (foot,) = link(robot, "right_middle_foot").shapes
    assert (foot.type, foot.size, foot.role) == ("sphere", (0.010,), "foot")


def test_a_body_is_a_box_from_hip_to_hip(robot: Robot) -> None:
    (box,) = link(robot, "body").shapes
    assert (box.type, box.role) == ("box", "body")
    np.testing.assert_allclose(box.size[:2], (0.32, 0.14))
    np.testing.assert_allclose(box.origin, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


def test_a_load_is_a_cube_of_its_mass_at_its_height(robot: Robot) -> None:
    *_, load = link(robot, "body", load=2.0).shapes
    assert (load.type, load.role) == ("box", "load")
    assert np.prod(load.size) * 2000.0 == pytest.approx(2.0)
    assert load.origin[:3] == (0.0, 0.0, robot.description.load_height)


def test_geometry_of_the_urdf_comes_before_what_is_derived(robot: Robot) -> None:
    """A cylinder along x as URDF turns it: about y by a right angle."""
    drawn = with_geometry(
        robot,
        '<visual><origin xyz="0.1 0 0.02" rpy="0 1.5707963267948966 0"/>'
        '<geometry><cylinder radius="0.03" length="0.2"/></geometry></visual>'
        '<visual><geometry><box size="0.3 0.1 0.05"/></geometry></visual>'
        '<collision><geometry><sphere radius="0.2"/></geometry></collision>',
    )
    cylinder, box = link(drawn, "body").shapes
    assert (cylinder.type, cylinder.size, cylinder.role) == ("cylinder", (0.03, 0.2), "body")
    np.testing.assert_allclose(ends(cylinder), [[0.0, 0.0, 0.02], [0.2, 0.0, 0.02]], atol=1e-15)
    assert (box.type, box.size) == ("box", (0.3, 0.1, 0.05))
    assert link(drawn, "left_front_coxa_link").shapes[0].type == "capsule"


@pytest.mark.parametrize("angles", [(0.3, -0.4, 0.5), (0.0, 0.0, 1.2), (-2.0, 0.7, 3.0)])
def test_urdfs_angles_turn_about_fixed_axes(robot: Robot, angles: tuple[float, ...]) -> None:
    drawn = with_geometry(
        robot,
        f'<visual><origin rpy="{" ".join(map(str, angles))}"/>'
        '<geometry><sphere radius="0.1"/></geometry></visual>',
    )
    (sphere,) = link(drawn, "body").shapes
    turn = pin.XYZQUATToSE3(np.array(sphere.origin)).rotation
    np.testing.assert_allclose(turn, pin.rpy.rpyToMatrix(*angles), atol=1e-12)


def test_collision_geometry_stands_in_for_visual_meshes(robot: Robot) -> None:
    drawn = with_geometry(
        robot,
        '<visual><geometry><mesh filename="body.stl"/></geometry></visual>'
        '<collision><geometry><sphere radius="0.2"/></geometry></collision>',
    )
    assert [shape.type for shape in link(drawn, "body").shapes] == ["sphere"]


def test_what_is_fixed_to_a_part_is_of_that_part(robot: Robot) -> None:
    cover = (
        '<link name="cover"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>'
        '<joint name="screws" type="fixed"><parent link="right_front_tibia_link"/>'
        '<child link="cover"/></joint></robot>'
    )
    covered = replace(robot, urdf=parse_urdf(robot.urdf.text.replace("</robot>", cover)))
    assert [shape.role for shape in link(covered, "cover").shapes] == ["tibia"]


@pytest.mark.parametrize(
    ("geometry", "named"),
    [
        ('<box size="0.1 0.2"/>', "size='0.1 0.2' of <box> is not three numbers"),
        ('<sphere radius="round"/>', "radius='round' of <sphere> is not a number"),
        ("<cylinder radius='1'/>", "length='' of <cylinder> is not a number"),
    ],
)
def test_geometry_that_cannot_be_read_is_named(robot: Robot, geometry: str, named: str) -> None:
    drawn = with_geometry(robot, f"<visual><geometry>{geometry}</geometry></visual>")
    with pytest.raises(RobotFileError, match=named):
        visible_links(drawn)
