"""One task as it is sent to a worker: everything that a walk depends on, and nothing else."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.errors import SimulationError
from sim.outcome import Outcome
from sim.trial import Trial


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Some designs in one trial. designs: (n, v)."""

    trial: Trial
    designs: NDArray[np.float64]

    def run(self) -> Outcome:
        """Put them to it."""
        return self.trial.run(self.designs)


@dataclass(frozen=True, slots=True)
class Failure:
    """What the simulation raised, on its way back from another process."""

    error: Exception


def run_in_worker(task: Task) -> Outcome | Failure:
    """The body of a remote task. An error is a result here, not a sign of a broken worker."""
    try:
        return task.run()
    except Exception as error:  # noqa: BLE001 - it is raised again where the result is wanted
        return Failure(transportable(error))


def transportable(error: Exception) -> Exception:
    """The error itself if it survives pickling, else one of its family with the same message."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - written by the line itself
    except Exception:  # noqa: BLE001 - a constructor may raise anything
        family = SimulationError if isinstance(error, SimulationError) else RuntimeError
        return family(f"{type(error).__name__}: {error}")
    return error


def warm_up() -> None:
    """Does nothing; but a process that was sent it has imported what a walk needs."""
