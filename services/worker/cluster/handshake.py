"""What a node says of itself, before it is given any walks."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from gaitswarm.sim.compiler.compilation import target
from gaitswarm.sim.plugins import plugin_versions, source_digest
from gaitswarm.sim.provenance import simulator_digest

_ROOT: Final = Path(__file__).parents[1]

_UNKNOWN: Final = "unknown"

_SHOWN: Final = 8
"""Digits of a digest in a message."""


@dataclass(frozen=True, slots=True)
class Introduction:
    """What a process says of itself to another one.

    Attributes:
        host: Name of its machine.
        gaitswarm: Version of the installed package, for people.
        code: Digest of the simulator's source files and of those that carry walks.
        arithmetic: Digest of what NumPy's functions come to, to the last bit.
        level: Micro-architecture that its kernels are compiled for, for people.
        plugins: Distributions of its plug-ins, with versions and digests of their code.
        problem: Why it cannot say more; "" if it can.
    """

    host: str
    gaitswarm: str = _UNKNOWN
    code: str = _UNKNOWN
    arithmetic: str = _UNKNOWN
    level: str = _UNKNOWN
    plugins: str = _UNKNOWN
    problem: str = ""

    @classmethod
    def of(cls, said: Mapping[str, str]) -> Introduction:
        """Read what `introducer`'s function returned.

        Args:
            said: Values by name, of any version of gaitswarm; unknown names are left out.

        Returns:
            The introduction.
        """
        return cls(**{name: said[name] for name in cls.__slots__ if name in said})

    def refusal(self, here: Introduction) -> str | None:
        """Why this process may not compute for another one.

        Args:
            here: Who wants walks.

        Returns:
            For people, with both versions; None if its numbers are those of `here`, bit for bit.
        """
        if self.problem:
            return f"it runs gaitswarm {self.gaitswarm}, not {here.gaitswarm}: {self.problem}"
        if self.code != here.code:
            return (
                f"it runs gaitswarm {self.gaitswarm} (code {self.code[:_SHOWN]}),"
                f" not {here.gaitswarm} (code {here.code[:_SHOWN]})"
            )
        if self.plugins != here.plugins:
            return (
                f"its plug-ins are {self.plugins}, not {here.plugins}; install the same"
                " distributions on all nodes (gaitswarm plugins)"
            )
        if self.arithmetic != here.arithmetic:
            return (
                f"its NumPy computes other bits on {self.level} than this runner's on {here.level};"
                " set NPY_DISABLE_CPU_FEATURES to the same on all nodes (docs/cluster.md)"
            )
        return None


def introducer() -> Callable[[], dict[str, str]]:
    """A function that lets a process introduce itself.

    Returns:
        A function that is sent to another process by value, not by name: it runs with any version
        of gaitswarm, and without one.
    """

    def introduce() -> dict[str, str]:
        import platform  # noqa: PLC0415 - what it needs travels with it
        from importlib import metadata  # noqa: PLC0415

        said = {"host": platform.node(), "gaitswarm": "none"}
        try:
            said["gaitswarm"] = metadata.version("gaitswarm")
            from gaitswarm.services.worker.cluster.handshake import fingerprint  # noqa: PLC0415

            said |= fingerprint()
        except Exception as error:  # noqa: BLE001 - anything may be wrong there
            said["problem"] = f"{type(error).__name__}: {error}"
        return said

    return introduce


def fingerprint() -> dict[str, str]:
    """What the numbers of this process depend on, beside a job's robot and libraries.

    Returns:
        `code`, `plugins`, `arithmetic` and `level` of an `Introduction`.
    """
    installed = (f"{name} {version}" for name, version in plugin_versions().items())
    return {
        "code": _code(),
        "plugins": ", ".join(installed) or "none",
        "arithmetic": arithmetic_digest(),
        "level": target().level or "plain",
    }


@lru_cache(maxsize=1)
def _code() -> str:
    carrying = source_digest(_ROOT, sorted(_ROOT.rglob("*.py")))
    return hashlib.sha256(f"{simulator_digest()}{carrying}".encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def arithmetic_digest() -> str:
    """Digest of the bits that NumPy's functions give, for arguments that cover their ranges.

    Kernels give the same bits at every level, as they are tested to; NumPy, with which desired
    angles and controllers' tables are computed, has code of its own for some levels.

    Returns:
        Hexadecimal digits; two processes with the same ones round alike.
    """
    unit = np.linspace(-1.0, 1.0, 2003)
    wide = unit * 41.0
    across = np.roll(wide, 700)
    results = (
        *(function(unit) for function in (np.arccos, np.arcsin, np.arctan)),
        *(function(wide) for function in (np.sin, np.cos, np.tan, np.exp, np.tanh)),
        *(function(np.abs(wide) + 0.25) for function in (np.sqrt, np.log)),
        np.arctan2(wide, across),
        np.hypot(wide, across),
        np.power(np.abs(wide) + 0.25, unit),
    )
    digest = hashlib.sha256(b"".join(result.tobytes() for result in results))
    return digest.hexdigest()[:32]
