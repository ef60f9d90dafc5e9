"""From the settings in a job to the optimizer that they are for."""

from __future__ import annotations

from services.optimizer.optimizers.base import Optimizer
from services.optimizer.optimizers.pso import ParticleSwarm
from services.optimizer.spec import Spec


def create_optimizer(spec: Spec) -> Optimizer:
    """A fresh optimizer for the job, before its first ask."""
    space = spec.design_space()
    return ParticleSwarm(spec.optimizer, space.low, space.high, spec.iterations, spec.seed)
