"""Noise between gearhead and link (the thesis's study, table 2.9)."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from pydantic import Field, model_validator

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data
from gaitswarm.sim.robot.description import JOINTS_PER_LEG

LARGEST_ANGLE: Final = 0.5
"""Largest standard deviation [rad]."""


class LinkNoise(Data):
    """White noise between gearhead and link of all links of one kind, new at every control tick.

    An angle displaces the link against its gearhead, so the robot needs elastic shafts
    (`sim.robot.robot.with_shafts`); `sim.simulate.simulate` adds them.
    """

    link: Literal[1, 2, 3] = Field(description="Links disturbed: 1 coxa, 2 femur, 3 tibia.")
    deviation: float = Field(gt=0.0, le=100.0)
    """Standard deviation [N m], or of an angle [rad]."""
    kind: Literal["torque", "angle"] = "torque"
    """A torque on the links, or an angle between gearheads and links."""
    seed: int = Field(default=1, ge=0, lt=2**63, description="Seed of the noise.")

    @model_validator(mode="after")
    def _angles_are_small(self) -> LinkNoise:
        if self.kind == "angle" and self.deviation > LARGEST_ANGLE:
            raise ValueError(
                f"deviation: {self.deviation:g} rad is more than {LARGEST_ANGLE:g} rad; noise of an"
                " angle is in rad"
            )
        return self

    def samples(self, ticks: int, joints: int) -> Floats:
        """Return noise (ticks, joints) [N m] or [rad]; a longer walk begins with the same noise.

        Args:
            ticks: Control ticks of the walk.
            joints: Joints of the robot.
        """
        generator = np.random.Generator(np.random.Philox(key=[self.seed, self.link]))
        kind = np.arange(joints) % JOINTS_PER_LEG == self.link - 1
        noise = np.zeros((ticks, joints))
        noise[:, kind] = self.deviation * generator.standard_normal((ticks, int(kind.sum())))
        return noise
