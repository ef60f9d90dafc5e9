"""Small meshes, and robots that look like them."""

from __future__ import annotations

import struct
from typing import Final
from xml.etree import ElementTree as ET

_FACES: Final = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))

GREEN: Final = "0.1 0.9 0.1 1"
"""Of the material: no part of the page has such a colour."""


def tetrahedron(edge: float) -> bytes:
    """A binary STL of four faces about the origin; edge: [m]."""
    half = edge / 2
    corners = (
        (-half, -half, -half),
        (half, half, -half),
        (half, -half, half),
        (-half, half, half),
    )
    faces = b"".join(
        struct.pack("<12fH", 0.0, 0.0, 0.0, *(x for corner in face for x in corners[corner]), 0)
        for face in _FACES
    )
    return bytes(80) + struct.pack("<I", len(_FACES)) + faces


def with_mesh(urdf: str, *names: str) -> str:
    """A robot whose first link looks like these meshes, twice as large, 5 cm up, in green."""
    root = ET.fromstring(urdf)  # noqa: S314 - the tests' own
    material = ET.SubElement(root, "material", name="paint")
    ET.SubElement(material, "color", rgba=GREEN)
    link = root.find("link")
    assert link is not None
    for name in names:
        visual = ET.SubElement(link, "visual")
        ET.SubElement(visual, "origin", xyz="0 0 0.05")
        ET.SubElement(visual, "material", name="paint")
        ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename=name, scale="2 2 2")
    return ET.tostring(root, encoding="unicode")


OBJ: Final = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n"

DAE: Final = b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 0.1 0 0 0 0.1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n">
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
"""One triangle."""
