"""`gaitswarm.robustness`."""

from __future__ import annotations

from typing import Any

import pytest

import gaitswarm
from tests.examples.walks import short_walk

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
ASKED: dict[str, Any] = {
    "controller": "pi",
    "scenarios": short_walk(),
    "samples": 100,
    "radius": 0.05,
}


def test_the_index_does_not_depend_on_the_threads() -> None:
    one = gaitswarm.robustness(PI, cpus=1, **ASKED)
    assert one.index is not None and one.samples == 100
    assert gaitswarm.robustness(PI, **ASKED) == one


def test_it_tells_how_far_it_is() -> None:
    received: list[tuple[int, int]] = []
    gaitswarm.robustness(
        PI, progress=lambda done, planned: received.append((done, planned)), **ASKED
    )
    assert received == sorted(received) and received[-1] == (101, 101)


def test_what_makes_no_sense_is_refused_by_argument() -> None:
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        gaitswarm.robustness(PI, controller="pi", samples=8)
    assert refused.value.field == "samples"
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        gaitswarm.robustness(PI, controller="pi", robot="spot")
    assert refused.value.field == "robot"
