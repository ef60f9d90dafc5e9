"""C source -> shared library, compiled once and kept in the user's cache directory.

A library is named by a hash of all that went into it, so a stale one is never loaded, and put in
place by an atomic rename, so concurrent processes never see half of one.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Final

from sim.errors import KernelBuildError

# No contraction into fused multiply-adds and no fast-math: a lane's bits must not depend on
# compiler or machine.
_FLAGS: Final = (
    "-std=gnu11",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fPIC",
    "-shared",
    "-w",
)


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler: its command, and the first line it says of its version."""

    command: tuple[str, ...]
    version: str

    def flags(self, level: str) -> tuple[str, ...]:
        """Flags for a micro-architecture level, which zig spells in its own way."""
        if not level:
            return _FLAGS
        if "ziglang" in self.command:
            return (*_FLAGS, "-mcpu=" + level.replace("-", "_"))
        return (*_FLAGS, f"-march={level}")


def cache_directory() -> Path:
    """Where compiled kernels are kept: $XDG_CACHE_HOME or ~/.cache, in `gaitswarm`."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "gaitswarm"


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
    """The widest target that this machine runs."""
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
    """C text that defines `vec` of LANES doubles and its operations."""
    return (resources.files("sim.compiler") / "vec.h").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def find_compiler() -> Compiler | None:
    """$CC, cc, gcc, clang, or the `ziglang` wheel's; None if this machine has none."""
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


def load_library(name: str, identity: bytes, source: Callable[[], str]) -> ctypes.CDLL | None:
    """The library `name`, from the cache or compiled now; None without compiler and cached copy.

    identity: all that the source depends on; source is called only if it must be compiled.
    Raises KernelBuildError with the compiler's message if it refuses the source.
    """
    digest = hashlib.sha256(repr((_FLAGS, target(), platform.machine())).encode())
    digest.update(identity)
    stem = f"{name}-{digest.hexdigest()[:24]}"
    compiler = find_compiler()
    if compiler is None:
        # An image may ship compiled kernels without the compiler that made them.
        shipped = sorted(cache_directory().glob(f"{stem}-*.so"))
        return ctypes.CDLL(str(shipped[0])) if shipped else None
    made_by = hashlib.sha256(compiler.version.encode()).hexdigest()[:8]
    file = f"{stem}-{made_by}.so"
    # The usual directory may be read-only and still hold what an image shipped in it.
    for folder in (cache_directory(), _private_cache()):
        if (folder / file).exists():
            return ctypes.CDLL(str(folder / file))
    folder = _writable_cache()
    with _lock(folder / f"{stem}.lock"):
        if not (folder / file).exists():
            _compile(compiler, source(), folder / file)
    return ctypes.CDLL(str(folder / file))


def _compile(compiler: Compiler, source: str, library: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="gaitswarm-build-") as folder:
        code = Path(folder) / "kernel.c"
        code.write_text(f"#define LANES {target().lanes}\n{source}", encoding="utf-8")
        built = library.with_name(f"{library.name}.{os.getpid()}.tmp")
        flags = compiler.flags(target().level)
        command = [*compiler.command, *flags, str(code), "-o", str(built)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise KernelBuildError(
                    f"{shlex.join(compiler.command)} did not compile {library.stem}:\n"
                    + done.stderr[-2000:]
                )
            built.replace(library)
        finally:
            built.unlink(missing_ok=True)


def _writable_cache() -> Path:
    """The cache directory, or where that cannot be written a private one in the temporary files."""
    for folder in (cache_directory(), _private_cache()):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    raise KernelBuildError(
        f"neither {cache_directory()} nor {_private_cache()} can be written; set XDG_CACHE_HOME to"
        " a directory for compiled kernels"
    )


def _private_cache() -> Path:
    """This user's own directory among the temporary files; never one that others may write to."""
    folder = Path(tempfile.gettempdir()) / f"gaitswarm-{os.getuid()}"
    if folder.exists() and (folder.stat().st_uid != os.getuid() or folder.stat().st_mode & 0o022):
        raise KernelBuildError(f"{folder} belongs to someone else; set XDG_CACHE_HOME")
    return folder


@contextlib.contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Let one process compile while the others wait; a dead process's lock is released."""
    try:
        import fcntl  # noqa: PLC0415  not on every system
    except ImportError:  # no advisory locks here: the rename alone keeps it safe
        yield
        return
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _version(command: list[str]) -> str:
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.partition("\n")[0] if done.returncode == 0 else ""
