"""Designs walk in MuJoCo, with its rigid bodies and integrator, and its contacts if wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import Field

from gaitswarm.plugins import (
    CaseFamily,
    CaseSettings,
    Objective,
    Outcome,
    Walk,
    load_robot,
)


class MujocoSettings(CaseSettings):
    """What a job can set of the case."""

    name: Literal["mujoco-walk"] = "mujoco-walk"
    rate: int = Field(
        default=5000, ge=1000, le=100_000, multiple_of=500, description="Steps a second [Hz]."
    )
    contacts: bool = Field(
        default=True, description="Whether MuJoCo's contacts meet the ground, or gaitswarm's laws."
    )


@dataclass(frozen=True)
class MujocoWalk:
    """Stands for a walk: the same robot, controller, scenario and variables, another engine."""

    settings: MujocoSettings
    walk: Walk

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.walk.name

    @property
    def duration(self) -> float:
        """Simulated time of one walk [s]."""
        return self.walk.duration

    @property
    def robots(self) -> tuple[Any, ...]:
        """The robot that walks."""
        return self.walk.robots

    @property
    def precision(self) -> Literal["double"]:
        """MuJoCo computes in double precision."""
        return "double"

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Those of a walk."""
        return self.walk.objectives

    def run(self, designs: np.ndarray) -> Outcome:
        """Let every design walk."""
        return self.run_until(designs, lambda: False)

    def run_until(self, designs: np.ndarray, should_stop: Callable[[], bool]) -> Outcome:
        """Let every design walk; a walk takes seconds, and a job that is paused breaks it off."""
        # MuJoCo is imported by workers alone.
        from gaitswarm.sim.mujoco.kernel import MujocoKernel

        kernel = MujocoKernel(
            load_robot(self.walk.robot),
            soles="spheres" if self.settings.contacts else "none",
            rate=self.settings.rate,
            should_stop=should_stop,
        )
        return self.walk.run_with(kernel, designs)


FAMILY = CaseFamily(
    settings=MujocoSettings,
    summary="A walk in MuJoCo: its rigid bodies, integrator and contacts",
    create=MujocoWalk,
    libraries=("mujoco-core",),
)
