"""Meshes of a URDF, next to it or in ROS packages; no simulation needs them."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final, Literal
from urllib.parse import unquote
from xml.etree import ElementTree as ET

from pydantic import Field

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import LONGEST_URDF, check_urdf
from gaitswarm.views.base import PREFIX

MeshFormat = Literal["stl", "obj", "dae"]

LARGEST_MESH: Final = 32 * 1024 * 1024
"""Largest mesh that is served [B]; a link of a well-known quadruped has 0.1 to 10 MB."""

FORMS: Final[Mapping[str, MeshFormat]] = {".stl": "stl", ".obj": "obj", ".dae": "dae"}
"""By a file's ending."""

TOO_LARGE: Final = f"it has more than {LARGEST_MESH // 2**20} MiB; simplify it"
"""Reasons why a mesh is not served."""

NOT_A_MESH: Final = "it is none of STL, OBJ and DAE"

NOT_FOUND: Final = "its file was not found"

_MOST_ROBOTS: Final = 200
"""Folders that are searched at most."""


@dataclass(frozen=True, slots=True)
class FoundMesh:
    """A mesh that a URDF names."""

    name: str  # as the URDF has it
    path: Path | None  # of its file, without links; None if it is not used
    form: MeshFormat | None  # by the name's ending
    problem: str | None  # why it is not used; None if it is


class MeshFileView(View):
    """A mesh that a robot's URDF names, and whether this server has its file."""

    name: str = Field(description="As the URDF has it.", examples=["meshes/hip.stl"])
    format: MeshFormat | None = Field(
        description="Media type by file extension; null if the file is not served.",
        examples=["stl"],
    )
    url: str | None = Field(
        description="Path of the file; null if it is not served.",
        examples=["/v1/robots/" + 64 * "0" + "/meshes/0"],
    )
    problem: str | None = Field(description="Why it is not served; null if it is.", examples=[None])

    @classmethod
    def from_mesh(cls, digest: str, number: int, mesh: FoundMesh) -> MeshFileView:
        """Make a view of a mesh."""
        url = None if mesh.path is None else f"{PREFIX}/robots/{digest}/meshes/{number}"
        return cls(name=mesh.name, format=mesh.form, url=url, problem=mesh.problem)


def urdf_digest(urdf: str) -> str:
    """Digest that identifies a robot's meshes."""
    text = urdf.replace("\r\n", "\n").replace("\r", "\n")
    return hashlib.sha256(text.encode()).hexdigest()


class MeshLibrary:
    """Meshes of the robots in some folders. Clients never name a file.

    Only files that a robot's own URDF names are served, with a mesh's extension, in the robot's
    folder or in that of the package that it names, with links resolved.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        """Store the folders; they are read on each request."""
        self._folders = tuple(folders)

    def of(self, digest: str) -> tuple[FoundMesh, ...]:
        """Meshes of a robot."""
        for folder, text in self._robots():
            if urdf_digest(text) == digest:
                return tuple(found_mesh(name, folder, inside=True) for name in mesh_names(text))
        return ()

    def content(self, digest: str, number: int) -> bytes:
        """A mesh."""
        meshes = self.of(digest)
        if number >= len(meshes):
            raise NotFound(f"the robot has no mesh {number}, but {len(meshes)} in all")
        content = _content(meshes[number])
        if isinstance(content, str):
            raise NotFound(f"mesh {meshes[number].name[:200]}: {content}")
        return content

    def _robots(self) -> Iterator[tuple[Path, str]]:
        """Folders with the text of their robot.urdf, of those that can be read."""
        folders = []
        for folder in self._folders:
            folders += [folder, *sorted(path.parent for path in folder.glob("*/robot.urdf"))]
        for folder in folders[:_MOST_ROBOTS]:
            try:
                with (folder / "robot.urdf").open(encoding="utf-8") as file:
                    text = file.read(LONGEST_URDF + 1)
                check_urdf(text)
            except (OSError, ValueError, RobotFileError):
                continue
            yield folder, text


LARGEST_COPY: Final = 256 * 1024 * 1024
"""Of all meshes of a robot together [B]; a well-known quadruped's have 2 to 60 MB."""


@dataclass(frozen=True, slots=True)
class MeshCopies:
    """What became of the meshes that a URDF names."""

    copied: tuple[str, ...] = ()  # their names, as the URDF has them
    size: int = 0  # of their files together [B]
    left_out: tuple[tuple[str, str], ...] = ()  # names of the others, each with the reason


