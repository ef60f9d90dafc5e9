"""One Ray for all tests that need one; it takes seconds to start."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator


class LocalRay:
    """Ray on this machine: a process has one at a time."""

    def __init__(self) -> None:
        self._opened: RayEvaluator | None = None

    def opened(self) -> RayEvaluator:
        """The one that is open, or begins to be opened."""
        if self._opened is None:
            self._opened = RayEvaluator(cpus=2)
        return self._opened

    def close(self) -> None:
        if self._opened is not None:
            self._opened.close()
        self._opened = None


@pytest.fixture(scope="session")
def local_ray() -> Iterator[LocalRay]:
    local = LocalRay()
    yield local
    local.close()


@pytest.fixture
def ray_evaluator(local_ray: LocalRay) -> RayEvaluator:
    return local_ray.opened()


@pytest.fixture(scope="session")
def in_process_evaluator() -> Iterator[InProcessEvaluator]:
    opened = InProcessEvaluator(2)
    yield opened
    opened.close()


@pytest.fixture(params=["in_process", pytest.param("ray", marks=pytest.mark.slow)])
def evaluator(request: pytest.FixtureRequest) -> Evaluator:
    """Every implementation of the port."""
    opened: Evaluator = request.getfixturevalue(f"{request.param}_evaluator")
    return opened
