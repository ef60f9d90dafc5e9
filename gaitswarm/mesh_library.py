"""Meshes of robots whose folders lie on this machine, for whoever has the robot's URDF."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from gaitswarm.meshes import mesh_names, mesh_places
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import LONGEST_URDF, check_urdf

MeshFormat = Literal["stl", "obj", "dae"]

LARGEST_MESH: Final = 32 * 1024 * 1024
"""Of a file that is given out [B]; a link of a well-known quadruped has 0.1 to 10 MB."""

FORMS: Final[Mapping[str, MeshFormat]] = {".stl": "stl", ".obj": "obj", ".dae": "dae"}
"""By a file's ending."""

TOO_LARGE: Final = f"it has more than {LARGEST_MESH // 2**20} MiB; simplify it"
"""Why a mesh is not given out."""

NOT_A_MESH: Final = "it is none of STL, OBJ and DAE"

NOT_FOUND: Final = "its file was not found"

_MOST_ROBOTS: Final = 200
"""Folders that are looked at."""


@dataclass(frozen=True, slots=True)
class FoundMesh:
    """A mesh that a URDF names.

    Attributes:
        name: as the URDF has it.
        path: of its file, without links; None if it is not given out.
        form: of its file, by its ending.
        problem: why it is not given out; None if it is.
    """

    name: str
    path: Path | None
    form: MeshFormat | None
    problem: str | None


def urdf_digest(urdf: str) -> str:
    """What a robot's meshes are asked for by."""
    text = urdf.replace("\r\n", "\n").replace("\r", "\n")
    return hashlib.sha256(text.encode()).hexdigest()


class MeshLibrary:
    """Meshes of the robots in some folders. Whoever asks never names a file.

    Only files that a robot's own URDF names are found, with an ending of a mesh, in the robot's
    folder or in that of the package that it names, wherever links may lead.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        """Remember the folders; they are read when something is asked."""
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
