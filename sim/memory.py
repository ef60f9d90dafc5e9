"""Room in memory for libraries that do not say when they find none."""

from __future__ import annotations

import mmap
import sys
from typing import Final

_NEEDED: Final = 192 << 20
"""Address space [B] with which SciPy and its OpenBLAS are loaded: with less than a half of it the
latter tries for ever to map its buffers."""

_WITH_OPENBLAS: Final = ("scipy.special._ufuncs", "scipy.linalg._fblas")
"""Modules of SciPy of which each has loaded its OpenBLAS."""


def require_room_for_scipy() -> None:
    """Check, before SciPy is loaded, that it can be; to be called before an import of it.

    Its OpenBLAS maps buffers while it is loaded and, where it gets none, tries again without end.
    That would stop all threads of the process, as the interpreter's lock is held.
    """
    if sys.platform == "win32" or any(name in sys.modules for name in _WITH_OPENBLAS):
        return
    try:
        room = mmap.mmap(-1, _NEEDED, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError as error:
        raise MemoryError(
            f"SciPy needs {_NEEDED >> 20} MiB of address space to be loaded, and there is less;"
            " raise the limit (ulimit -v), or make room"
        ) from error
    room.close()
