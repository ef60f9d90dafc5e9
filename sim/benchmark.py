"""How fast this machine simulates: one core, the physics of the main Fuzzy-PI job."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from sim.assembly import PHYSICS_RATE, Backend
from sim.controllers import CONTROLLERS
from sim.robot import DEFAULT_ROBOT
from sim.scenario import SCENARIOS
from sim.simulate import lanes, prepare, simulate


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """How fast a pass was.

    Attributes:
        us_per_step_per_walker: wall time of a physics step of one walker [us].
        real_time_factor_per_core: simulated over elapsed seconds [1].
        lanes: walkers that are stepped together.
        backend: `native` or `reference`.
        walkers: walks of every scenario.
        simulated_seconds: of all walks together [s].
        elapsed_seconds: wall time of the pass [s].
    """

    us_per_step_per_walker: float
    real_time_factor_per_core: float
    lanes: int
    backend: str
    walkers: int
    simulated_seconds: float
    elapsed_seconds: float


def measure(
    *,
    repeats: int = 3,
    walkers: int = 24,
    backend: Backend = "auto",
    robot: str = DEFAULT_ROBOT,
) -> BenchmarkResult:
    """Time whole walks (control, physics, objectives) of the six scenarios in this thread.

    The walkers are the published optimum A; every scenario counts with its share of the job.

    Args:
        repeats: Passes, of which the fastest counts: anything slower is the machine's other work.
        walkers: Walks of every scenario; the reference kernel walks one, in one scenario.
        backend: Which kernel.
        robot: A shipped robot.

    Returns:
        The fastest pass.
    """
    controller = CONTROLLERS["fuzzy-pi"]
    design = controller.published["A"]
    used = prepare(robot, backend=backend)
    width = lanes() if used == "native" else 1
    count = walkers if used == "native" else 1
    designs = np.tile(np.array(list(design.values())), (count, 1))
    scenarios = SCENARIOS if used == "native" else SCENARIOS[:1]
    simulated = count * sum(scenario.duration for scenario in scenarios)
    passes = []
    for _ in range(repeats):
        start = time.perf_counter()
        for scenario in scenarios:
            simulate(
                scenario,
                "fuzzy-pi",
                list(design),
                designs,
                robot=robot,
                backend=backend,
            )
        passes.append(time.perf_counter() - start)
    elapsed = min(passes)
    return BenchmarkResult(
        us_per_step_per_walker=elapsed / (simulated * PHYSICS_RATE) * 1e6,
        real_time_factor_per_core=simulated / elapsed,
        lanes=width,
        backend=used,
        walkers=count,
        simulated_seconds=simulated,
        elapsed_seconds=elapsed,
    )
