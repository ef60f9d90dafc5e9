"""A design's walk through worlds, each computed by an engine of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.walk import Kernel, Precision
from gaitswarm.sim.mujoco.engines import ENGINES, check_installed
from gaitswarm.sim.mujoco.mjcf import Soles
from gaitswarm.sim.outcome import N_OBJECTIVES, Objective, Outcome
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.worlds.world_walk import WorldWalk

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EngineWalk:
    """Worlds that say which engine computes them.

    A walk in another engine takes some hundred times as long, so that it can be broken off.

    Attributes:
        walk: that is walked, whose worlds are without the column of the engine.
        engine_column: index of that column: 0 for our own engine, k for the k-th of `ENGINES`.
    """

    walk: WorldWalk
    engine_column: int

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.walk.name

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """The robot as described."""
        return self.walk.robots

    @property
    def duration(self) -> float:
        """Simulated time of one world [s]."""
        return self.walk.duration

    @property
    def precision(self) -> Precision:
        """Of our own engine's numbers; the others have double precision alone."""
        return self.walk.precision

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1."""
        return self.walk.objectives

    def run(self, designs: Floats) -> Outcome:
        """Let the design walk in every world."""
        return self.run_until(designs, lambda: False)

    def run_until(self, designs: Floats, should_stop: Callable[[], bool]) -> Outcome:
        """Let the design walk in every world, unless nobody waits for it any more.

        Args:
            designs: (n, v) worlds, with the column of the engine.
        """
        engines = designs[:, self.engine_column].astype(np.intp)
        worlds = np.delete(designs, self.engine_column, axis=1)
        objectives = np.full((len(designs), N_OBJECTIVES), np.nan)
        statuses = np.zeros(len(designs), dtype=np.uint8)
        for engine in np.unique(engines).tolist():
            rows = np.flatnonzero(engines == engine)
            kernel = self._kernel(engine, should_stop) if engine else None
            found = self.walk.run_with(kernel, worlds[rows])
            objectives[rows], statuses[rows] = found.objectives, found.statuses
        return Outcome(objectives, statuses)

    def _kernel(self, engine: int, should_stop: Callable[[], bool]) -> Kernel:
        check_installed()
        # Whoever has none of these walks need not have MuJoCo.
        from gaitswarm.sim.mujoco.kernel import MujocoKernel  # noqa: PLC0415

        robot = load_robot(self.walk.robot)
        own_contacts = tuple(ENGINES)[engine - 1] == "mujoco-contacts"
        soles: Soles = "spheres" if own_contacts else "none"
        return MujocoKernel(robot, soles=soles, should_stop=should_stop)
