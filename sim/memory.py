"""Memory check for libraries that hang without enough of it."""

from __future__ import annotations

import mmap
import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_NEEDED: Final = 192 << 20
"""Address space [B] to load SciPy and its OpenBLAS; with less than half of it, OpenBLAS hangs."""

_WITH_OPENBLAS: Final = ("scipy.special._ufuncs", "scipy.linalg._fblas")
"""Modules of SciPy that each load its OpenBLAS."""


def require_room_for_scipy() -> None:
    """Check the address space before SciPy is imported: without room OpenBLAS retries forever."""
    if sys.platform == "win32" or any(name in sys.modules for name in _WITH_OPENBLAS):
        return
    try:
        room = mmap.mmap(-1, _NEEDED, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError as error:
        raise MemoryError(
            f"SciPy needs {_NEEDED >> 20} MiB of address space, and there is less;"
            " raise the limit (ulimit -v), or free memory"
        ) from error
    room.close()


def rotations() -> type[Rotation]:
    """Import SciPy's rotations, which is slow and seldom needed."""
    require_room_for_scipy()
    from scipy.spatial.transform import Rotation  # noqa: PLC0415

    return Rotation
