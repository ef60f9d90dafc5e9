"""The contract of search methods, for every method of this package."""

from __future__ import annotations

from importlib.metadata import distribution

import pytest

from gaitswarm.plugins import Axis, Space, create_search
from gaitswarm.testing import OptimizerContract

NAMES = sorted(
    point.name
    for point in distribution("gaitswarm-research").entry_points
    if point.group == "gaitswarm.optimizers"
)

OPTIONAL = {"ga": "pymoo", "mads": "PyNomad"}
"""Modules that a method needs, and that are not installed everywhere."""


class TestMethods(OptimizerContract):
    @pytest.fixture(autouse=True, params=NAMES)
    def method(self, request: pytest.FixtureRequest) -> None:
        self.name = request.param
        if self.name in OPTIONAL:
            pytest.importorskip(OPTIONAL[self.name])
            self.reloaded = 30


def test_all_twelve_are_registered() -> None:
    assert len(NAMES) == 12


@pytest.mark.parametrize("settings", ["no-such", {"name": "gsa", "gravity": -1.0}])
def test_wrong_names_and_settings_are_refused(settings: object) -> None:
    with pytest.raises(ValueError, match=r"unknown optimizer 'no-such'|gravity"):
        create_search(settings, Space([Axis(0.0, 1.0)]), 10, 1)  # type: ignore[arg-type]
