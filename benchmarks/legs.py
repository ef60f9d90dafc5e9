"""Cost of legs: a quadruped's compiled kernel against the hexapod's.

    python -m benchmarks.legs [--rounds 7] [--json]

Whole walks (control, physics, objectives) under the same PI controller, 24 at a time in one thread:
the default hexapod in its first scenario, examples/quadruped in its crawl, and a1 in its faster
proposed walk where its URDF is there (`scripts/robots.sh`). And each stands for as long as the
hexapod walks: while no foot comes down, all steps are of one length. Robots take turns; what is
compared are medians of the thread's own processor time, which other work is not part of.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from typing import Final

import numpy as np

from gaitswarm.robots import standing_scenario
from gaitswarm.sim.assembly import PHYSICS_RATE
from gaitswarm.sim.kernel.walk import walk_together
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulating
from tests.examples.paths import QUADRUPED
from tests.examples.walks import quadruped_files
from tests.robots.known import FOLDER, QUADRUPEDS

_DESIGN: Final = {"P": 0.45, "I": 0.2}
_WALKERS: Final = 24


def robots() -> dict[str, tuple[Robot, Scenario]]:
    """Who takes part, each with its walk; the hexapod first."""
    crawl = json.loads((QUADRUPED / "crawl.json").read_text(encoding="utf-8"))
    found = {
        "hexapod": (load_robot(DEFAULT_ROBOT), SCENARIOS[0]),
        "quadruped": (load_robot(quadruped_files()), Scenario.model_validate(crawl)),
    }
    path = FOLDER / QUADRUPEDS["a1"]
    if path.is_file():
        made = propose_robot(path.read_text(encoding="utf-8"), "a1", "dc")
        fast = Scenario.model_validate(made.job["scenarios"][1])
        found["a1"] = parse_robot(made.toml, made.urdf), fast
    return found


def us_per_step(robot: Robot, scenario: Scenario) -> float:
    """Processor time of a physics step of one walker [us]."""
    designs = np.tile(np.array(list(_DESIGN.values())), (_WALKERS, 1))
    walks = simulating(scenario, "pi", list(_DESIGN), designs, robot=robot, backend="native")
    begun = time.thread_time()
    (walked,) = walk_together([walks])
    seconds = time.thread_time() - begun
    # Who stands gets nowhere, which is no walk either.
    assert np.isin(walked.outcome.statuses, (Status.OK, Status.STALLED)).all()
    return seconds / (_WALKERS * scenario.duration * PHYSICS_RATE) * 1e6


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    contestants = {}
    for name, (robot, scenario) in robots().items():
        contestants["walks", name] = robot, scenario
        still = {"cycle_time": SCENARIOS[0].cycle_time, "cycles": SCENARIOS[0].cycles}
        contestants["stands", name] = robot, standing_scenario(robot).model_copy(update=still)
    seen: dict[tuple[str, str], list[float]] = {name: [] for name in contestants}
    for contestant in contestants.values():
        us_per_step(*contestant)  # Compiles, and makes the plans.
    for _ in range(options.rounds):
        for row, contestant in contestants.items():
            seen[row].append(us_per_step(*contestant))
    medians = {row: statistics.median(times) for row, times in seen.items()}
    rows = [
        {
            "robot": name,
            "what": what,
            "us_per_step": median,
            "times_as_fast": medians[what, "hexapod"] / median,
        }
        for (what, name), median in sorted(
            medians.items(), key=lambda item: item[0][0], reverse=True
        )
    ]
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    print(f"{'robot':12} {'':8} {'us/step':>8} {'times as fast':>14}")
    for row in rows:
        print(
            f"{row['robot']:12} {row['what']:8} {row['us_per_step']:8.3f}"
            f" {row['times_as_fast']:14.2f}"
        )


if __name__ == "__main__":
    main()
