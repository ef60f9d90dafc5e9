"""The evaluator port: simulations, independent of where they run"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.case import Case
from gaitswarm.sim.kernel.walk import KernelTime
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance


@dataclass(frozen=True, slots=True)
class TaskReport:
    """A task of a request, as run by a worker."""

    walks: int
    seconds: float  # from the dispatch to the answer [s]
    compute_seconds: float = 0.0  # computing time of the worker [s]
    host: str = ""  # name of the worker's machine; "" without an answer
    error: str | None = None  # cause of failure, for people; None for a result
    # part of it in kernels, and the use of their lanes
    kernel_time: KernelTime = field(default_factory=KernelTime)
    table_seconds: float = 0.0  # part of it for fuzzy tables [s]


OnTask = Callable[[TaskReport], None]

OnOutcome = Callable[[int, int, Outcome], None]
"""Called with the index of a case, the index of the first design, and outcomes from there on."""


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationRequest:
    """One iteration of one job: every design in every case."""

    job_id: str  # jobs share the workers by their weights
    cases: tuple[Case, ...]
    designs: NDArray[np.float64]  # (n, v) float64
    provenance: Provenance  # of this process; the workers must match it
    iteration: int = 0
    on_task: OnTask | None = None  # called after every task; must return at once
    # called for every case of a task with a result; must return at once, and not modify the arrays
    on_outcome: OnOutcome | None = None
    weight: float = 1.0  # share of the workers relative to a job of weight 1


class Evaluator(Protocol):
    """Evaluates designs. Thread-safe: several jobs may evaluate concurrently.

    Results depend on the request alone, bit for bit; not on place, order, chunks or retries of
    simulations. Arrays are neither kept nor modified.

    It may have two more members, which answer at once: `place`, where it last evaluated, such as
    "threads: 2"; and `trouble()`, why designs cannot be evaluated now, None if they can.
    """

    @property
    def slots(self) -> int:
        """Number of tasks that run concurrently."""

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Evaluate every design in every case.

        Args:
            request: Designs and cases.
            should_stop: Polled at least once a second, from any thread, while kernels are built,
                workers connected and simulations run. When true, work in progress is dropped.

        Returns:
            One outcome per case, in the request's order, of n designs each, in index order.

        Raises:
            EvaluationStopped: `should_stop` returned true.
            EvaluatorUnavailable: The workers cannot be reached after retries.
            ProvenanceChanged: A worker's provenance differs from the request's.
            Exception: Errors of the simulation itself (bugs, bad input) are raised unchanged.
        """

    def close(self) -> None:
        """Release all resources. Idempotent."""


class EvaluationStopped(Exception):
    """`should_stop` returned true."""
