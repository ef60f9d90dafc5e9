"""Noise between gearhead and link (the thesis's study, table 2.9)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sim.robot.description import JOINTS_PER_LEG


class LinkNoise(BaseModel):
    """White torque noise on all links of one kind, a new value at every control tick."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    link: Literal[1, 2, 3] = Field(description="Links disturbed: 1 coxa, 2 femur, 3 tibia.")
    deviation: float = Field(gt=0.0, le=100.0, description="Standard deviation [N m].")
    seed: int = Field(default=1, ge=0, lt=2**63, description="Same seed, same noise.")

    def torques(self, ticks: int, joints: int) -> NDArray[np.float64]:
        """Torques of a whole walk; a longer one has the same noise as a shorter one, and more.

        Args:
            ticks: Control ticks.
            joints: Number of joints.

        Returns:
            (ticks, joints) [N m].
        """
        generator = np.random.Generator(np.random.Philox(key=[self.seed, self.link]))
        kind = np.arange(joints) % JOINTS_PER_LEG == self.link - 1
        torques = np.zeros((ticks, joints))
        torques[:, kind] = self.deviation * generator.standard_normal((ticks, int(kind.sum())))
        return torques
