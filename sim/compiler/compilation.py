"""Compilation of C source to shared libraries, cached in the user's cache directory.

A library is named by a hash of everything that went into it. One that is installed with the package
saves the compilation, or the compiler.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib.util
import math
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Final, NamedTuple

from gaitswarm.sim.compiler import cache
from gaitswarm.sim.errors import KernelBuildError

X86: Final = "x86_64"
ARM: Final = "aarch64"

_SPELLINGS: Final[Mapping[str, str]] = {"amd64": X86, "x64": X86, "arm64": ARM}
"""Names of these architectures on other systems: AMD64 on Windows, arm64 on macOS."""


def host_architecture() -> str:
    machine = platform.machine().lower()
    return _SPELLINGS.get(machine, machine)


class Target(NamedTuple):
    """Target of a compilation."""

    lanes: int  # doubles in a vector register
    # micro-architecture level of the x86-64 ABI as GCC names it; empty for the baseline
    level: str = ""
    architecture: str = ""  # spelled as by `host_architecture`; empty for this machine's

    def resolved(self) -> Target:
        """Return this target with the architecture filled in."""
        return Target(self.lanes, self.level, self.architecture or host_architecture())


# Named levels instead of -march=native: one binary for all machines of a level. A machine has a
# level if its CPU has the flags of this one and of all lower ones.
_V2: Final = frozenset({"cx16", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"})
_V3: Final = _V2 | {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
_V4: Final = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}

X86_TARGETS: Final[Mapping[Target, frozenset[str]]] = {
    Target(8, "x86-64-v4", X86): _V4,
    Target(4, "x86-64-v3", X86): _V3,
    Target(2, "x86-64-v2", X86): _V2,
}
"""Levels, the widest first, with their CPU flags as Linux names them."""

ARM_TARGET: Final = Target(2, "", ARM)
"""NEON, available on every aarch64."""


@lru_cache(maxsize=1)
def target() -> Target:
    """Return the widest target that this machine runs."""
    if host_architecture() == X86:
        flags = cpu_flags()
        for candidate, needed in X86_TARGETS.items():
            if needed <= flags:
                return candidate
    return Target(2).resolved()


def cpu_flags() -> frozenset[str]:
    """Return the flags of this machine's x86-64 CPU, as far as the system reports them."""
    try:
        return frozenset(Path("/proc/cpuinfo").read_text(encoding="utf-8").split())
    except OSError:
        return frozenset()


# No contraction into fused multiply-adds and no fast-math: a lane's bits must not depend on
# compiler or machine. Integers wrap: a diverged lane computes on. Without -g0, Zig's compiler adds
# debug information of ten times the code's size.
FLAGS: Final = (
    "-std=gnu11",
    "-O2",
    "-g0",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fwrapv",
    "-fPIC",
    "-shared",
    "-Wall",
    "-Wextra",
)

SCHEDULING: Final = ("-fschedule-insns", "-fsched-pressure")
"""For GCC: without them, its instruction order for a limb is a tenth slower. Clang has its own."""

_PROBE_LIMIT: Final = 30.0
"""Time limit of `--version` [s]."""

COMPILER_MEMORY: Final = 8 << 30
"""Limit of a compiler process's data [B]; a kernel needs a fortieth of it."""

# The limits are set in the process that becomes the compiler, and are inherited by its children.
_LIMITED: Final = """
import os, sys
try:
    import resource
    for kind, value in ((resource.RLIMIT_DATA, sys.argv[1]), (resource.RLIMIT_CPU, sys.argv[2])):
        resource.setrlimit(kind, (int(value), resource.getrlimit(kind)[1]))
except (ImportError, ValueError, OSError):
    pass
os.execvp(sys.argv[3], sys.argv[3:])
"""

_ADVICE: Final[Mapping[str, str]] = {
    "Windows": "kernels are compiled on Linux and macOS only; run gaitswarm in WSL",
    "Darwin": "install one with `xcode-select --install`, or `pip install gaitswarm[compiler]`",
}


class Compiler(NamedTuple):
    """A C compiler: its command, and the first line of its version."""

    command: tuple[str, ...]
    version: str

    def flags(self, aim: Target) -> tuple[str, ...]:
        """Return the flags for a target; Zig spells levels in its own way."""
        clang = _is_zig(self.command) or "clang" in self.version.lower()
        flags = FLAGS if clang else (*FLAGS, *SCHEDULING)
        if not aim.level:
            return flags
        if _is_zig(self.command):
            return (*flags, "-mcpu=" + aim.level.replace("-", "_"))
        return (*flags, f"-march={aim.level}")


def find_compiler(architecture: str = "") -> Compiler | None:
    """Find a C compiler, once per process."""
    architecture = architecture or host_architecture()
    return _find(architecture, architecture == host_architecture())


@lru_cache(maxsize=4)
def _find(architecture: str, native: bool) -> Compiler | None:
    if platform.system() == "Windows":
        return None
    zig: list[str] = []
    if importlib.util.find_spec("ziglang"):
        zig = [sys.executable, "-m", "ziglang", "cc"]
    if native:
        commands = [shlex.split(os.environ.get("CC", "")), ["cc"], ["gcc"], ["clang"], zig]
    else:
        system = ["-target", f"{architecture}-linux-gnu"]
        commands = [[f"{architecture}-linux-gnu-gcc"], zig and [*zig, *system]]
        commands.append(["zig", "cc", *system])
    for command in filter(None, commands):
        version = _version(command)
        if version:
            return Compiler(tuple(command), version)
    return None


