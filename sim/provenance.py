"""Provenance: everything that a case's outcome depends on besides the case and its designs"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import OBJECTIVES_VERSION
from gaitswarm.sim.plugins import MISSING, source_digest, version_of
from gaitswarm.sim.robot import RobotSource, load_robot

_ROOT: Final = Path(__file__).parent

_SUFFIXES: Final = (".py", ".c", ".h")

_TABLES: Final = (_ROOT / "presets.toml", *_ROOT.rglob("variables.toml"))
"""Data of the simulator; descriptions of robots have digests of their own."""

_NOT_IN_A_CASE: Final = (
    "measurement",
    "proposal",
    "provenance.py",
    "replay.py",
    "robot/meshes.py",
    "validation.py",
)
"""Modules and packages of `sim` that no case uses."""

LIBRARIES: Final = ("casadi", "numpy", "pin")
"""Distributions that compute: the kernel's source, trajectories and controllers."""

_DIGITS: Final = 32


class Provenance(BaseModel):
    """Everything that outcomes for a robot depend on. Only results with equal ones may be mixed."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    robot: str = Field(
        description="Name in the robot's file; several separated by commas.",
        examples=["szabadka2"],
    )
    robot_digest: str = Field(
        description="Digest of the robot's resolved parameters and of its URDF.",
        examples=["6a09e667f3bcc908b2fb1366ea957d3e"],
    )
    code_digest: str = Field(
        description="Digest of the simulator's source files, comments included.",
        examples=["bb67ae8584caa73b5be0cd19137e2179"],
    )
    libraries: dict[str, str] = Field(
        description="Versions of the libraries that it computes with.",
        examples=[{"casadi": "3.8.2", "numpy": "2.4.6", "pin": "4.1.0"}],
    )
    backend: Literal["native", "reference"] = Field(
        description="The compiled kernel (native), or the interpreter without a C compiler.",
        examples=["native"],
    )
    precision: Precision = Field(
        default="double",
        description="Precision of the physics. Results of different precisions are never mixed.",
        examples=["double"],
    )
    objectives: int = Field(
        default=OBJECTIVES_VERSION,
        ge=1,
        description="Version of the objectives' definitions.",
        examples=[OBJECTIVES_VERSION],
    )

    def changes(self, now: Provenance) -> tuple[str, ...]:
        differences: list[str] = []
        if now.robot != self.robot:
            differences.append(f"the robot {now.robot} instead of {self.robot}")
        elif now.robot_digest != self.robot_digest:
            differences.append(f"the robot {self.robot} has changed")
        if now.code_digest != self.code_digest:
            differences.append("changed simulation code")
        differences += version_changes(self.libraries, now.libraries)
        if now.backend != self.backend:
            cause = "no C compiler: " if now.backend == "reference" else ""
            differences.append(f"{cause}backend {now.backend} instead of {self.backend}")
        if now.precision != self.precision:
            differences.append(f"precision {now.precision} instead of {self.precision}")
        return tuple(differences)


def version_changes(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    return [
        f"{name} {now.get(name, MISSING)} instead of {before.get(name, MISSING)}"
        for name in sorted(before.keys() | now.keys())
        if before.get(name, MISSING) != now.get(name, MISSING)
    ]


@lru_cache(maxsize=32)
def provenance_of(
    *robots: RobotSource,
    precision: Precision = "double",
    libraries: tuple[str, ...] = LIBRARIES,
) -> Provenance:
    """Return the provenance of this process's results for robots, without compiling."""
    from gaitswarm.sim.assembly import has_native_kernel

    machines = [load_robot(robot) for robot in robots]
    content = "".join(m.description.model_dump_json() + m.urdf.text for m in machines)
    # With a compiler, the kernel is compiled or fails; the reference never replaces it.
    native = all(has_native_kernel(machine, precision) for machine in machines)
    return Provenance(
        robot=", ".join(machine.description.name for machine in machines),
        robot_digest=hashlib.sha256(content.encode()).hexdigest()[:_DIGITS],
        code_digest=simulator_digest(),
        libraries={name: version_of(name) for name in libraries},
        backend="native" if native else "reference",
        precision=precision,
        objectives=OBJECTIVES_VERSION,
    )


def simulator_files() -> tuple[Path, ...]:
    left_out = [_ROOT / name for name in _NOT_IN_A_CASE]
    return tuple(
        sorted(
            file
            for file in _ROOT.rglob("*")
            if (file.suffix in _SUFFIXES or file in _TABLES)
            and not {file, *file.parents} & set(left_out)
        )
    )


@lru_cache(maxsize=1)
def simulator_digest() -> str:
    """Return the digest of the source files of `sim`, as they were at the first call."""
    return source_digest(_ROOT, simulator_files())
