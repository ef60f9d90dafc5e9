"""Questions about long histories let other threads of Python go on, a server's event loop first.

While one call of a function in C has the interpreter's lock, all others wait.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.certificate import certificate
from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    Judgement,
    geometric_mean,
    judge,
)
from tests.certificate.examples import columns, small

DESIGNS = 20_000


@contextmanager
def without_collection() -> Iterator[None]:
    """Garbage of other tests is not to be looked for meanwhile."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def computes_in_parts(compute: Callable[[], object]) -> bool:
    """Whether no call takes a tenth of the time.

    In one of some tries: what else the machine does can only make a call longer.
    """
    compute()
    with without_collection():
        return any(longest_call(compute) < 0.1 for _ in range(4))


def longest_call(compute: Callable[[], object]) -> float:
    """Share of the processor's time that the longest call of a built-in function takes [1]."""
    begun: list[float] = []
    longest = 0.0

    def note(_frame: Any, event: str, _function: Any) -> None:
        nonlocal longest
        if event == "c_call":
            begun.append(time.thread_time())
        elif event in ("c_return", "c_exception") and begun:
            longest = max(longest, time.thread_time() - begun.pop())

    before = time.thread_time()
    compute()
    total = time.thread_time() - before
    # Again, as tracing every call takes longer than most of them.
    sys.setprofile(note)
    try:
        compute()
    finally:
        sys.setprofile(None)
    return longest / total


LOGARITHMS = np.random.default_rng(1).random((DESIGNS, 8))
IN_SCENARIOS = LOGARITHMS[: DESIGNS // 5, :, None].repeat(6, axis=2)


@pytest.mark.parametrize(
    "compute",
    [
        lambda: geometric_mean(LOGARITHMS),
        lambda: Judgement(LOGARITHMS[:, 0], LOGARITHMS).utilities,
        lambda: judge(IN_SCENARIOS, IN_SCENARIOS[..., 0] < 0, PREFERENCES["A"]),
    ],
    ids=["fitness", "utilities", "judgement"],
)
@pytest.mark.thorough("long histories")
def test_designs_are_judged_in_parts(compute: Callable[[], object]) -> None:
    assert computes_in_parts(compute)


@pytest.mark.thorough("long histories")
def test_a_certificate_is_summed_up_in_parts() -> None:
    worlds = DESIGNS // 3
    spec = small(worlds=worlds)
    walked = columns(spec, np.random.default_rng(1).uniform(5.0, 9.0, (worlds + 1, 2)))
    assert computes_in_parts(lambda: certificate("job", spec, walked))
