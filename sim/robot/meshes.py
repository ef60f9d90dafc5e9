"""Meshes of a URDF, next to it or in ROS packages; no simulation needs them."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Final, Literal
from urllib.parse import unquote
from xml.etree import ElementTree as ET

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import LONGEST_URDF, check_urdf

MeshFormat = Literal["stl", "obj", "dae"]

LARGEST_MESH: Final = 32 * 1024 * 1024
"""Largest mesh that is served [B]; a link of a well-known quadruped has 0.1 to 10 MB."""

FORMS: Final[dict[str, MeshFormat]] = {".stl": "stl", ".obj": "obj", ".dae": "dae"}
"""By a file's ending."""

_MOST_ROBOTS: Final = 200
"""Folders that are searched at most."""

_PACKAGES: Final = ("package", "model")
"""URL schemes whose path begins with a package."""

Packages = Sequence[tuple[str | None, Path]]
"""Folders of ROS packages by name; without a name, a folder that is or contains packages."""


def urdf_digest(urdf: str) -> str:
    """Digest that identifies a robot's meshes."""
    text = urdf.replace("\r\n", "\n").replace("\r", "\n")
    return hashlib.sha256(text.encode()).hexdigest()


def served_meshes(folders: Sequence[Path], digest: str) -> dict[str, Path | str]:
    """Meshes of a robot in some folders: by name its file, or why it is not served.

    Only files that the robot's own URDF names are served, with a mesh's extension, and at their
    `own_place` in its folder, with links resolved.
    """
    robots = list(folders)
    for folder in folders:
        robots += sorted(path.parent for path in folder.glob("*/robot.urdf"))
    for folder in robots[:_MOST_ROBOTS]:
        try:
            with (folder / "robot.urdf").open(encoding="utf-8") as file:
                text = file.read(LONGEST_URDF + 1)
            check_urdf(text)
        except (OSError, ValueError, RobotFileError):
            continue
        if urdf_digest(text) == digest:
            return {name: _served(name, folder.resolve()) for name in mesh_names(text)}
    return {}


def _served(name: str, folder: Path) -> Path | str:
    place = own_place(name)
    found = found_mesh(name, [] if place is None else [folder / place])
    if isinstance(found, Path) and not found.is_relative_to(folder):
        return "its file is outside of the robot's folder"
    return found


def copy_meshes(
    urdf: str, folder: Path, output: Path, packages: Packages = ()
) -> tuple[list[str], dict[str, str]]:
    """Copy the meshes that a URDF names to their `own_place` next to its copy."""
    sources: dict[Path, Path] = {}
    copied, left_out = [], dict[str, str]()
    for name in mesh_names(urdf):
        found, place = found_mesh(name, mesh_places(name, folder, packages)), own_place(name)
        if isinstance(found, str):
            left_out[name] = found
        elif place is None:
            left_out[name] = "its name is absolute, or leads out of its package"
        elif sources.setdefault(place, found) != found:
            left_out[name] = f"another one is {place.as_posix()} in the folder"
        else:
            target = output / place
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(found.read_bytes())
            copied.append(name)
    return copied, left_out


def mesh_names(urdf: str) -> list[str]:
    """Meshes that a URDF names."""
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    named = (element.get("filename", "") for element in root.iter("mesh"))
    return list(dict.fromkeys(name for name in named if name))


def found_mesh(name: str, places: Iterable[Path]) -> Path | str:
    """Return a mesh's file in the first place that has it, or why it is not used."""
    form = FORMS.get(Path(name).suffix.lower())
    if form is None:
        return "it is none of STL, OBJ and DAE"
    for path in places:
        try:
            real = path.resolve(strict=True)
            if real.is_file() and FORMS.get(real.suffix.lower()) == form:
                if real.stat().st_size <= LARGEST_MESH:
                    return real
                return f"it has more than {LARGEST_MESH // 2**20} MiB; simplify it"
        except (OSError, ValueError, RuntimeError):  # not there, or a loop of links
            continue
    return "its file was not found"


def package_places(name: str, folder: Path, packages: Packages = ()) -> Iterator[Path]:
    """Yield folders of a ROS package: given by name, of the URDF and above it, then searched."""
    yield from (place for given, place in packages if given == name)
    own = folder.resolve()
    listed = filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep))
    above = (own, *own.parents)
    for place in (*above, *(place for given, place in packages if not given), *map(Path, listed)):
        if place.resolve().name == name or _package_in(place) == name:
            yield place
        yield place / name


def _package_in(folder: Path) -> str | None:
    """Name of the ROS package in a folder, if there is one."""
    with suppress(OSError, ValueError, ET.ParseError):
        return ET.parse(folder / "package.xml").findtext("name")  # noqa: S314 - read, not kept
    return None


def mesh_places(name: str, folder: Path, packages: Packages = ()) -> Iterator[Path]:
    """Yield the places of a mesh: by its URL, or a copy at its `own_place`."""
    scheme, separator, rest = name.partition("://")
    if not separator:
        yield folder / name
    elif scheme == "file":
        yield Path(unquote(rest))
    elif scheme in _PACKAGES:
        package, _, path = rest.partition("/")
        yield from (place / path for place in package_places(package, folder, packages))
        own = folder.resolve()
        yield from (place / path for place in (own, *own.parents))
    own_copy = own_place(name)
    if own_copy is not None:
        yield folder / own_copy


def own_place(name: str) -> Path | None:
    """Path of a mesh in the folder of a self-contained robot."""
    scheme, separator, rest = name.partition("://")
    path = PurePosixPath(rest if separator else name)
    if path.is_absolute() or (separator and scheme not in _PACKAGES):
        return None
    parts: list[str] = []
    for part in path.parts:
        if part != "..":
            parts.append(part)
        elif separator and len(parts) < 2:  # the first part is the package
            return None
        else:
            del parts[-1:]
    return Path(*parts) if parts else None
