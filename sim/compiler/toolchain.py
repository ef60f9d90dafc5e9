"""C compilers: found, asked for their version, and ended in time."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import os
import platform
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from gaitswarm.sim.compiler.target import Target, host_architecture
from gaitswarm.sim.errors import KernelBuildError

# No contraction into fused multiply-adds and no fast-math: a lane's bits must not depend on
# compiler or machine. Integers wrap: a lane that has diverged computes on. Zig's compiler adds what
# a debugger needs, ten times the code, unless it is told not to.
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
"""For every compiler and target."""

SCHEDULING: Final = ("-fschedule-insns", "-fsched-pressure")
"""For GCC, which orders a limb's instructions a tenth slower without them. Clang has its own."""

_PROBE_LIMIT: Final = 30.0
"""Seconds that a compiler may take to say its version."""

COMPILER_MEMORY: Final = 8 << 30
"""Data that a process of a compiler may have [B]; a kernel takes one a fortieth of that."""

# Limits are set in the process that becomes the compiler, and are those of all that it starts.
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


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler: its command, and the first line it says of its version."""

    command: tuple[str, ...]
    version: str

    def flags(self, aim: Target) -> tuple[str, ...]:
        """Flags for a target, whose level zig spells in its own way."""
        flags = FLAGS if self._is_clang else (*FLAGS, *SCHEDULING)
        if not aim.level:
            return flags
        if _is_zig(self.command):
            return (*flags, "-mcpu=" + aim.level.replace("-", "_"))
        return (*flags, f"-march={aim.level}")

    @property
    def _is_clang(self) -> bool:
        return _is_zig(self.command) or "clang" in self.version.lower()


def find_compiler(architecture: str = "") -> Compiler | None:
    """Look for a C compiler, once a process."""
    wanted = architecture or host_architecture()
    return _find(wanted, wanted == host_architecture())


@lru_cache(maxsize=4)
def _find(architecture: str, native: bool) -> Compiler | None:
    if platform.system() == "Windows":
        return None
    for command in _for_this_machine() if native else _for_another(architecture):
        version = _version(command)
        if version:
            return Compiler(tuple(command), version)
    return None


def without_compiler() -> str:
    """What is missing where nothing can be compiled."""
    system = platform.system()
    advice = _ADVICE.get(system, "install gcc or clang, or `pip install gaitswarm[compiler]`")
    return f"no C compiler found: {advice}"


def run_compiler(
    compiler: Compiler, arguments: Sequence[str], scratch: Path, purpose: str, time_limit: float
) -> None:
    """Run a compiler to its end."""
    command = shlex.join(compiler.command)
    # What the compiler keeps for itself goes with the directory, even if it is killed.
    environment = {**os.environ, "TMPDIR": str(scratch)}
    limits = [str(COMPILER_MEMORY), str(math.ceil(time_limit))]
    limited = [sys.executable, "-I", "-S", "-c", _LIMITED, *limits]
    try:
        done = _run([*limited, *compiler.command, *arguments], time_limit, environment)
    except subprocess.TimeoutExpired as error:
        raise KernelBuildError(
            f"{command} did not {purpose} within {time_limit:g} s, and was ended"
        ) from error
    except OSError as error:
        raise KernelBuildError(f"{command} cannot be run: {error}") from error
    if done.returncode != 0:
        raise KernelBuildError(f"{command} did not {purpose}:\n{done.stderr[-2000:]}")


def _for_this_machine() -> Iterable[list[str]]:
    yield from (shlex.split(os.environ.get("CC", "")), ["cc"], ["gcc"], ["clang"])
    yield from _zig()


def _for_another(architecture: str) -> Iterable[list[str]]:
    yield [f"{architecture}-linux-gnu-gcc"]
    for zig in (*_zig(), ["zig", "cc"]):
        yield [*zig, "-target", f"{architecture}-linux-gnu"]


def _zig() -> Iterable[list[str]]:
    if importlib.util.find_spec("ziglang"):
        yield [sys.executable, "-m", "ziglang", "cc"]


def _is_zig(command: Sequence[str]) -> bool:
    return "ziglang" in command or Path(command[0]).name == "zig"


def _version(command: Sequence[str]) -> str:
    if not command or not shutil.which(command[0]):
        return ""
    try:
        done = _run([*command, "--version"], _PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.partition("\n")[0] if done.returncode == 0 else ""


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
