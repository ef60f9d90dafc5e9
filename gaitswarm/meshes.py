"""Where the meshes of a URDF are: beside it, or in packages as ROS finds them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final
from urllib.parse import unquote
from xml.etree import ElementTree as ET

_VARIABLE: Final = "ROS_PACKAGE_PATH"


def mesh_names(urdf: str) -> list[str]:
    """Meshes that a URDF names.

    Args:
        urdf: Text of the file, which has been parsed before.

    Returns:
        What it calls them, each once, in its order.
    """
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    named = (element.get("filename", "") for element in root.iter("mesh"))
    return list(dict.fromkeys(name for name in named if name))


def find_mesh(name: str, folder: Path, packages: Sequence[Path] = ()) -> Path | None:
    """Look for a mesh.

    `package://NAME/PATH` is looked for in folders of that name: the URDF's own and those above it,
    those given, those of ROS_PACKAGE_PATH, and what lies in any of them. Another path is relative
    to the URDF's folder.

    Args:
        name: As the URDF has it.
        folder: Of the URDF.
        packages: Folders to look in, before those of ROS_PACKAGE_PATH.

    Returns:
        The file; None if there is none.
    """
    scheme, _, rest = name.partition("://")
    if scheme == "file":
        return _file(Path(unquote(rest)))
    places = (_file(path) for _, path in mesh_places(name, folder, packages))
    return next((found for found in places if found is not None), None)


def mesh_places(
    name: str, folder: Path, packages: Sequence[Path] = ()
) -> Iterator[tuple[Path, Path]]:
    """Where `find_mesh` looks for a mesh that is beside the URDF or in a package.

    Args:
        name: As the URDF has it.
        folder: Of the URDF.
        packages: Folders to look in, before those of ROS_PACKAGE_PATH.

    Yields:
        The folder that the name is relative to, the robot's or a package's, and the path in it,
        which may lead out of it.
    """
    scheme, separator, rest = name.partition("://")
    if not separator:
        yield folder, folder / name
    if not separator or scheme not in ("package", "model"):
        return
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
