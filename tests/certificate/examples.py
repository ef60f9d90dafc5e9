"""Small certificates, and made-up evaluations of one."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.sim.outcome import N_OBJECTIVES, Status
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

Floats = NDArray[np.float64]

PI: Final = {"P": 0.45, "I": 0.1}

DOCUMENT: Final[dict[str, Any]] = {
    "kind": "certificate",
    "name": "small",
    "controller": "pi",
    "design": PI,
    "scenarios": [SHORT_WALK, UPHILL_WALK],
    "variables": ["friction_factor", "efficiency_factor", "slope_added"],
    "worlds": 10,
    "optimizer": {"name": "random", "particles": 4},
}
"""Eleven worlds in batches of four, a step in each of two scenarios."""


def small(**changes: Any) -> CertificateSpec:
    """`DOCUMENT` with some of its fields changed."""
    spec = SPECS.validate_python(DOCUMENT | changes)
    assert isinstance(spec, CertificateSpec)
    return spec


def columns(
    spec: CertificateSpec, values: Floats, statuses: Floats | None = None
) -> EvaluationColumns:
    """Evaluations in which all objectives of a walk have one value; values: (1 + n, K)."""
    n, cases = values.shape
    ended = np.zeros((n, cases)) if statuses is None else statuses
    failed = ended != Status.OK
    objectives = np.repeat(values[:, :, np.newaxis], N_OBJECTIVES, axis=2)
    objectives[failed] = np.nan
    space, search = spec.design_space(), spec.create_search()
    positions: list[Floats] = []
    while search.evaluations < n:
        positions.append(search.ask(n - search.evaluations))
        search.tell(np.ones(len(positions[-1])))
    return EvaluationColumns(
        iteration=np.arange(n) // spec.optimizer.particles,
        particle=np.arange(n) % spec.optimizer.particles,
        designs=space.designs(np.concatenate(positions)),
        objectives=objectives,
        statuses=ended.astype(np.uint8),
        fitness=spec.judge(objectives, failed).fitness,
    )
