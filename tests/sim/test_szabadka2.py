"""The shipped robot's links against the thesis's table 3."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.robot import load_robot

TABLE_3 = {
    "coxa": (0.141, (0.0336, 1.84e-3, -1.26e-3),
             (5.76e-5, 1.28e-4, 8.00e-5, 6.79e-6, 3.28e-7, 5.98e-6)),
    "femur": (0.236, (0.0676, 1.36e-3, 1.34e-2),
              (4.93e-5, 2.95e-4, 2.69e-4, 1.04e-5, -4.97e-6, 2.11e-5)),
    "tibia": (0.208, (0.0587, 5.22e-6, 1.31e-2),
              (3.73e-5, 2.38e-4, 2.13e-4, -3.11e-8, -2.36e-8, 8.36e-6)),
}  # fmt: skip
"""Mass [kg]; centre of mass r_X, r_Y, r_Z [m]; I_XX, YY, ZZ, XY, YZ, XZ about it [kg m2]."""

HINGE = {"coxa": "femur", "femur": "femur", "tibia": "tibia"}
"""The hinge that is Z of a link's frame: its own, but of the coxa the femur's."""

NEXT = {"coxa": "femur", "femur": "tibia", "tibia": "sole"}
"""The joint at a link's far end, to which X points."""

MIRROR = np.diag([1.0, -1.0, 1.0])
"""From left to right."""

Floats = NDArray[np.float64]


def vector_of(leg: str, part: str, tag: str) -> Floats:
    """An attribute `xyz` of a joint of szabadka2's URDF, (3,)."""
    root = ET.fromstring(load_robot("szabadka2").urdf.text)  # noqa: S314  shipped
    element = root.find(f"joint[@name='{leg}_{part}']/{tag}")
    assert element is not None
    return np.array([float(number) for number in element.attrib["xyz"].split()])


def axes_of_table_3(leg: str, part: str) -> Floats:
    """Rotation from a left leg's frame of table 3 to the link's in the URDF, (3, 3)."""
    along = vector_of(leg, NEXT[part], "origin")
    x, z = along / np.linalg.norm(along), vector_of(leg, HINGE[part], "axis")
    return np.column_stack((x, np.cross(z, x), z))


@pytest.mark.parametrize("part", TABLE_3)
@pytest.mark.parametrize("row", ["front", "middle", "rear"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_links_are_those_of_table_3_about_their_hinges(side: str, row: str, part: str) -> None:
    mass, centre, (xx, yy, zz, xy, yz, xz) = TABLE_3[part]
    turn = axes_of_table_3(f"left_{row}", part)
    if side == "right":
        turn = MIRROR @ turn
    inertia = load_robot("szabadka2").urdf.links[f"{side}_{row}_{part}_link"].inertia
    assert inertia.mass == mass
    np.testing.assert_allclose(inertia.centre, turn @ centre, rtol=1e-12, atol=1e-18)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(inertia.rotational, turn @ tensor @ turn.T, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("part", TABLE_3)
def test_the_inertia_about_the_hinge_is_table_3s_zz(part: str) -> None:
    for leg in ("right_front", "left_rear"):
        axis = vector_of(leg, HINGE[part], "axis")
        tensor = load_robot("szabadka2").urdf.links[f"{leg}_{part}_link"].inertia.rotational
        assert axis @ tensor @ axis == pytest.approx(TABLE_3[part][2][2], rel=1e-12)


def test_the_two_sides_are_mirror_images() -> None:
    links = load_robot("szabadka2").urdf.links
    for row in ("front", "middle", "rear"):
        for part in TABLE_3:
            right, left = (links[f"{side}_{row}_{part}_link"].inertia for side in ("right", "left"))
            np.testing.assert_array_equal(left.centre, MIRROR @ right.centre)
            np.testing.assert_array_equal(left.rotational, MIRROR @ right.rotational @ MIRROR)
