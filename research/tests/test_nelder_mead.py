"""The simplex: Gao and Han's coefficients, one design at a time, bounds, integers, restarts."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.plugins import Axis, Space
from gaitswarm_research.methods.local_search import Axes, Floats, Point
from gaitswarm_research.methods.nelder_mead import simplex_search
from research.tests.searches import MIXED, calls_to, designs_asked, mixed_bowl, walked

CUBE = Space.continuous([0.0] * 4, [1.0] * 4)

START = np.array([0.3, 0.6, 0.2, 0.7])


def valley(unit: Floats) -> Floats:
    """Rosenbrock's, with its minimum 0 at 0.6 in every variable."""
    x = 1.0 + 5.0 * (unit - 0.6)
    return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=1)


def point(unit: Floats) -> Point:
    return Point(unit, float(valley(unit[None])[0]))


def test_the_path_is_that_of_scipys_adaptive_simplex() -> None:
    """The same vertices to begin with, the same number of evaluations, the same end."""
    from scipy.optimize import minimize

    path: list[Floats] = []

    def record(x: Floats) -> float:
        path.append(x.copy())
        return float(valley(x[None])[0])

    simplex = np.vstack([START, START + 0.1 * np.eye(4)])
    minimize(
        record,
        START,
        method="Nelder-Mead",
        options={"adaptive": True, "initial_simplex": simplex, "maxfev": 150},
    )

    walk = simplex_search(point(START), Axes(CUBE), edge=0.1, tolerance=0.0)
    _, proposals = walked(walk, valley)
    found = np.vstack([START, *proposals])[:150]
    np.testing.assert_allclose(found, np.array(path)[:150], rtol=0, atol=1e-9)


def test_the_first_simplex_is_one_batch_and_other_steps_are_one_design() -> None:
    walk = simplex_search(point(START), Axes(CUBE), edge=0.1, tolerance=1e-3)
    found, proposals = walked(walk, valley)
    assert len(proposals[0]) == 4
    assert {len(proposal) for proposal in proposals[1:]} <= {1, 4}
    assert found.fitness < 1e-3


def test_a_simplex_walks_along_a_face_of_the_box() -> None:
    def outside(unit: Floats) -> Floats:
        return ((unit - [1.3, 0.5, -0.2, 0.5]) ** 2).sum(axis=1)

    start = Point(START, float(outside(START[None])[0]))
    found, proposals = walked(simplex_search(start, Axes(CUBE), 0.2, 1e-9), outside)
    asked = np.vstack(proposals)
    assert ((asked >= 0.0) & (asked <= 1.0)).all()
    assert found.unit == pytest.approx([1.0, 0.5, 0.0, 0.5], abs=1e-3)


def test_polled_variables_are_held_and_an_integer_moves_by_one_at_least() -> None:
    space = Space([Axis(0.0, 1.0), Axis(0.0, 40.0, "integer"), Axis(0.0, 3.0, "categorical")])
    start = Point(np.array([0.5, 0.5, 0.6]), 1.0)
    _, proposals = walked(
        simplex_search(start, Axes(space), edge=0.001, tolerance=1e-6),
        lambda unit: np.abs(unit[:, 1] - 0.75) + unit[:, 0],
    )
    assert space.designs(space.from_unit(proposals[0]))[:, 1].tolist() == [20.0, 21.0]
    assert (np.vstack(proposals)[:, 2] == 0.6).all()


def test_a_flat_simplex_has_converged() -> None:
    start = Point(START, 1.0)
    found, proposals = walked(
        simplex_search(start, Axes(CUBE), 0.1, 1e-3), lambda unit: np.ones(len(unit))
    )
    assert found.fitness == 1.0
    assert len(proposals) == 1


def test_a_search_that_has_converged_starts_from_elsewhere() -> None:
    def two_wells(x: Floats) -> Floats:
        well = np.square(x - 0.2).sum(axis=1), np.square(x - 0.9).sum(axis=1) + 0.01
        return 1.0 + np.minimum(*well)

    asked = designs_asked("nelder-mead", CUBE, two_wells, 600, sample=1)
    x = np.vstack(asked)
    assert (np.abs(x - 0.2).max(axis=1) < 0.05).any()
    assert (np.abs(x - 0.9).max(axis=1) < 0.05).any()


def test_a_mixed_optimum_is_found() -> None:
    calls = [
        calls_to(1e-2, designs_asked("nelder-mead", MIXED, mixed_bowl, 600, seed), mixed_bowl)
        for seed in range(5)
    ]
    assert np.median(calls) < 250
