"""Meshes that a URDF's links look like: which file, where, how large and in which colour."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree as ET

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.elements import origin_of
from gaitswarm.sim.robot.urdf import Link

Colour = tuple[float, float, float, float]
"""Red, green, blue and opacity, 0 to 1."""

_LARGEST_SCALE: Final = 1e6


@dataclass(frozen=True, slots=True)
class VisualMesh:
    """A mesh on a link. Only pictures have it; nothing of it is simulated.

    Attributes:
        name: of its file, as the URDF has it.
        origin: of its frame in the link's, position [m] and quaternion x y z w.
        scale: along its own x, y and z [1].
        colour: of its material in the URDF; None if that says none.
    """

    name: str
    origin: tuple[float, float, float, float, float, float, float]
    scale: tuple[float, float, float]
    colour: Colour | None


def material_colours(urdf: str) -> Mapping[str, Colour]:
    """Colours of a URDF's materials, which any link may name."""
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    found: dict[str, Colour] = {}
    for material in root.iter("material"):
        colour = _colour(material)
        if colour is not None:
            found.setdefault(material.get("name", ""), colour)
    return found


def visual_meshes(link: Link, colours: Mapping[str, Colour]) -> tuple[VisualMesh, ...]:
    """Meshes of a link's visual geometry.

    What cannot be read is left out, or has its default: no walk fails for a picture.
    """
    meshes = []
    for part in link.element.findall("visual"):
        for mesh in part.findall("geometry/mesh"):
            name = mesh.get("filename", "")
            try:
                origin = origin_of(part, f"link {link.name!r}")
            except RobotFileError:
                continue
            if not name:
                continue
            x, y, z = origin.xyz.tolist()
            qx, qy, qz, qw = origin.quaternion().tolist()
            scale = _numbers(mesh.get("scale", ""), 3, _LARGEST_SCALE)
            meshes.append(
                VisualMesh(
                    name,
                    (x, y, z, qx, qy, qz, qw),
                    (1.0, 1.0, 1.0) if scale is None else (scale[0], scale[1], scale[2]),
                    _material_of(part, colours),
                )
            )
    return tuple(meshes)


def _material_of(part: ET.Element, colours: Mapping[str, Colour]) -> Colour | None:
    material = part.find("material")
    if material is None:
        return None
    return _colour(material) or colours.get(material.get("name", ""))


def _colour(material: ET.Element) -> Colour | None:
    element = material.find("color")
    numbers = None if element is None else _numbers(element.get("rgba", ""), 4, 1.0)
    if numbers is None or min(numbers) < 0.0:
        return None
    return (numbers[0], numbers[1], numbers[2], numbers[3])


def _numbers(text: str, count: int, largest: float) -> list[float] | None:
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        return None
    fits = all(math.isfinite(value) and abs(value) <= largest for value in values)
    return values if len(values) == count and fits else None
