"""Cases that sleep or kill their process, to be sent to workers."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.case import Walk
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import RobotSource
from tests.worker.requests import request


@dataclass(frozen=True, slots=True)
class InPlaceOfWalk:
    """A case that needs what a walk needs."""

    walk: Walk

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return self.walk.robots

    @property
    def precision(self) -> Precision:
        return self.walk.precision

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return self.walk.objectives


@dataclass(frozen=True, slots=True)
class Sleep(InPlaceOfWalk):
    """It takes a minute and has no result."""

    name = "sleep"
    duration = 1000.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        time.sleep(60.0)
        raise AssertionError("it was not cancelled")


@dataclass(frozen=True, slots=True)
class Slow(InPlaceOfWalk):
    """A walk that begins after some time."""

    seconds: float = 0.2
    name = "slow"
    duration = 1000.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        time.sleep(self.seconds)
        return self.walk.run(designs)


def slow(count: int, seconds: float, job_id: str = "job") -> EvaluationRequest:
    """A request with a task for each design, that takes so long."""
    wanted = request(count, job_id=job_id)
    walk = wanted.cases[0]
    assert isinstance(walk, Walk)
    return replace(wanted, cases=(Slow(walk, seconds),))


@dataclass(frozen=True, slots=True)
class Deadly(InPlaceOfWalk):
    """A walk that crashes its process some times before it is one, each noted in a file."""

    deaths: Path
    times: int
    name = "deadly"
    duration = 1.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        self.deaths.touch()
        if len(self.deaths.read_text().split()) < self.times:
            with self.deaths.open("a") as file:
                file.write(f"{os.getpid()}\n")
            os.kill(os.getpid(), signal.SIGSEGV)
        return self.walk.run(designs)
