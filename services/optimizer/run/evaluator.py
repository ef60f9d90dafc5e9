"""The port through which walks are run, wherever they run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.case import Case
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance


@dataclass(frozen=True, slots=True)
class TaskReport:
    """Some of a request's walks, as a worker ran them.

    Attributes:
        walks: Their number.
        seconds: From when a worker was given them to its answer [s].
        compute_seconds: Of these, how long the worker computed [s].
        host: Name of the worker's machine; "" if it did not answer.
        error: Why there is no result, for people; None if there is one.
    """

    walks: int
    seconds: float
    compute_seconds: float = 0.0
    host: str = ""
    error: str | None = None


OnTask = Callable[[TaskReport], None]


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationRequest:
    """One iteration of one job: every design in every case.

    Attributes:
        job_id: Of the job; jobs share the workers by their weights.
        cases: What every design is put to.
        designs: (n, v) float64.
        provenance: That of the process that asks; the outcomes are to have it.
        iterations_left: Iterations of the job that follow this one, as far as is known.
        iteration: Index of the iteration, from 0.
        on_task: Is told of every task that ends; it must return at once.
        weight: Of the job, which gets that many times the share of the workers of one of weight 1.
    """

    job_id: str
    cases: tuple[Case, ...]
    designs: NDArray[np.float64]
    provenance: Provenance
    iterations_left: int = 0
    iteration: int = 0
    on_task: OnTask | None = None
    weight: float = 1.0


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
        """Run every design in every case.

        Args:
            request: What is to be run.
            should_stop: Polled at least once a second, from any thread, while kernels are built,
                workers connected and walks run. When true, the caller is let go and work under way
                is dropped.

        Returns:
            One outcome per case, in the request's order, of n designs each, in index order.

        Raises:
            EvaluationStopped: `should_stop` said so.
            EvaluatorUnavailable: The workers cannot be reached after retries.
            ProvenanceChanged: One of them does not compute what the request expects.
            Exception: Errors of the simulation itself (bugs, bad input) come through as they are.
        """

    def close(self) -> None:
        """Release what was started. Idempotent."""


@runtime_checkable
class Watched(Protocol):
    """An evaluator that knows whether it can work."""

    def trouble(self) -> str | None:
        """Why walks cannot be run now, for people; None if they can. Answers at once."""


class EvaluationStopped(Exception):
    """`should_stop` said so."""
