"""C source -> shared library, compiled once and kept in the user's cache directory.

A library is named by a hash of all that went into it, so a stale one is never loaded; see
`sim.compiler.cache` on damaged ones. One that was built beforehand and installed with the package
saves the compilation, or the compiler.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import re
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Final

from gaitswarm.sim.compiler import cache
from gaitswarm.sim.compiler.target import Target, target
from gaitswarm.sim.compiler.toolchain import (
    FLAGS,
    SCHEDULING,
    Compiler,
    find_compiler,
    run_compiler,
    without_compiler,
)
from gaitswarm.sim.errors import KernelBuildError

TIME_LIMIT: Final = 300.0
"""Seconds that a compiler may take; a kernel takes one some five."""

_ATTEMPTS: Final = 3
"""To load a library that other processes remove."""

PREBUILT: Final = Path(__file__).with_name("prebuilt")
"""Where `python -m scripts.prebuilt` puts libraries, for a wheel to bring them."""


def vector_header() -> str:
    """The vector type that kernels are written in."""
    folder = resources.files("gaitswarm.sim.compiler")
    vectors = (folder / "vec.h").read_text(encoding="utf-8")
    for name in ("instructions.h", "fma.h"):
        included = (folder / name).read_text(encoding="utf-8")
        vectors = vectors.replace(f'#include "{name}"\n', included)
    return vectors


def load_library(
    name: str,
    identity: bytes,
    source: Callable[[], str],
    *,
    wanted: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
) -> ctypes.CDLL | None:
    """Load a library from the cache, or compile it now."""
    for _ in range(_ATTEMPTS):
        library = build_library(
            name, identity, source, wanted=wanted, extra_flags=extra_flags, time_limit=time_limit
        )
        if library is None:
            return None
        try:
            return ctypes.CDLL(str(library))
        except OSError as error:
            # Between finding and loading it, another process may have removed it.
            if library.exists():
                raise KernelBuildError(
                    f"{library} cannot be loaded: {error}; set XDG_CACHE_HOME to a directory whose"
                    " files may be executed"
                ) from error
    raise KernelBuildError(
        f"{name} was removed {_ATTEMPTS} times before it could be loaded; set {cache.SIZE_VARIABLE}"
        " to more bytes"
    )


def build_library(
    name: str,
    identity: bytes,
    source: Callable[[], str],
    *,
    wanted: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
    directory: Path | None = None,
) -> Path | None:
    """Find a library in the cache or among the prebuilt ones, or compile it; without loading it.

    Who sets $CC wants that compiler's: then no prebuilt one is taken.
    """
    aim = (wanted or target()).resolved()
    hashed = hashlib.sha256(
        repr((FLAGS, SCHEDULING, *extra_flags, aim, platform.system())).encode()
    )
    hashed.update(identity)
    digest = hashed.hexdigest()[:24]
    stem = f"{_safe(name)}-{digest}"
    compiler = find_compiler(aim.architecture)
    file = f"{stem}-{'*' if compiler is None else _signature(compiler)}.so"
    library, damaged = cache.find(file, directory)
    if library is None and directory is None and not os.environ.get("CC"):
        # Whatever the robot is called that it was built for.
        library, damaged_here = cache.find(f"*-{digest}-*.so", PREBUILT)
        damaged += damaged_here
    if library is not None:
        return library
    if compiler is None:
        if damaged:
            raise KernelBuildError(
                f"{damaged[0]} is damaged: it does not match the checksum beside it, and cannot be"
                f" built again: {without_compiler()}, or bring back both files from where they came"
            )
        return None
    arguments = [*compiler.flags(aim), *extra_flags]

    def make(built: Path) -> None:
        code = built.with_name("kernel.c")
        code.write_text(f"#define DOUBLES {aim.lanes}\n{source()}", encoding="utf-8")
        # The mathematical library for its fma, where the processor has none.
        arguments.extend([str(code), "-o", str(built), "-lm"])
        run_compiler(compiler, arguments, built.parent, f"compile {stem}", time_limit)

    return cache.build(stem, file, make, directory)


def _signature(compiler: Compiler) -> str:
    return hashlib.sha256(compiler.version.encode()).hexdigest()[:8]


def _safe(name: str) -> str:
    """A part of a file name, whatever a robot is called."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80]
