"""Contract of all search methods in the registry."""

from __future__ import annotations

import pytest

from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.testing import (
    BUDGET,
    SearchContract,
    bits,
    path,
    paths_of_another_process,
    search,
    whole_path,
)

INSTALLED = [name for name in METHODS.built_in if name != "auto" and not METHODS[name].missing]
"""Methods whose libraries are installed; with the development lock, all but the name of others."""

REPLAYED_UNTIL = {"bayesian": 24}
"""Evaluations of methods that replay all feedback when loaded, in quadratic time."""


def test_every_method_is_tested() -> None:
    assert set(METHODS.built_in) == {"auto", *INSTALLED}


@pytest.mark.variants(without=("bayesian",))
class TestBuiltIn(SearchContract):
    @pytest.fixture(autouse=True, params=INSTALLED)
    def method(self, request: pytest.FixtureRequest) -> None:
        self.name = request.param
        self.better_than_random = self.name != "random"
        self.reloaded = REPLAYED_UNTIL.get(self.name, BUDGET)
        if self.name == "bayesian":
            self.seeds = 3


@pytest.mark.variants("of few seconds")
@pytest.mark.parametrize(
    "methods",
    [[name for name in INSTALLED if name not in REPLAYED_UNTIL], list(REPLAYED_UNTIL)],
    ids=["of few seconds", "replayed"],
)
def test_another_process_continues_with_the_same_bits(methods: list[str]) -> None:
    given, expected = {}, {}
    for method in methods:
        stopped = search(method)
        done = list(path(stopped, method, evaluations=BUDGET // 2))
        given[method] = stopped.dump()
        expected[method] = bits(whole_path(method)[len(done) :])
    assert paths_of_another_process(given) == expected
