"""Copies of the meshes that a URDF names, in the folder of the robot that is made of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gaitswarm.mesh_library import FORMS, LARGEST_MESH, NOT_A_MESH, NOT_FOUND, TOO_LARGE
from gaitswarm.meshes import find_mesh, mesh_names, own_place

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
    """Copy the meshes that a URDF names to where they are found beside its copy.

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