def without_compiler() -> str:
    """Explain that no compiler was found, with the remedy."""
    system = platform.system()
    advice = _ADVICE.get(system, "install gcc or clang, or `pip install gaitswarm[compiler]`")
    return f"no C compiler found: {advice}"


def run_compiler(
    compiler: Compiler, arguments: Sequence[str], scratch: Path, purpose: str, time_limit: float
) -> None:
    """Run a compiler within its limits."""
    command = shlex.join(compiler.command)
    # Temporary files of the compiler go with the directory, even if it is killed.
    environment = {**os.environ, "TMPDIR": str(scratch)}
    limits = [str(COMPILER_MEMORY), str(math.ceil(time_limit))]
    limited = [sys.executable, "-I", "-S", "-c", _LIMITED, *limits]
    try:
        done = _run([*limited, *compiler.command, *arguments], time_limit, environment)
    except subprocess.TimeoutExpired as error:
        raise KernelBuildError(
            f"{command} did not {purpose} within {time_limit:g} s and was terminated"
        ) from error
    except OSError as error:
        raise KernelBuildError(f"{command} cannot be run: {error}") from error
    if done.returncode != 0:
        raise KernelBuildError(f"{command} did not {purpose}:\n{done.stderr[-2000:]}")


def _is_zig(command: Sequence[str]) -> bool:
    return "ziglang" in command or Path(command[0]).name == "zig"


def _version(command: Sequence[str]) -> str:
    if not shutil.which(command[0]):
        return ""
    try:
        done = _run([*command, "--version"], _PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.partition("\n")[0] if done.returncode == 0 else ""


def _run(
    command: Sequence[str], time_limit: float, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """`subprocess.run` that also kills the command's children on timeout."""
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


TIME_LIMIT: Final = 300.0
"""Time limit of a compilation [s]; a kernel takes about five."""

_ATTEMPTS: Final = 3
"""Attempts to load a library that other processes remove."""

PREBUILT: Final = Path(__file__).with_name("prebuilt")
"""Libraries built by `python -m scripts.prebuilt`, which a wheel contains."""


def vector_header() -> str:
    """C source of the vector type that kernels use."""
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
    compile_for: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
) -> ctypes.CDLL | None:
    """Load a library from the cache, or compile it."""
    for _ in range(_ATTEMPTS):
        library = build_library(
            name,
            identity,
            source,
            compile_for=compile_for,
            extra_flags=extra_flags,
            time_limit=time_limit,
        )
        if library is None:
            return None
        try:
            return ctypes.CDLL(str(library))
        except OSError as error:
            # Another process may have removed it between finding and loading.
            if library.exists():
                raise KernelBuildError(
                    f"{library} cannot be loaded: {error}; set XDG_CACHE_HOME to a directory"
                    " that allows executable files"
                ) from error
    raise KernelBuildError(
        f"{name} was removed {_ATTEMPTS} times before it could be loaded; increase"
        f" {cache.SIZE_VARIABLE}"
    )


def build_library(
    name: str,
    identity: bytes,
    source: Callable[[], str],
    *,
    compile_for: Target | None = None,
    extra_flags: Sequence[str] = (),
    time_limit: float = TIME_LIMIT,
    directory: Path | None = None,
) -> Path | None:
    """Find a library in the cache or among the prebuilt ones, or compile it; without loading it."""
    aim = (compile_for or target()).resolved()
    hashed = hashlib.sha256(
        repr((FLAGS, SCHEDULING, *extra_flags, aim, platform.system())).encode()
    )
    hashed.update(identity)
    digest = hashed.hexdigest()[:24]
    # A part of a file name, of any robot's name.
    stem = f"{re.sub(r'[^A-Za-z0-9_-]+', '_', name)[:80]}-{digest}"
    compiler, signature = find_compiler(aim.architecture), "*"
    if compiler is not None:
        signature = hashlib.sha256(compiler.version.encode()).hexdigest()[:8]
    file = f"{stem}-{signature}.so"
    library, damaged = cache.find(file, directory)
    if library is None and directory is None and not os.environ.get("CC"):
        # Whichever robot it was built for.
        library, damaged_here = cache.find(f"*-{digest}-*.so", PREBUILT)
        damaged += damaged_here
    if library is not None:
        return library
    if compiler is None:
        if damaged:
            raise KernelBuildError(
                f"{damaged[0]} is damaged (checksum mismatch) and cannot be rebuilt:"
                f" {without_compiler()}, or restore both files"
            )
        return None
    arguments = [*compiler.flags(aim), *extra_flags]

    def make(built: Path) -> None:
        code = built.with_name("kernel.c")
        code.write_text(f"#define DOUBLES {aim.lanes}\n{source()}", encoding="utf-8")
        # libm for its fma, on processors without one.
        arguments.extend([str(code), "-o", str(built), "-lm"])
        run_compiler(compiler, arguments, built.parent, f"compile {stem}", time_limit)

    return cache.build(stem, file, make, directory)
