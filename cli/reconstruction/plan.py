"""What the reconstruction asks: targets, conventions, jobs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gaitswarm.cli.inputs.spec_file import parse_spec
from gaitswarm.cli.inputs.target_file import read_targets
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.sim.robot.variant import DEFAULT_ROBOT

TARGETS: Final = Path(__file__).parent / "targets.csv"
"""The given rows of the thesis's tables."""

ROBOTS: Final = (DEFAULT_ROBOT, "szabadka2", "szabadka2-identified")
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
    """How much is computed.

    Attributes:
        seeds: calibrations, whose seeds count from 1.
        particles: designs of an iteration of each calibration.
        iterations: of each calibration.
        samples: random designs for the default and for the best choice of each calibration.
        samples_each: random designs for one choice changed at a time.
    """

    seeds: int
    particles: int
    iterations: int
    samples: int
    samples_each: int


def calibrations(size: Size) -> tuple[CalibrationSpec, ...]:
    """The jobs, one for each seed."""
    document: dict[str, Any] = {
        "kind": "calibration",
        "robots": ROBOTS,
        **read_targets(TARGETS),
        "variables": [v if isinstance(v, str) else dict(v) for v in VARIABLES],
        "optimizer": {
            "name": "pso",
            "particles": size.particles,
            "inertia_start": 0.9,
            "inertia_end": 0.4,
        },
        "iterations": size.iterations,
    }
    specs = []
    for seed in range(1, size.seeds + 1):
        spec = parse_spec({**document, "name": f"reconstruction, seed {seed}", "seed": seed})
        if not isinstance(spec, CalibrationSpec):
            raise TypeError(type(spec))
        specs.append(spec)
    return tuple(specs)
