"""One task, as it is sent to a worker, and what comes back."""

from __future__ import annotations

import pickle
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.outage import is_infrastructure
from gaitswarm.services.worker.cutting import Part
from gaitswarm.sim.case import Case, run_together
from gaitswarm.sim.controllers.quantisation import timing_tables
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.kernel.walk import KernelTime, LaneUse
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance, provenance_of, simulator_digest


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Some designs in one case or several, as they are sent to a worker.

    Attributes:
        cases: What the designs are put to.
        parts: Which designs are put to which case.
        designs: (n, v), all that the parts name.
        provenance: What the outcomes are to have.
    """

    cases: tuple[Case, ...]
    parts: tuple[Part, ...]
    designs: NDArray[np.float64]
    provenance: Provenance

    @classmethod
    def of(
        cls,
        cases: Sequence[Case],
        designs: NDArray[np.float64],
        parts: Sequence[Part],
        provenance: Provenance,
    ) -> Task:
        """The task for some parts of an iteration, without what they do not need of it.

        Args:
            cases: All cases.
            designs: All designs.
            parts: Designs in cases.
            provenance: What the outcomes are to have.

        Returns:
            The task, whose outcomes are in the order of the parts.
        """
        first = min(part.start for part in parts)
        last = max(part.stop for part in parts)
        return cls(
            cases=tuple(cases[part.case] for part in parts),
            parts=tuple(
                Part(index, part.start - first, part.stop - first)
                for index, part in enumerate(parts)
            ),
            designs=np.ascontiguousarray(designs[first:last]),
            provenance=provenance,
        )

    def run(self, should_stop: Callable[[], bool] = lambda: False) -> Answer:
        """Put the designs to the cases, unless this process computes something else.

        Args:
            should_stop: Whether nobody waits for the outcomes any more; what takes long may then
                raise.

        Returns:
            The outcomes, or None in their place, with the provenance of this process.
        """
        begun = time.perf_counter()
        for robots, precision in {(case.robots, case.precision) for case in self.cases}:
            libraries = tuple(self.provenance.libraries)
            here = provenance_of(*robots, precision=precision, libraries=libraries)
            if here != self.provenance:
                return Answer(here, None, platform.node())
        kernel_time = KernelTime()
        with timing_tables() as table_time:
            outcomes = run_together(
                [self.cases[part.case] for part in self.parts],
                [self.designs[part.start : part.stop] for part in self.parts],
                kernel_time,
                should_stop,
            )
        seconds = time.perf_counter() - begun - kernel_time.waited
        return Answer(
            self.provenance, outcomes, platform.node(), seconds, kernel_time, table_time.seconds
        )


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What a task came to.

    Attributes:
        provenance: That of the process that ran it.
        outcomes: Of the parts; None if the provenance is not what the task asks for, so that
            nothing was computed.
        host: Name of the machine.
        seconds: That the task took there, but for waiting for other threads [s].
        kernel_time: Of these, and how the kernels' lanes were used.
        table_seconds: Of these, that fuzzy tables took [s].
    """

    provenance: Provenance
    outcomes: tuple[Outcome, ...] | None
    host: str
    seconds: float = 0.0
    kernel_time: KernelTime = field(default_factory=KernelTime)
    table_seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class TaskTotals:
    """What tasks took in their workers, all together.

    Attributes:
        seconds: In tasks [s].
        kernel_seconds: Of these, in kernels [s].
        table_seconds: Of these, for fuzzy tables [s].
        lane_use: Of the kernels.
    """

    seconds: float = 0.0
    kernel_seconds: float = 0.0
    table_seconds: float = 0.0
    lane_use: LaneUse = field(default_factory=LaneUse)

    def plus(self, answer: Answer) -> TaskTotals:
        """With another task.

        Args:
            answer: What it came to.

        Returns:
            The totals.
        """
        return TaskTotals(
            self.seconds + answer.seconds,
            self.kernel_seconds + answer.kernel_time.seconds,
            self.table_seconds + answer.table_seconds,
            self.lane_use + answer.kernel_time.lane_use,
        )

    def since(self, earlier: TaskTotals) -> TaskTotals:
        """Without those before.

        Args:
            earlier: Totals of before.

        Returns:
            The totals of what came since.
        """
        return TaskTotals(
            self.seconds - earlier.seconds,
            self.kernel_seconds - earlier.kernel_seconds,
            self.table_seconds - earlier.table_seconds,
            self.lane_use - earlier.lane_use,
        )


@dataclass(frozen=True, slots=True)
class Load:
    """What workers have to do.

    Attributes:
        slots: Tasks that can run at the same time.
        used: Slots that have a task.
        waiting: Tasks that wait for a slot.
    """

    slots: int = 0
    used: int = 0
    waiting: int = 0


@dataclass(frozen=True, slots=True)
class Failure:
    """What the simulation raised, on its way back from another process.

    Attributes:
        error: The exception, or one that can be sent in its place.
    """

    error: Exception


def run_in_worker(task: Task) -> Answer | Failure:
    """The body of a remote task. An error is a result here, not a sign of a broken worker.

    Args:
        task: What is to be run.

    Returns:
        What it came to, or what it raised.
    """
    try:
        return task.run()
    except Exception as error:  # noqa: BLE001 - it is raised again where the result is wanted
        if is_infrastructure(error):
            # Told here, as what caused an error does not come along.
            reason = f"a worker on {platform.node()}: {type(error).__name__}: {error}"
            return Failure(EvaluatorUnavailable(reason))
        return Failure(transportable(error))


def transportable(error: Exception) -> Exception:
    """An error that can be sent to another process.

    Args:
        error: Any error.

    Returns:
        The error itself if it survives pickling, else one of its family with the same message.
    """
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - written by the line itself
    except Exception:  # noqa: BLE001 - a constructor may raise anything
        family = SimulationError if isinstance(error, SimulationError) else RuntimeError
        return family(f"{type(error).__name__}: {error}")
    return error


def warm_up() -> None:
    """Lets a process import what a walk needs, and take note of the code that it has imported."""
    simulator_digest()
