"""Where the meshes of a URDF are: beside it, or in packages as ROS finds them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import unquote
from xml.etree import ElementTree as ET

_VARIABLE: Final = "ROS_PACKAGE_PATH"

_PACKAGES: Final = ("package", "model")
"""Schemes of names that begin with a package's."""

_LEAST_IN_PACKAGE: Final = 2
"""Parts of a path that one `..` does not lead out of its package."""


def mesh_names(urdf: str) -> list[str]:
    """Meshes that a URDF names."""
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    named = (element.get("filename", "") for element in root.iter("mesh"))
    return list(dict.fromkeys(name for name in named if name))


def find_mesh(name: str, folder: Path, packages: Sequence[Path] = ()) -> Path | None:
    """Look for a mesh.

    `package://NAME/PATH` is looked for in folders of that name: the URDF's own and those above it,
    those given, those of ROS_PACKAGE_PATH, and what lies in any of them. Another path is relative
    to the URDF's folder. What is found nowhere may be a copy at its `own_place`.
    """
    scheme, _, rest = name.partition("://")
    if scheme == "file":
        return _file(Path(unquote(rest)))
    places = (_file(path) for _, path in mesh_places(name, folder, packages))
    return next((found for found in places if found is not None), None)


def mesh_places(
    name: str, folder: Path, packages: Sequence[Path] = ()
) -> Iterator[tuple[Path, Path]]:
    """Where `find_mesh` looks for a mesh that is beside the URDF or in a package."""
    scheme, separator, rest = name.partition("://")
    if not separator:
        yield folder, folder / name
    elif scheme in _PACKAGES:
        yield from _in_packages(rest, folder, packages)
    own = own_place(name)
    if own is not None:
        yield folder, folder / own


def own_place(name: str) -> Path | None:
    """Where a mesh lies in the folder of a robot that needs nothing outside of it."""
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
    """Places of what `package://` is before, as `mesh_places` has them."""
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
