"""Published A and a constrained optimum on uneven ground, in our kernel and in MuJoCo.

    python -m benchmarks.terrain [--engines mujoco mujoco-contacts] [--json]

The second design is that of the second job of `make demo`: controller and gait, no worse than
published A in any objective of any scenario, on flat ground. Both walk `normal-fast`. The table has
our objectives and, in brackets, how far those of MuJoCo are from them.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

import gaitswarm
from gaitswarm.sim.case import Walk
from gaitswarm.sim.catalogue import design_numbers
from gaitswarm.sim.mujoco.kernel import MujocoKernel
from gaitswarm.sim.outcome import OBJECTIVES, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario

COMPARED: Final = 5
"""Objectives f1 to f5; f6 is a difference close to zero."""

GROUNDS: Final[Mapping[str, dict[str, Any]]] = {
    "flat": {"kind": "plane"},
    "rough, 0.5 cm": {"kind": "rough", "amplitude": 0.005},
    "rough, 1 cm": {"kind": "rough", "amplitude": 0.01},
    "rough, 2 cm": {"kind": "rough", "amplitude": 0.02},
    "stairs, 2 cm": {"kind": "stairs", "height": 0.02},
}


def constrained_optimum() -> dict[str, Any]:
    limits = {"quantity": "*", "relative_to": "published:A", "max": 1.0}
    spec = gaitswarm.JobSpec.model_validate(
        {"preference": "A", "iterations": 25, "seed": 1, "constraints": [limits]}
    )
    with tempfile.TemporaryDirectory() as folder:
        database = str(Path(folder, "jobs.db"))
        best = gaitswarm.optimize(spec.with_gait_searched(), db=database).best
    return dict(best.design)


def walked(numbers: Mapping[str, float], ground: Mapping[str, Any], engine: str) -> list[float]:
    """Objectives f1 to f5, NaN if the robot does not arrive."""
    scenario = Scenario.model_validate(SCENARIOS[0].model_dump() | {"terrain": ground})
    case = Walk(DEFAULT_ROBOT, "fuzzy-pi", scenario, tuple(numbers))
    designs = np.array([list(numbers.values())])
    if engine == "gaitswarm":
        outcome = case.run(designs)
    else:
        soles = "spheres" if engine == "mujoco-contacts" else "none"
        outcome = case.run_with(MujocoKernel(load_robot(DEFAULT_ROBOT), soles=soles), designs)
    if outcome.statuses[0] != Status.OK:
        return [float("nan")] * COMPARED
    return outcome.objectives[0, :COMPARED].tolist()


def main() -> None:
    """Print a table in Markdown, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engines", nargs="*", default=["mujoco"], metavar="ENGINE")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    engines = ("gaitswarm", *options.engines)
    published = gaitswarm.CONTROLLERS["fuzzy-pi"].published["A"]
    designs = {"published A": published, "constrained": constrained_optimum()}
    rows = [
        {"design": name, "ground": ground}
        | {e: walked(design_numbers("fuzzy-pi", design), terrain, e) for e in engines}
        for name, design in designs.items()
        for ground, terrain in GROUNDS.items()
    ]
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    print("| design | ground |", " | ".join(o.name for o in OBJECTIVES[:COMPARED]), "|")
    print("| --- " * (2 + COMPARED) + "|")
    for row in rows:
        ours, *others = (np.array(row[engine]) for engine in engines)
        apart = np.array([100.0 * (found / ours - 1.0) for found in others]).reshape(-1, COMPARED)
        cells = [
            f"{value:.2f} ({', '.join(f'{x:+.1f} %' for x in column)})"
            for value, column in zip(ours, apart.T, strict=True)
        ]
        print(f"| {row['design']} | {row['ground']} |", " | ".join(cells), "|")


if __name__ == "__main__":
    main()
