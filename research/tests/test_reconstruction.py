"""The reconstruction, from the command to the report, in small."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm import CONTROLLERS, PREFERENCES, JobSpec
from gaitswarm_research.reconstruction.bound import greatest_product
from gaitswarm_research.reconstruction.conventions import (
    alternatives,
    default_choice,
    simulated_targets,
)
from gaitswarm_research.reconstruction.optimality import OPTIMA, optimality, random_designs
from gaitswarm_research.reconstruction.targets import Size, calibrations
from research.tests.conftest import Command

MODEL_PAGE = Path(__file__).parents[2] / "docs" / "model.md"

TINY = (
    *("--seeds", "2", "--particles", "2", "--iterations", "1", "--samples", "2"),
    *("--change", "integrator_unit"),
)

SECTIONS = [
    "Summary",
    "Deviations from print",
    "Printed against simulated",
    "Optima among random designs",
    "Misfit by choice",
    "Misfit by interval",
    "One convention at a time",
    "Rows predicted from the others",
    "Published results that no row has",
    "Which published numbers exclude one another",
]


@pytest.fixture(scope="module")
def spec() -> Any:
    return calibrations(Size(1, 2, 1, 2, 1))[0]


@pytest.mark.slow
def test_the_command_reports_and_computes_nothing_twice(
    research: Command, db: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "report"
    first = research("reconstruction", *TINY, "--db", db, "--output", folder)
    assert first.code == 0, first.err
    report = (folder / "report.md").read_text(encoding="utf-8")
    assert [line[3:] for line in report.splitlines() if line.startswith("## ")] == SECTIONS
    assert "integrator_unit" in report
    assert "best of seed" in report
    for figure in ("targets.svg", "choices.svg", "exclusion.svg"):
        assert f"]({figure})" in report
        assert (folder / figure).stat().st_size > 1000
    stored = (folder / "optimality.json").stat()
    # Default, the best of two seeds, and two other units of the integrator.
    assert len(json.loads((folder / "optimality.json").read_text())) == 5
    again = research("reconstruction", *TINY, "--db", db, "--output", folder)
    assert again.code == 0, again.err
    with gaitswarm.open(db) as jobs:
        assert len(list(jobs.jobs())) == 2
    assert (folder / "report.md").read_text(encoding="utf-8") == report
    assert (folder / "optimality.json").stat().st_mtime_ns == stored.st_mtime_ns


def test_the_page_of_the_model_has_the_deviations_from_print(research: Command) -> None:
    printed = research("reconstruction", "--deviations")
    assert printed.code == 0, printed.err
    assert printed.out in MODEL_PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "message"),
    [(("--change", "colour"), "unknown convention 'colour'"), (("--particles", "1"), "particles")],
)
def test_invalid_options_are_refused_before_anything_is_stored(
    research: Command, db: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    refused = research("reconstruction", *options, "--db", db, "--output", tmp_path / "none")
    assert refused.code == 2
    assert message in refused.err
    assert not db.exists() and not (tmp_path / "none").exists()


def test_optima_are_ranked_among_random_designs() -> None:
    """Objectives that are all the same number rank by it under every preference."""
    numbers = np.array([2.0, 1.0, 3.0, 0.5, 1.5, 2.5, 4.0])
    objectives = np.repeat(numbers, 2 * 6).reshape(7, 2, 6)
    failed = np.zeros((7, 2), dtype=np.bool_)
    failed[6, 1] = True
    found = optimality(objectives, failed)
    assert found.samples == 4
    assert found.failed == 0.25
    # Random designs 0.5, 1.5, 2.5 and one that failed, against A 2, B 1 and C 3.
    assert found.beaten == {"A": 0.5, "B": 0.25, "C": 0.75}
    assert [found.place(name) for name in OPTIMA] == [2, 1, 3]
    assert found.fitness["C"]["A"] == pytest.approx(2.0**5)


def test_an_optimum_that_fails_is_beaten_by_all_designs_that_walk() -> None:
    failed = np.array([[False], [False], [True], [False], [True]])
    found = optimality(np.ones((5, 1, 6)), failed)
    assert found.beaten["C"] == 0.5
    assert found.fitness["A"]["C"] is None
    assert found.place("C") is None


def test_random_designs_depend_on_the_seed_and_lie_in_bounds() -> None:
    designs = random_designs(50, 3)
    np.testing.assert_array_equal(designs, random_designs(50, 3))
    np.testing.assert_array_equal(designs[:20], random_designs(20, 3))
    assert (designs != random_designs(50, 4)).any()
    for column, variable in zip(designs.T, CONTROLLERS["fuzzy-pi"].variables, strict=True):
        assert variable.low <= column.min() < column.max() <= variable.high


@pytest.mark.parametrize("means", [{}, {0: 8.0, 4: 20.0}, {0: 8.0, 1: 1.0, 3: 80.0}])
def test_no_objectives_have_a_greater_product_than_the_bound(means: dict[int, float]) -> None:
    preference, fitness = PREFERENCES["A"], 23.0
    bound = greatest_product(preference, fitness, means)
    free = [m for m in range(5) if m not in means]
    generator = np.random.default_rng(1)
    logs = generator.uniform(-3.0, 12.0, (40_000, 5))
    for m, value in means.items():
        logs[:, m] = np.log(value)
    # Spread over scenarios about the means: the bound is on the means alone.
    spread = generator.normal(0.0, 0.3, (len(logs), 2, 5))
    spread -= spread.mean(axis=1, keepdims=True)
    objectives = np.zeros((len(logs), 2, 6))
    objectives[:, :, :5] = np.exp(logs[:, None, :] + spread)
    allowed = (
        JobSpec(preference=preference)
        .judge(objectives, np.zeros((len(logs), 2), dtype=np.bool_))
        .fitness
    )
    products = np.exp(logs.sum(axis=1))[allowed <= fitness]
    assert len(products) > 10
    assert products.max() <= bound
    # A search around the best point comes as near as one likes: the bound is attained.
    best = logs[allowed <= fitness][products.argmax()]
    for step in np.geomspace(3.0, 1e-4, 400):
        near = np.tile(best, (200, 1))
        near[:, free] += generator.normal(0.0, step, (200, len(free)))
        terms = np.log(np.array(preference.bias) + np.exp(near)) @ np.array(preference.exponent)
        inside = near[terms <= np.log(fitness)]
        if len(inside) and inside.sum(axis=1).max() > best.sum():
            best = inside[inside.sum(axis=1).argmax()]
    assert np.exp(best.sum()) == pytest.approx(bound, rel=0.02)


def test_the_bound_is_zero_where_the_means_exceed_the_fitness() -> None:
    assert greatest_product(PREFERENCES["A"], 23.0, {0: 1e30, 4: 1.0}) == 0.0


def test_every_given_row_is_a_target(spec: Any) -> None:
    assert len(spec.targets) == 19
    assert sum(target.use == "fit" for target in spec.targets) == 17


@pytest.mark.slow
def test_the_default_choice_equals_the_model_as_it_ships(spec: Any) -> None:
    shipped = spec.model_copy(update={"robots": (), "variables": ("energy",)})
    with ThreadPoolExecutor(2) as workers:
        simulated, _ = simulated_targets(spec, [{}], workers)
        expected, _ = simulated_targets(shipped, [{}], workers)
    np.testing.assert_array_equal(simulated, expected)


def test_alternatives_are_all_other_choices_and_some_values(spec: Any) -> None:
    found = [(a.variable.name, a.shown) for a in alternatives(spec)]
    assert ("integrator_unit", "volt_per_radian") in found
    assert ("integrator_unit", "counts") not in found
    assert {name for name, _ in found} == {v.name for v in spec.design_space().variables}
    assert default_choice(spec, "fuzzy-pi-3")["universe"] == 2.0
    assert default_choice(spec, "fuzzy-pi")["universe"] == 3.0
