"""Ends of a URDF's legs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.frame import fixed_joint
from gaitswarm.sim.robot.shapes import visual_meshes
from gaitswarm.sim.robot.urdf import Solid, Urdf

Floats = NDArray[np.float64]

MeshBounds = Callable[[str], Floats | None]
"""Returns least and largest coordinates of a mesh by its name in the URDF, (2, 3), unscaled; None
if it is missing or cannot be read."""


def no_meshes(_name: str) -> None:
    """Find no mesh, for a URDF without mesh files."""


_FOOT_NAME: Final = re.compile(r"foot|toe|sole|ankle|tip|contact", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class LegEnd:
    """End of a leg in its last link's frame."""

    at: Floats  # position, (3,) [m]
    foot: str | None = None  # name of the frame there, if any
    sole: float | None = None  # radius of a sphere there [m], if any
    notes: tuple[str, ...] = ()  # guesses
    # alternatives that fit the shapes equally well, (n, 3) [m]
    others: Floats = field(default_factory=lambda: np.empty((0, 3)))


def end_of(urdf: Urdf, link: str, bounds: MeshBounds = no_meshes) -> LegEnd:
    """Find a leg's end: a frame fixed to its last link, a sphere, or the end of its shapes."""
    parts = [name for name, place in urdf.places.items() if place.body == link]
    spheres = [(at, s.size[0]) for part in parts for at, s in _solids(urdf, part, "sphere")]
    others = [name for name in parts if name != link]
    named = [name for name in others if _FOOT_NAME.search(name)]
    if others:
        far = max(named or others, key=lambda n: float(np.linalg.norm(urdf.places[n].position)))
        at = urdf.places[far].position
        if np.linalg.norm(at) > 0.0:
            near = [float(r) for centre, r in spheres if np.linalg.norm(centre - at) <= r]
            notes = () if named else (f"its end is the link {far!r}, the farthest one",)
            return LegEnd(at, far, max(near, default=None), notes)
    if spheres:
        at, radius = max(spheres, key=lambda s: float(np.linalg.norm(s[0])))
        note = f"its end is the sphere of the link {link!r}"
        return LegEnd(at, sole=float(radius), notes=(note,))
    of_shapes = [end for part in parts for at, s in _solids(urdf, part) for end in _ends(at, s)]
    ends = of_shapes or [end for part in parts for end in _mesh_ends(urdf, part, bounds)]
    if ends:
        kind = "shape" if of_shapes else "mesh"
        note = f"its end is the lowest one of the {kind} of the link {link!r} when it stands"
        at = max(ends, key=lambda end: float(np.linalg.norm(end)))
        return LegEnd(at, notes=(note,), others=np.array(ends))
    raise RobotFileError(_without_foot(urdf, link, parts))


def _without_foot(urdf: Urdf, link: str, parts: Iterable[str]) -> str:
    meshes = [mesh.name for part in parts for mesh in visual_meshes(urdf.links[part], {})]
    lost = f", and its mesh {meshes[0]!r} was not found (`--package-path`)" if meshes else ""
    foot = f"{link}_foot"
    joint = fixed_joint(f"{foot}_fixed", link, foot, "0 0 -0.2")
    example = "".join([f"<link name={quoteattr(foot)}/>", *map(str.strip, joint)])
    return (
        f"robot.urdf: link {link!r} has no foot{lost}: add a link at its end with a fixed"
        f" joint at its position in the frame of {link!r} [m]: {example}"
    )


def _mesh_ends(urdf: Urdf, part: str, bounds: MeshBounds) -> Iterable[Floats]:
    """Yield centres of the faces of boxes around a link's meshes, in its body's frame."""
    place = urdf.places[part]
    for mesh in visual_meshes(urdf.links[part], {}):
        extent = bounds(mesh.name)
        if extent is None:
            continue
        ends = extent * mesh.scale
        middle, half = ends.mean(axis=0), np.ptp(ends, axis=0) / 2.0
        faces = np.concatenate([middle + np.diag(half), middle - np.diag(half)])
        # Slow to import, but already imported where origins are read.
        from scipy.spatial.transform import Rotation  # noqa: PLC0415

        turn = Rotation.from_quat(mesh.origin[3:]).as_matrix()
        yield from (faces @ turn.T + mesh.origin[:3]) @ place.rotation.T + place.position


def _solids(urdf: Urdf, part: str, kind: str | None = None) -> Iterable[tuple[Floats, Solid]]:
    place = urdf.places[part]
    for solid in urdf.links[part].solids("collision"):
        if kind in (None, solid.kind):
            yield place.rotation @ solid.origin.xyz + place.position, solid


def _ends(at: Floats, solid: Solid) -> Iterable[Floats]:
    half = solid.size / 2.0 if solid.kind == "box" else np.full(3, solid.size[-1] / 2.0)
    turn = solid.origin.matrix()
    axes = turn.T * half[:, None] if solid.kind == "box" else (turn.T * half[:, None])[2:]
    yield from (at + axis for axis in axes)
    yield from (at - axis for axis in axes)
