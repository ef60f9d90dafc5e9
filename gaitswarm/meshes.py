"""Meshes of a URDF: next to it, or in ROS packages."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final, Literal
from urllib.parse import unquote
from xml.etree import ElementTree as ET

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import LONGEST_URDF, check_urdf

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
    """A mesh that a URDF names.

    Attributes:
        name: as the URDF has it.
        path: of its file, without links; None if it is not served.
        form: of its file, by its ending.
        problem: why it is not served; None if it is.
    """

    name: str
    path: Path | None
    form: MeshFormat | None
    problem: str | None


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
                return tuple(_found(name, folder) for name in mesh_names(text))
        return ()

    def content(self, digest: str, number: int) -> bytes:
        """A mesh."""
        meshes = self.of(digest)
        if number >= len(meshes):
            raise NotFound(f"the robot has no mesh {number}, but {len(meshes)} in all")
        mesh = meshes[number]
        if mesh.path is None:
            raise NotFound(f"mesh {mesh.name[:200]}: {mesh.problem}")
        try:
            with mesh.path.open("rb") as file:
                content = file.read(LARGEST_MESH + 1)
        except OSError as error:
            raise NotFound(f"mesh {mesh.name[:200]}: {error.strerror}") from error
        if len(content) > LARGEST_MESH:
            raise NotFound(f"mesh {mesh.name[:200]}: {TOO_LARGE}")
        return content

    def _robots(self) -> Iterator[tuple[Path, str]]:
        """Folders with the text of their robot.urdf, of those that can be read."""
        folders = [place for folder in self._folders for place in (folder, *_inside(folder))]
        for folder in folders[:_MOST_ROBOTS]:
            try:
                with (folder / "robot.urdf").open(encoding="utf-8") as file:
                    text = file.read(LONGEST_URDF + 1)
                check_urdf(text)
            except (OSError, ValueError, RobotFileError):
                continue
            yield folder, text


def _inside(folder: Path) -> list[Path]:
    try:
        return sorted(place for place in folder.iterdir() if place.is_dir())
    except OSError:
        return []


def _found(name: str, folder: Path) -> FoundMesh:
    form = FORMS.get(Path(name).suffix.lower())
    if form is None:
        return FoundMesh(name, None, None, NOT_A_MESH)
    outside = False
    for root, path in mesh_places(name, folder):
        try:
            real = path.resolve(strict=True)
            if not real.is_file() or FORMS.get(real.suffix.lower()) != form:
                continue
            if not real.is_relative_to(root.resolve(strict=True)):
                outside = True
                continue
            if real.stat().st_size > LARGEST_MESH:
                return FoundMesh(name, None, form, TOO_LARGE)
        except (OSError, ValueError, RuntimeError):  # not there, or a loop of links
            continue
        return FoundMesh(name, real, form, None)
    said = "its file is outside of the robot's folder" if outside else NOT_FOUND
    return FoundMesh(name, None, form, said)


LARGEST_COPY: Final = 256 * 1024 * 1024
"""Of all meshes of a robot together [B]; a well-known quadruped's have 2 to 60 MB."""


@dataclass(frozen=True, slots=True)
class MeshCopies:
    """What became of the meshes that a URDF names.

    Attributes:
        copied: names of those that were copied, as the URDF has them.
        size: of their files together [B].
        left_out: names of the others, each with the reason.
    """

    copied: tuple[str, ...] = ()
    size: int = 0
    left_out: tuple[tuple[str, str], ...] = ()


def copy_meshes(urdf: str, folder: Path, output: Path, packages: Sequence[Path] = ()) -> MeshCopies:
    """Copy the meshes that a URDF names to a place next to its copy.

    No simulation needs them: one that is missing, no mesh or too large is left out.
    """
    sources: dict[Path, Path] = {}
    copied, left_out, size = [], [], 0
    for name in mesh_names(urdf):
        found = _source(name, folder, packages)
        content = found if isinstance(found, str) else _content(found)
        place = own_place(name)
        if isinstance(found, str) or isinstance(content, str):
            left_out.append((name, str(content)))
        elif place is None:
            left_out.append((name, "its name is absolute, or leads out of its package"))
        elif sources.setdefault(place, found) != found:
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


def _source(name: str, folder: Path, packages: Sequence[Path]) -> Path | str:
    """The file of a mesh, without links, or why there is none."""
    form = FORMS.get(Path(name).suffix.lower())
    if form is None:
        return NOT_A_MESH
    found = find_mesh(name, folder, packages)
    if found is None:
        return NOT_FOUND
    real = found.resolve()
    return real if FORMS.get(real.suffix.lower()) == form else NOT_A_MESH


def _content(path: Path) -> bytes | str:
    """Of a mesh, or why it is not copied."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_MESH + 1)
    except OSError as error:
        return f"cannot read {path}: {error.strerror}"
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


def find_mesh(name: str, folder: Path, packages: Sequence[Path] = ()) -> Path | None:
    """Look for a mesh.

    `package://NAME/PATH` is looked for in folders of that name: the URDF's own and those above it,
    those given, those of ROS_PACKAGE_PATH, and their subfolders. Another path is relative
    to the URDF's folder. A mesh found nowhere else may be a copy at its `own_place`.
    """
    scheme, _, rest = name.partition("://")
    if scheme == "file":
        return _file(Path(unquote(rest)))
    places = (_file(path) for _, path in mesh_places(name, folder, packages))
    return next((found for found in places if found is not None), None)


def mesh_places(
    name: str, folder: Path, packages: Sequence[Path] = ()
) -> Iterator[tuple[Path, Path]]:
    """Places where `find_mesh` looks for a mesh next to the URDF or in a package."""
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


def _file(path: Path) -> Path | None:
    try:
        return path if path.is_file() else None
    except (OSError, ValueError):  # a name that no file can have
        return None
