"""What C code is compiled for: an architecture, its level, its lanes."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

X86: Final = "x86_64"
ARM: Final = "aarch64"

_SPELLINGS: Final[Mapping[str, str]] = {"amd64": X86, "x64": X86, "arm64": ARM}
"""What systems call these two; Windows says AMD64, macOS arm64."""


def host_architecture() -> str:
    """The architecture of this machine."""
    machine = platform.machine().lower()
    return _SPELLINGS.get(machine, machine)


@dataclass(frozen=True, slots=True)
class Target:
    """What code is compiled for.

    Attributes:
        lanes: Doubles in a vector register.
        level: Micro-architecture level of the x86-64 ABI as GCC names it, or empty for the
            architecture's plain one.
        architecture: As `host_architecture` spells it; empty for this machine's.
    """

    lanes: int
    level: str = ""
    architecture: str = ""

    def resolved(self) -> Target:
        """This target, with the architecture named."""
        return Target(self.lanes, self.level, self.architecture or host_architecture())


# Named levels rather than -march=native: one binary for all machines of a level. A machine has a
# level if its CPU has the flags of this one and of all below it.
_V2: Final = frozenset({"cx16", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"})
_V3: Final = _V2 | {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
_V4: Final = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}

X86_TARGETS: Final[Mapping[Target, frozenset[str]]] = {
    Target(8, "x86-64-v4", X86): _V4,
    Target(4, "x86-64-v3", X86): _V3,
    Target(2, "x86-64-v2", X86): _V2,
}
"""Levels from the widest on, each with the CPU flags that it needs, as Linux names them."""

ARM_TARGET: Final = Target(2, "", ARM)
"""NEON, which every aarch64 has."""


@lru_cache(maxsize=1)
def target() -> Target:
    """The widest target that this machine runs."""
    if host_architecture() == X86:
        flags = cpu_flags()
        for candidate, needed in X86_TARGETS.items():
            if needed <= flags:
                return candidate
    return Target(2).resolved()


def cpu_flags() -> frozenset[str]:
    """What this machine's x86-64 CPU can do, as far as the system says so."""
    try:
        if platform.system() == "Darwin":
            return _flags_of_macos(subprocess.check_output(_SYSCTL, text=True, timeout=10.0))
        return frozenset(Path("/proc/cpuinfo").read_text(encoding="utf-8").split())
    except (OSError, subprocess.SubprocessError):
        return frozenset()


_SYSCTL: Final = (
    *("/usr/sbin/sysctl", "-n"),
    *("machdep.cpu.features", "machdep.cpu.leaf7_features"),
)


def _flags_of_macos(text: str) -> frozenset[str]:
    """`SSE4.1` is Linux's `sse4_1`, and only one flag has another name."""
    flags = frozenset(text.lower().replace(".", "_").split())
    return flags | {"pni"} if "sse3" in flags else flags
