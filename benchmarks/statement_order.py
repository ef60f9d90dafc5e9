"""Effect of the order of statements in generated C, against CasADi's order.

    python -m benchmarks.statement_order [--rounds 9] [--json]

Whole walks, 64 at a time in one thread, of kernels that differ in the order of statements alone:
for two robots, in both precisions, at each level of x86-64 with fused multiply-add that this
machine has. Each pair takes turns; what is compared are medians of the thread's own processor time,
which other work is not part of. Results are compared to the bit.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Final
from unittest.mock import patch

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.compiler.compilation import X86_TARGETS, Target, cpu_flags, load_library, target
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.emitted import emit_c
from gaitswarm.sim.kernel.emitted.source import kernel_source
from gaitswarm.sim.kernel.native import NativeKernel
from gaitswarm.sim.kernel.walk import WalkSetup
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS

ROBOTS: Final = ("szabadka2", "szabadka2-reconstructed")
PRECISIONS: Final[tuple[Precision, ...]] = ("double", "single")
WALKERS: Final = 64


@dataclass(frozen=True, slots=True)
class Gain:
    """Processor time of a physics step and walker [us], and by what it fell."""

    robot: str
    precision: str
    level: str
    as_derived: float
    ordered: float

    @property
    def ratio(self) -> float:
        return self.as_derived / self.ordered


def kernel(robot: Robot, precision: Precision, aim: Target, *, in_order: bool) -> NativeKernel:
    """A kernel, its statements in their order or in that in which they were derived."""
    if in_order:
        source = kernel_source(robot, precision)
    else:
        with patch.object(emit_c, "ordered", iter):
            source = kernel_source(robot, precision)
    library = load_library("order-check", source.encode(), lambda: source, compile_for=aim)
    if library is None:
        raise SystemExit("no C compiler found: there is nothing to compare")
    return NativeKernel(robot, library)


def gains(rounds: int) -> Iterator[Gain]:
    """Robot by robot; of levels the widest first."""
    flags = cpu_flags()
    levels = [aim for aim, needed in X86_TARGETS.items() if "fma" in needed <= flags]
    for name in ROBOTS:
        robot = load_robot(name)
        coding, timestep = control_steps(robot)
        plan = plan_walk(robot, SCENARIOS[0], timestep)
        assert plan is not None
        law = CONTROLLERS["fuzzy-pi"].compile(CONTROLLERS["fuzzy-pi"].published["A"])
        setups: list[WalkSetup] = [plan(law)] * WALKERS
        steps = WALKERS * setups[0].ticks * coding.substeps
        for precision in PRECISIONS:
            for aim in levels or [target()]:
                both = [kernel(robot, precision, aim, in_order=way) for way in (False, True)]
                times: list[list[float]] = [[], []]
                ends = set()
                for _ in range(rounds):
                    for own, compiled in zip(times, both, strict=True):
                        begun = time.thread_time()
                        walked = compiled.walk(setups, coding, log=False)
                        own.append((time.thread_time() - begun) / steps * 1e6)
                        ends.add(b"".join(walk.sums.tobytes() for walk in walked))
                assert len(ends) == 1, "the order of statements must not change a bit"
                level = aim.level or "plain"
                yield Gain(name, precision, level, *map(statistics.median, times))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = list(gains(given.rounds))
    if given.json:
        print(json.dumps([{**asdict(gain), "ratio": gain.ratio} for gain in found]))
        return
    print(
        f"{'robot':24} {'precision':10} {'level':10} {'as derived':>10} {'ordered':>8} {'gain':>6}"
    )
    for gain in found:
        print(
            f"{gain.robot:24} {gain.precision:10} {gain.level:10} {gain.as_derived:10.3f}"
            f" {gain.ordered:8.3f} {gain.ratio:6.3f}"
        )
    mean = statistics.geometric_mean(gain.ratio for gain in found)
    print(f"{'geometric mean':64} {mean:8.3f}")


if __name__ == "__main__":
    main()
