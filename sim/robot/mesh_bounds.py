"""How large a mesh is, by the loader that Pinocchio has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def mesh_bounds(path: Path) -> Floats | None:
    """Least and largest coordinates of a mesh's vertices.

    Returns:
        (2, 3) in the file's units, which a URDF scales to metres; None if it is no mesh.
    """
    # The first use: most robots' feet are known without meshes.
    import coal  # noqa: PLC0415

    try:
        vertices = np.asarray(coal.MeshLoader().load(str(path), np.ones(3)).vertices())
    except (ValueError, RuntimeError):
        return None
    if vertices.size == 0 or not np.isfinite(vertices).all():
        return None
    return np.array([vertices.min(axis=0), vertices.max(axis=0)])
