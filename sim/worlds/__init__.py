"""Simulation in worlds that differ from the model."""

from __future__ import annotations

from gaitswarm.sim.scenario import HELD_OUT
from gaitswarm.sim.worlds.perturbations import DRAWN, PERTURBATIONS, check_worlds, sample_worlds
from gaitswarm.sim.worlds.walks import (
    EngineWalk,
    MeasuredPerturbedWalk,
    PerturbedWalk,
    WorldWalk,
    check_grounds,
    ground_of,
)

__all__ = [
    "DRAWN",
    "HELD_OUT",
    "PERTURBATIONS",
    "EngineWalk",
    "MeasuredPerturbedWalk",
    "PerturbedWalk",
    "WorldWalk",
    "check_grounds",
    "check_worlds",
    "ground_of",
    "sample_worlds",
]
