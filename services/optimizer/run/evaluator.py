"""The port through which walks are run, wherever they run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.case import Case
from sim.outcome import Outcome
from sim.provenance import Provenance


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationRequest:
    """One iteration of one job: every design in every case.

    designs: (n, v) float64. provenance: that of the process that asks; the outcomes are to have it.
    """

    job_id: str
    cases: tuple[Case, ...]
    designs: NDArray[np.float64]
    provenance: Provenance


class Evaluator(Protocol):
    """Runs walks. Implementations are thread-safe: several jobs may evaluate at once.

    Results depend on the request alone, bit for bit; not on where, in what order, in what
    chunks, or how often a walk was run. Arrays are neither kept nor changed.
    """

    @property
    def slots(self) -> int:
        """Number of walks' chunks that run at the same time."""

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """One outcome per case, in the request's order, of n designs each, in index order.

        should_stop: polled at least once a second; when true, work under way is dropped and
            `EvaluationStopped` raised.
        Raises EvaluatorUnavailable if the workers cannot be reached after retries,
        ProvenanceChanged if one of them does not compute what the request expects, and lets errors
        of the simulation itself (bugs, bad input) through.
        """

    def close(self) -> None:
        """Release what was started. Idempotent."""


class EvaluationStopped(Exception):
    """`should_stop` said so."""
