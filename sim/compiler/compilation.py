"""C source -> shared library, compiled once and kept in the user's cache directory.

A library is named by a hash of all that went into it, so a stale one is never loaded; see
`sim.compiler.cache` on damaged ones.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib.util
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Final

from sim.compiler import cache
from sim.errors import KernelBuildError

TIME_LIMIT: Final = 300.0
"""Seconds that a compiler may take; a kernel takes one some five."""

_PROBE_LIMIT: Final = 30.0
"""Seconds that a compiler may take to say its version."""

# No contraction into fused multiply-adds and no fast-math: a lane's bits must not depend on
# compiler or machine. Integers wrap: a lane that has diverged computes on.
_FLAGS: Final = (
    "-std=gnu11",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fwrapv",
    "-fPIC",
    "-shared",
    "-Wall",
    "-Wextra",
)


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler: its command, and the first line it says of its version."""

    command: tuple[str, ...]
    version: str

    def flags(self, level: str) -> tuple[str, ...]:
        """Flags for a micro-architecture level, which zig spells in its own way.

        Args:
            level: Level of the x86-64 ABI as GCC names it, or empty for the machine's plain one.

        Returns:
            What goes between the command and the source.
        """
        if not level:
            return _FLAGS
        if "ziglang" in self.command:
            return (*_FLAGS, "-mcpu=" + level.replace("-", "_"))
        return (*_FLAGS, f"-march={level}")


@dataclass(frozen=True, slots=True)
class Target:
    """What code is compiled for: doubles in a vector register, micro-architecture level."""

    lanes: int
    level: str


# Micro-architecture levels of the x86-64 ABI by the CPU flags that tell them. Named levels rather
# than -march=native: one binary for all machines of a level, and the same bits on every level.
_LEVELS: Final = (
    (
        {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
        Target(8, "x86-64-v4"),
    ),
    ({"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}, Target(4, "x86-64-v3")),
)
_PLAIN: Final = Target(2, "")


@lru_cache(maxsize=1)
def target() -> Target:
    """The widest target that this machine runs.

    Returns:
        One of three: 8 lanes (AVX-512), 4 lanes (AVX2), or 2 lanes of plain code.
    """
    if platform.machine().lower() in ("x86_64", "amd64"):
        try:
            flags = set(Path("/proc/cpuinfo").read_text(encoding="utf-8").split())
        except OSError:
            flags = set()
        for needed, level in _LEVELS:
            if needed <= flags:
                return level
    return _PLAIN


def vector_header() -> str:
    """The vector type that kernels are written in.

    Returns:
        C text that defines `vec` of as many reals as a register holds, and its operations.
    """
    return (resources.files("sim.compiler") / "vec.h").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def find_compiler() -> Compiler | None:
    """Look for a C compiler, once a process.

    Returns:
        $CC, cc, gcc, clang, or the `ziglang` wheel's, the first that says its version; None if
        this machine has none.
    """
    candidates = [shlex.split(os.environ.get("CC", "")), ["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        if command and shutil.which(command[0]):
            version = _version(command)
            if version:
                return Compiler(tuple(command), version)
    if importlib.util.find_spec("ziglang"):
        zig = [sys.executable, "-m", "ziglang", "cc"]
        version = _version(zig)
        if version:
            return Compiler(tuple(zig), version)
    return None


def load_library(
    name: str,
    identity: bytes,
    source: Callable[[], str],
    *,
    wanted: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
) -> ctypes.CDLL | None:
    """Load a library from the cache, or compile it now.

    Args:
        name: What people see of it in the cache; any text.
        identity: All that the source depends on.
        source: Gives the C text; called only if it must be compiled.
        wanted: What it is compiled for; this machine's `target` if left out.
        extra_flags: For the compiler, after its usual ones.
        time_limit: Seconds that the compiler may take.

    Returns:
        The library; None on a machine without a compiler whose cache has none.

    Raises:
        KernelBuildError: As for `build_library`, or the library cannot be loaded.
    """
    library = build_library(
        name, identity, source, wanted=wanted, extra_flags=extra_flags, time_limit=time_limit
    )
    if library is None:
        return None
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:
        raise KernelBuildError(
            f"{library} cannot be loaded: {error}; set XDG_CACHE_HOME to a directory whose files"
            " may be executed"
        ) from error


def build_library(
    name: str,
    identity: bytes,
    source: Callable[[], str],
    *,
    wanted: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
) -> Path | None:
    """Find a library in the cache, or compile it now; without loading it.

    Args:
        name: As for `load_library`, and so all the others.
        identity: All that the source depends on.
        source: Gives the C text.
        wanted: What it is compiled for.
        extra_flags: For the compiler.
        time_limit: Seconds that the compiler may take.

    Returns:
        Where it is; None on a machine without a compiler whose cache has none.

    Raises:
        KernelBuildError: The compiler refuses the source or takes too long, the library cannot be
            stored, or it is damaged and there is no compiler to build it again.
    """
    aim = wanted or target()
    digest = hashlib.sha256(repr((_FLAGS, *extra_flags, aim, platform.machine())).encode())
    digest.update(identity)
    stem = f"{_safe(name)}-{digest.hexdigest()[:24]}"
    compiler = find_compiler()
    if compiler is None:
        return _shipped(stem)
    made_by = hashlib.sha256(compiler.version.encode()).hexdigest()[:8]
    file = f"{stem}-{made_by}.so"
    library, _ = cache.find(file)
    if library is None:
        flags = (*compiler.flags(aim.level), *extra_flags)

        def make(built: Path) -> None:
            code = built.with_name("kernel.c")
            code.write_text(f"#define DOUBLES {aim.lanes}\n{source()}", encoding="utf-8")
            arguments = [*flags, str(code), "-o", str(built)]
            _compile(compiler, arguments, built.parent, f"compile {stem}", time_limit)

        library = cache.build(stem, file, make)
    return library


def _shipped(stem: str) -> Path | None:
    """An image may ship compiled kernels without the compiler that made them."""
    library, damaged = cache.find(f"{stem}-*.so")
    if library is None and damaged:
        raise KernelBuildError(
            f"{damaged[0]} is damaged: it does not match the checksum beside it, and there is no C"
            " compiler to build it again; install gcc or clang, or `pip install"
            " gaitswarm[compiler]`, or bring back both files from where they came"
        )
    return library


def _safe(name: str) -> str:
    """A part of a file name, whatever a robot is called."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80]


def _compile(
    compiler: Compiler, arguments: Sequence[str], scratch: Path, purpose: str, time_limit: float
) -> None:
    command = shlex.join(compiler.command)
    # What the compiler keeps for itself goes with the directory, even if it is killed.
    environment = {**os.environ, "TMPDIR": str(scratch)}
    try:
        done = _run([*compiler.command, *arguments], time_limit, environment)
    except subprocess.TimeoutExpired as error:
        raise KernelBuildError(
            f"{command} did not {purpose} within {time_limit:g} s, and was ended"
        ) from error
    except OSError as error:
        raise KernelBuildError(f"{command} cannot be run: {error}") from error
    if done.returncode != 0:
        raise KernelBuildError(f"{command} did not {purpose}:\n{done.stderr[-2000:]}")


def _run(
    command: Sequence[str], time_limit: float, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """`subprocess.run`, but when time is up, all that the command started ends with it."""
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    ) as process:
        try:
            out, err = process.communicate(timeout=time_limit)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def _version(command: list[str]) -> str:
    try:
        done = _run([*command, "--version"], _PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.partition("\n")[0] if done.returncode == 0 else ""
