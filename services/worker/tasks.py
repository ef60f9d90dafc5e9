"""Tasks, as they run in a worker, and their answers"""

from __future__ import annotations

import hashlib
import pickle
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.outage import is_infrastructure
from gaitswarm.sim.case import Case, run_together
from gaitswarm.sim.controllers.quantisation import timing_tables
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.kernel.walk import KernelTime
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance, provenance_of


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Result of a task."""

    outcomes: tuple[Outcome, ...] | None  # by case; None if the process was refused
    provenance: Provenance  # of the process
    host: str
    seconds: float = 0.0  # computing time, without waiting for other threads [s]
    kernel_time: KernelTime = field(default_factory=KernelTime)
    table_seconds: float = 0.0  # time for fuzzy tables [s]
    refusal: str = ""  # how the process differs from what the task requires


def run_task(
    cases: Sequence[Case],
    designs: NDArray[np.float64],
    expected: Provenance,
    should_stop: Callable[[], bool] = lambda: False,
) -> Answer:
    """Simulate all designs in all cases, unless this process computes something else."""
    begun = time.perf_counter()
    for robots, precision in {(case.robots, case.precision) for case in cases}:
        libraries = tuple(expected.libraries)
        here = provenance_of(*robots, precision=precision, libraries=libraries)
        if here != expected:
            return Answer(None, here, platform.node(), refusal="; ".join(expected.changes(here)))
    kernel_time = KernelTime()
    with timing_tables() as table_time:
        outcomes = run_together(cases, [designs] * len(cases), kernel_time, should_stop)
    seconds = time.perf_counter() - begun - kernel_time.waited
    return Answer(outcomes, expected, platform.node(), seconds, kernel_time, table_time.seconds)


@dataclass(frozen=True, slots=True)
class Shared:
    """What all tasks of a job need, sent to each process once."""

    cases: tuple[Case, ...]
    provenance: Provenance
    arithmetic: str  # `arithmetic_digest` of the process that asks


@dataclass(frozen=True, slots=True)
class Failure:
    """Exception of a task, on its way from another process."""

    error: Exception


def run_in_worker(
    place: tuple[Any], cases: tuple[int, ...], designs: NDArray[np.float64]
) -> Answer | Failure:
    """Run a task in a process of Ray. Errors of the simulation are returned, not raised."""
    # Raises if the object is lost: that is Ray's fault and no result.
    shared = _shared(place[0])
    try:
        if shared.arithmetic != arithmetic_digest():
            refusal = (
                "its NumPy rounds differently; set NPY_DISABLE_CPU_FEATURES to the same on all"
                " nodes (docs/cluster.md)"
            )
            return Answer(None, shared.provenance, platform.node(), refusal=refusal)
        chosen = [shared.cases[index] for index in cases]
        return run_task(chosen, designs, shared.provenance)
    except Exception as error:  # noqa: BLE001 - raised again in the evaluator
        if is_infrastructure(error):
            # Its causes are not sent.
            reason = f"a worker on {platform.node()}: {type(error).__name__}: {error}"
            return Failure(EvaluatorUnavailable(reason))
        return Failure(transportable(error))


@lru_cache(maxsize=8)
def _shared(reference: Any) -> Shared:
    import ray  # noqa: PLC0415 - only called in a process of Ray

    shared: Shared = ray.get(reference)
    return shared


def transportable(error: Exception) -> Exception:
    """Return an error that survives pickling: itself, or one of its family with its message."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - written by the line itself
    except Exception:  # noqa: BLE001 - a constructor may raise anything
        family = SimulationError if isinstance(error, SimulationError) else RuntimeError
        return family(f"{type(error).__name__}: {error}")
    return error


@lru_cache(maxsize=1)
def arithmetic_digest() -> str:
    """Digest of NumPy's functions over their ranges, which round alike if it is the same."""
    unit = np.linspace(-1.0, 1.0, 2003)
    wide = unit * 41.0
    results = (
        *(function(unit) for function in (np.arccos, np.arcsin, np.arctan)),
        *(function(wide) for function in (np.sin, np.cos, np.tan, np.exp, np.tanh)),
        *(function(np.abs(wide) + 0.25) for function in (np.sqrt, np.log)),
        np.arctan2(wide, np.roll(wide, 700)),
        np.hypot(wide, np.roll(wide, 700)),
        np.power(np.abs(wide) + 0.25, unit),
    )
    return hashlib.sha256(b"".join(result.tobytes() for result in results)).hexdigest()[:32]
