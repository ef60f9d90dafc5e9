"""Speed of the simulator on one core, for the main Fuzzy-PI job.

python -m benchmarks.simulator [--repeats 3] [--precision double] [--json]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from gaitswarm.sim.assembly import PHYSICS_RATE, Backend, kernel_of
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import NativeKernel
from gaitswarm.sim.kernel.walk import KernelTime, walk_together
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulating


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """Speed of a pass."""

    us_per_step_per_walker: float  # wall time per physics step and walker [us]
    real_time_factor_per_core: float  # simulated per elapsed time [1]
    lanes: int  # walkers stepped together
    lane_use: float  # share of the lanes' time spent walking [1]
    backend: str  # `native` or `reference`
    precision: Precision
    walkers: int  # per scenario
    simulated_seconds: float  # of all walks [s]
    elapsed_seconds: float  # wall time of the pass [s]


def measure(
    *,
    repeats: int = 3,
    walkers: int = 24,
    backend: Backend = "auto",
    robot: str = DEFAULT_ROBOT,
    precision: Precision = "double",
) -> BenchmarkResult:
    """Time whole simulations (control, physics, objectives) of the six scenarios in this thread.

    The walkers are the published optimum A; each scenario counts with its share of the job. All
    simulations run in one call of the kernel, as in a worker's task.
    """
    kernel = kernel_of(load_robot(robot), backend, precision=precision)
    native = isinstance(kernel, NativeKernel)
    count = walkers if native else 1
    scenarios = SCENARIOS if native else SCENARIOS[:1]
    passes = [
        _walk(scenarios, count, backend=backend, robot=robot, precision=precision)
        for _ in range(repeats)
    ]
    elapsed, spent = min(passes, key=lambda one: one[0])
    simulated = count * sum(scenario.duration for scenario in scenarios)
    return BenchmarkResult(
        us_per_step_per_walker=elapsed / (simulated * PHYSICS_RATE) * 1e6,
        real_time_factor_per_core=simulated / elapsed,
        lanes=kernel.lanes,
        lane_use=spent.lane_use.share,
        backend=kernel.backend,
        precision=precision,
        walkers=count,
        simulated_seconds=simulated,
        elapsed_seconds=elapsed,
    )


def _walk(
    scenarios: Sequence[Scenario],
    walkers: int,
    *,
    backend: Backend,
    robot: str,
    precision: Precision,
) -> tuple[float, KernelTime]:
    """Return the wall time of a pass [s], and the kernel's share of it."""
    design = CONTROLLERS["fuzzy-pi"].published["A"]
    designs = np.tile(np.array(list(design.values())), (walkers, 1))
    spent = KernelTime()
    start = time.perf_counter()
    walk_together(
        [
            simulating(
                scenario,
                "fuzzy-pi",
                list(design),
                designs,
                robot=robot,
                backend=backend,
                precision=precision,
            )
            for scenario in scenarios
        ],
        spent,
    )
    return time.perf_counter() - start, spent


def main() -> None:
    """Print the fastest pass."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3, help="passes; the fastest one counts")
    parser.add_argument("--precision", choices=("double", "single"), default="double")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    result = measure(repeats=options.repeats, precision=options.precision)
    if options.json:
        print(json.dumps(asdict(result), indent=2))
        return
    print(
        f"{result.backend} kernel in {result.precision} precision, {result.lanes} walkers in"
        f" lock-step: {result.us_per_step_per_walker:.3f} us per physics step and walker,"
        f" {result.real_time_factor_per_core:.0f} x real time on one core,"
        f" {result.lane_use:.1%} of its lanes used"
    )


if __name__ == "__main__":
    main()
