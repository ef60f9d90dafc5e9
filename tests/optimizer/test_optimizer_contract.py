"""Contract of all search methods in the registry."""

from __future__ import annotations

import pytest

from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.testing import BUDGET, OptimizerContract

INSTALLED = [name for name in METHODS.built_in if name != "auto" and not METHODS[name].missing]
"""Methods whose libraries are installed; with the development lock, all but the name of others."""

REPLAYED_UNTIL = {"bayesian": 24}
"""Evaluations of methods that replay all feedback when loaded, in quadratic time."""


def test_every_method_is_tested() -> None:
    assert set(METHODS.built_in) == {"auto", *INSTALLED}


@pytest.mark.variants(without=("bayesian",))
class TestBuiltIn(OptimizerContract):
    @pytest.fixture(autouse=True, params=INSTALLED)
    def method(self, request: pytest.FixtureRequest) -> None:
        self.name = request.param
        self.better_than_random = self.name != "random"
        self.reloaded = REPLAYED_UNTIL.get(self.name, BUDGET)
        if self.name == "bayesian":
            self.seeds = 3