def copy_meshes(urdf: str, folder: Path, output: Path, packages: Sequence[Path] = ()) -> MeshCopies:
    """Copy the meshes that a URDF names to a place next to its copy.

    No simulation needs them: one that is missing, no mesh or too large is left out.
    """
    sources: dict[Path, Path | None] = {}
    copied, left_out, size = [], [], 0
    for name in mesh_names(urdf):
        mesh, place = found_mesh(name, folder, packages), own_place(name)
        content = _content(mesh)
        if isinstance(content, str):
            left_out.append((name, content))
        elif place is None:
            left_out.append((name, "its name is absolute, or leads out of its package"))
        elif sources.setdefault(place, mesh.path) != mesh.path:
            left_out.append((name, f"another one is {place.as_posix()} in the folder"))
        elif size + len(content) > LARGEST_COPY:
            left_out.append((name, f"all have more than {LARGEST_COPY // 2**20} MiB"))
        else:
            target = output / place
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            copied.append(name)
            size += len(content)
    return MeshCopies(tuple(copied), size, tuple(left_out))


def _content(mesh: FoundMesh) -> bytes | str:
    """The content of a mesh, or why it is not used."""
    if mesh.path is None:
        return str(mesh.problem)
    try:
        with mesh.path.open("rb") as file:
            content = file.read(LARGEST_MESH + 1)
    except OSError as error:
        return f"its file cannot be read: {error.strerror}"
    return TOO_LARGE if len(content) > LARGEST_MESH else content


_VARIABLE: Final = "ROS_PACKAGE_PATH"

_PACKAGES: Final = ("package", "model")
"""URL schemes whose path begins with a package."""

_LEAST_IN_PACKAGE: Final = 2
"""Parts of a path from which `..` cannot leave its package."""


def mesh_names(urdf: str) -> list[str]:
    """Meshes that a URDF names."""
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    named = (element.get("filename", "") for element in root.iter("mesh"))
    return list(dict.fromkeys(name for name in named if name))


def found_mesh(
    name: str, folder: Path, packages: Sequence[Path] = (), *, inside: bool = False
) -> FoundMesh:
    """Look for a mesh.

    `package://NAME/PATH` is looked for in folders of that name: the URDF's own and those above it,
    those given, those of ROS_PACKAGE_PATH, and their subfolders. Another path is relative
    to the URDF's folder. A mesh found nowhere else may be a copy at its `own_place`.

    inside: accept only files in the URDF's folder or in the package that the name has.
    """
    form = FORMS.get(Path(name).suffix.lower())
    if form is None:
        return FoundMesh(name, None, None, NOT_A_MESH)
    problem, places = NOT_FOUND, mesh_places(name, folder, packages)
    if name.startswith("file://") and not inside:
        places = iter([(folder, Path(unquote(name.removeprefix("file://"))))])
    for root, path in places:
        try:
            real = path.resolve(strict=True)
            if not real.is_file() or FORMS.get(real.suffix.lower()) != form:
                continue
            if inside and not real.is_relative_to(root.resolve(strict=True)):
                problem = "its file is outside of the robot's folder"
                continue
            if real.stat().st_size > LARGEST_MESH:
                return FoundMesh(name, None, form, TOO_LARGE)
        except (OSError, ValueError, RuntimeError):  # not there, or a loop of links
            continue
        return FoundMesh(name, real, form, None)
    return FoundMesh(name, None, form, problem)


def mesh_places(
    name: str, folder: Path, packages: Sequence[Path] = ()
) -> Iterator[tuple[Path, Path]]:
    """Yield the places of a mesh next to the URDF or in a package, each with its root."""
    scheme, separator, rest = name.partition("://")
    if not separator:
        yield folder, folder / name
    elif scheme in _PACKAGES:
        yield from _in_packages(rest, folder, packages)
    own = own_place(name)
    if own is not None:
        yield folder, folder / own


def own_place(name: str) -> Path | None:
    """Path of a mesh in the folder of a self-contained robot."""
    scheme, separator, rest = name.partition("://")
    path = PurePosixPath(rest if separator else name)
    if path.is_absolute() or (separator and scheme not in _PACKAGES):
        return None
    kept: list[str] = []
    for part in path.parts:
        if part != "..":
            kept.append(part)
        elif separator and len(kept) < _LEAST_IN_PACKAGE:
            return None
        else:
            del kept[-1:]
    return Path(*kept) if kept else None


def _in_packages(rest: str, folder: Path, packages: Sequence[Path]) -> Iterator[tuple[Path, Path]]:
    """Places of the rest of a `package://` URL, as in `mesh_places`."""
    package, _, path = rest.partition("/")
    if package in ("", ".", ".."):
        return
    own = folder.resolve()
    variable = os.environ.get(_VARIABLE, "")
    places = [own, *own.parents, *packages, *map(Path, filter(None, variable.split(os.pathsep)))]
    for place in places:
        for root in ([place] if place.resolve().name == package else []) + [place / package]:
            yield root, root / path
