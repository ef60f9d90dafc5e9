"""Small searches for preferences."""

from __future__ import annotations

from typing import Any, Final

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

DOCUMENT: Final[dict[str, Any]] = {
    "kind": "preferences",
    "name": "small search for preferences",
    "tuning": {
        "controller": "pi",
        "scenarios": [SHORT_WALK, UPHILL_WALK],
        "optimizer": {"name": "cma-es", "particles": 4},
        "iterations": 2,
    },
    "samples": 12,
    "worlds": 3,
    "optimizer": {"name": "random", "particles": 2},
    "iterations": 2,
}
"""A, B, C and another one, each with eight designs of two steps."""


def small(**changes: Any) -> PreferencesSpec:
    """`DOCUMENT` with some of its fields changed."""
    spec = SPECS.validate_python(DOCUMENT | changes)
    assert isinstance(spec, PreferencesSpec)
    return spec
