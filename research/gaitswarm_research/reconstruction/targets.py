"""Calibrations of the open conventions, with the thesis's printed results as targets."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gaitswarm import CONTROLLERS, CalibrationSpec, job_spec

TARGETS: Final = Path(__file__).parent / "targets.csv"
"""Rows of the thesis's tables."""

ROBOTS: Final = ("szabadka2-reconstructed", "szabadka2", "szabadka2-identified")
"""Gearheads of 90 %, of the datasheet, and as identified. What is not varied is the first's."""

VARIABLES: Final[tuple[str | Mapping[str, Any], ...]] = (
    "robot",
    "planned_soles",
    "contact_law",
    "energy",
    "current_filter",
    "large_begins",
    "small_ends",
    "positive_peak",
    "extreme_peak",
    "universe",
    "integrator_unit",
    "trajectory_rate",
    "duty_phase",
    "fir_window",
    "curve",
    "start_phase",
    # Wider than table 3.2's: table 5.1 asks for half the speed.
    {"name": "stride", "low": 0.04, "high": 0.16},
    "height",
    "duty_factor",
    "fir_ms",
)
"""Conventions that the thesis does not state, and the gait of chapter 4."""


@dataclass(frozen=True, slots=True)
class Size:
    """Extent of the computation.

    Attributes:
        seeds: Number of calibrations; their seeds count from 1.
        particles: Designs per iteration of each calibration.
        iterations: Iterations of each calibration.
        samples: Random designs for the default and for the best choice of each calibration.
        samples_each: Random designs for each choice changed at a time.
    """

    seeds: int
    particles: int
    iterations: int
    samples: int
    samples_each: int


def calibrations(size: Size) -> tuple[CalibrationSpec, ...]:
    """The calibrations, one for each seed."""
    document: dict[str, Any] = {
        "kind": "calibration",
        "robots": ROBOTS,
        **read_targets(),
        "variables": VARIABLES,
        "optimizer": {
            "name": "pso",
            "particles": size.particles,
            "inertia_start": 0.9,
            "inertia_end": 0.4,
        },
        "iterations": size.iterations,
    }
    specs = [
        job_spec({**document, "name": f"reconstruction, seed {seed}", "seed": seed})
        for seed in range(1, size.seeds + 1)
    ]
    return tuple(spec for spec in specs if isinstance(spec, CalibrationSpec))


def read_targets() -> dict[str, list[dict[str, Any]]]:
    """Walks and targets of `TARGETS`, as the specification of a calibration has them."""
    lines = TARGETS.read_text(encoding="utf-8").splitlines()
    walks: dict[str, dict[str, Any]] = {}
    targets = []
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        name, controller = row["walk"], row["controller"]
        if name not in walks:
            walks[name] = {
                "name": name,
                "controller": controller,
                "design": _design(row["design"], controller),
                "scenarios": [_scenario(entry) for entry in row["scenario"].split()],
            }
        targets.append(
            {
                "walk": name,
                "quantity": row["quantity"],
                "value": float(row["value"]),
                "tolerance": float(row["tolerance"]),
                "relative_to": row["relative_to"] or None,
                "use": row["use"] or "fit",
            }
        )
    return {"walks": list(walks.values()), "targets": targets}


def _design(cell: str, controller: str) -> dict[str, Any]:
    if cell.startswith("published:"):
        return dict(CONTROLLERS[controller].published[cell.removeprefix("published:")])
    design: dict[str, Any] = json.loads(cell)
    return design


def _scenario(entry: str) -> Any:
    if not entry.endswith(".json"):
        return entry
    return json.loads((TARGETS.parent / entry).read_text(encoding="utf-8"))
