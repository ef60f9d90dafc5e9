"""What other engines make of a certificate's nominal world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.preference import HEIGHT_LOSS
from gaitswarm.sim.mujoco.engines import EngineName
from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Compared:
    """One quantity by two engines; NaN where a walk failed.

    Attributes:
        ours: By our engine.
        theirs: By the other one.
    """

    ours: float
    theirs: float

    @property
    def difference(self) -> float:
        """By which the other engine's is greater, as a share of ours [1]; NaN if that is 0."""
        return (self.theirs - self.ours) / self.ours if self.ours else float("nan")


@dataclass(frozen=True, slots=True)
class ComparedCase:
    """One scenario by two engines.

    Attributes:
        name: Of the scenario.
        ours: How the walk ended by our engine.
        theirs: How it ended by the other one.
        utility: By the preference.
        objectives: f1 to f6 of table 4.1; f6 by its size.
    """

    name: str
    ours: Status
    theirs: Status
    utility: Compared
    objectives: tuple[Compared, ...]


@dataclass(frozen=True, slots=True)
class ComparedEngine:
    """Another engine, in the nominal world of all scenarios.

    Attributes:
        name: Of the engine.
        fitness: Over all scenarios.
        cases: By scenario, in the job's order.
    """

    name: EngineName
    fitness: Compared
    cases: tuple[ComparedCase, ...]


def compared_engines(
    spec: CertificateSpec, nominal: EvaluationColumns
) -> tuple[ComparedEngine, ...]:
    """Compare engines."""
    judged = spec.judge(nominal.objectives, nominal.failed)
    utilities = judged.utilities
    values = nominal.objectives.copy()
    values[:, :, HEIGHT_LOSS] = np.abs(values[:, :, HEIGHT_LOSS])
    return tuple(
        ComparedEngine(
            name,
            _compared(judged.fitness[[0, row]]),
            tuple(
                ComparedCase(
                    case,
                    Status(int(nominal.statuses[0, k])),
                    Status(int(nominal.statuses[row, k])),
                    _compared(utilities[[0, row], k]),
                    tuple(map(_compared, values[[0, row], k].T)),
                )
                for k, case in enumerate(spec.case_names)
            ),
        )
        for row, name in enumerate(spec.engines, start=1)
    )


def _compared(pair: Floats) -> Compared:
    """pair (2,): NaN or +inf for a failed walk."""
    ours, theirs = np.where(np.isfinite(pair), pair, np.nan).tolist()
    return Compared(ours, theirs)
