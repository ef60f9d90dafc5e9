"""Provenance: what the outcome of a case depends on, beside the case itself and its designs.

A job keeps the provenance of its numbers, and every task answers with that of the process that ran
it, so that a robot file, code or a compiler that changed meanwhile is noticed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.sim.assembly import has_native_kernel
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import OBJECTIVES_VERSION
from gaitswarm.sim.plugins import MISSING, source_digest, version_of
from gaitswarm.sim.robot import RobotSource, load_robot

_ROOT: Final = Path(__file__).parent

_SUFFIXES: Final = (".py", ".c", ".h")

_NOT_IN_A_CASE: Final = (
    "benchmark.py",
    "drives.py",
    "measurement",
    "proposal",
    "provenance.py",
    "replay.py",
    "robot/shapes.py",
    "validation.py",
)
"""Modules and packages of `sim` that no case runs through."""

LIBRARIES: Final = ("casadi", "numpy", "pin")
"""Distributions that compute: of the kernel's source, of trajectories and of controllers."""

_DIGITS: Final = 32


class Provenance(BaseModel):
    """What the outcome of a robot's cases depends on. Equal ones may be mixed, others not."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: str = Field(
        description="Name that the robot's file gives it; several separated by commas.",
        examples=["szabadka2"],
    )
    robot_digest: str = Field(
        description="Digest of the robot's parameters, as they were resolved, and of its URDF.",
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
        description="Of the physics' numbers. Numbers of one are never mixed with the other's.",
        examples=["double"],
    )
    objectives: int = Field(
        default=OBJECTIVES_VERSION,
        ge=1,
        description="Version of the objectives' definitions.",
        examples=[OBJECTIVES_VERSION],
    )

    def changes(self, now: Provenance) -> tuple[str, ...]:
        """What is different now, in words for people."""
        found: list[str] = []
        if now.robot != self.robot:
            found.append(f"the robot {now.robot} instead of {self.robot}")
        elif now.robot_digest != self.robot_digest:
            found.append(f"the robot {self.robot} has other contents")
        if now.code_digest != self.code_digest:
            found.append("other simulation code")
        found += version_changes(self.libraries, now.libraries)
        if now.backend != self.backend:
            cause = "no C compiler: " if now.backend == "reference" else ""
            found.append(f"{cause}backend {now.backend} instead of {self.backend}")
        if now.precision != self.precision:
            found.append(f"precision {now.precision} instead of {self.precision}")
        return tuple(found)


def version_changes(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """What is different of libraries, in words for people."""
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
    """The provenance of what this process computes of robots; nothing is compiled for it."""
    machines = [load_robot(robot) for robot in robots]
    content = "".join(m.description.model_dump_json() + m.urdf.text for m in machines)
    # With a compiler, a kernel is compiled or an error is raised: never replaced by the reference.
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
    """The source files of `sim` that a case may run through, in order."""
    left_out = [_ROOT / name for name in _NOT_IN_A_CASE]
    return tuple(
        sorted(
            file
            for file in _ROOT.rglob("*")
            if file.suffix in _SUFFIXES and not {file, *file.parents} & set(left_out)
        )
    )


@lru_cache(maxsize=1)
def simulator_digest() -> str:
    """Digest of the source files of `sim`, as they are when it is called first.

    A process that lives long calls it early, while they are still those that it has imported.
    """
    return source_digest(_ROOT, simulator_files())
