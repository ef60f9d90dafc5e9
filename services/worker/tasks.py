"""How one iteration is cut into tasks, and one task as it is sent to a worker."""

from __future__ import annotations

import itertools
import math
import pickle
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.case import Case
from sim.errors import SimulationError
from sim.outcome import Outcome
from sim.provenance import Provenance, provenance_of, simulator_digest

_TASKS_PER_SLOT: Final = 3
"""Enough for the last tasks to end at about the same time, few enough to keep each long."""

_SHORTEST: Final = 10.0
"""Simulated seconds in a task at least: tens of milliseconds of work, against milliseconds to
send it."""

_LONGEST: Final = 250.0
"""Simulated seconds in a task at most, if its case can be cut so fine: about a second, so
that other jobs, and whoever cancels this one, need not wait."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Designs start <= index < stop in one case.

    Attributes:
        case: Index of the case.
        start: Index of the first design.
        stop: Index after the last design.
        cost: Simulated seconds that the kernel steps through, with its lanes filled up.
    """

    case: int
    start: int
    stop: int
    cost: float


def cut(durations: Sequence[float], designs: int, *, slots: int, lanes: int) -> tuple[Chunk, ...]:
    """Cut an iteration into chunks of all cases, longest first.

    Args:
        durations: Simulated seconds of each case.
        designs: Their number.
        slots: How many chunks run at the same time.
        lanes: How many walkers the kernel steps together, present or not: every chunk but a case's
            last is a multiple of it.

    Returns:
        The chunks; every design of every case is in one.
    """
    blocks = math.ceil(designs / lanes)
    total = sum(durations) * blocks * lanes
    wanted = min(max(total / (_TASKS_PER_SLOT * slots), _SHORTEST), _LONGEST)
    chunks: list[Chunk] = []
    for case, duration in enumerate(durations):
        largest = max(1, round(wanted / (duration * lanes)))
        pieces = max(1, math.ceil(blocks / largest))
        edges = [blocks * piece // pieces for piece in range(pieces + 1)]
        chunks += [
            Chunk(case, a * lanes, min(b * lanes, designs), (b - a) * lanes * duration)
            for a, b in itertools.pairwise(edges)
            if b > a
        ]
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.case, chunk.start)))


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Some designs in one case, as they are sent to a worker.

    Attributes:
        case: What the designs are put to.
        designs: (n, v).
        provenance: What the outcome is to have.
    """

    case: Case
    designs: NDArray[np.float64]
    provenance: Provenance

    def run(self) -> Answer:
        """Put the designs to the case, unless this process computes something else.

        Returns:
            The outcome, or None in its place, with the provenance of this process.
        """
        here = provenance_of(*self.case.robots, precision=self.case.precision)
        outcome = self.case.run(self.designs) if here == self.provenance else None
        return Answer(here, outcome, platform.node())


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What a task came to.

    Attributes:
        provenance: That of the process that ran it.
        outcome: None if the provenance is not what the task asks for, so that nothing was computed.
        host: Name of the machine.
    """

    provenance: Provenance
    outcome: Outcome | None
    host: str


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
