"""One Ray for all tests that need one; it takes seconds to start."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator


@pytest.fixture(scope="session")
def ray_evaluator() -> Iterator[RayEvaluator]:
    opened = RayEvaluator(cpus=2)
    yield opened
    opened.close()


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
