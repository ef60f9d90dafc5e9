"""The published comparison follows from its recorded runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from gaitswarm_research.published import (
    correlations,
    function_scores,
    functions_table,
    robot_medians,
    robot_table,
    small_budgets_table,
)

PAGE = (Path(__file__).parents[1] / "docs" / "comparison.md").read_text(encoding="utf-8")


def test_the_page_has_the_medians_on_the_robot() -> None:
    assert robot_table(robot_medians()) in PAGE


def test_the_page_has_the_medians_at_small_budgets() -> None:
    assert small_budgets_table() in PAGE


def test_the_page_has_the_ranks_on_the_test_functions() -> None:
    assert functions_table(function_scores()) in PAGE


@pytest.mark.slow
def test_the_page_has_the_correlation_of_function_and_robot() -> None:
    after_100, _, after_625 = correlations(robot_medians())
    assert [f"{value:.2f}" for value in after_100] == ["0.63", "0.25", "0.87"]
    assert [f"{value:.2f}" for value in after_625] == ["0.58", "0.10", "0.88"]
    assert "0.63 after\n100 evaluations and 0.58 after 625" in PAGE
