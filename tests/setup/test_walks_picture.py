"""README's moving picture was drawn with the numbers that are true today."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from gaitswarm import CONTROLLERS, simulate
from scripts.walks import PICTURE
from tests.examples.paths import ROOT
from tests.golden.numbers import fitness_of, read

SVG = "{http://www.w3.org/2000/svg}"


def test_the_picture_has_the_published_optimums_numbers_and_both_walks_move() -> None:
    root = ET.fromstring(PICTURE.read_text(encoding="utf-8"))  # noqa: S314 - our own
    words = [text.text for text in root.iter(f"{SVG}text")]
    fitness = fitness_of(dict(CONTROLLERS["fuzzy-pi"].published["A"]))
    assert f"fitness {fitness:.2f}" in words, "`make pictures` redraws it"
    shaken = read().optimum["normal-fast"]["acceleration"]
    assert f"body shaken by {shaken:.2f} m/s²" in words
    legs = [line for line in root.iter(f"{SVG}polyline") if line.find(f"{SVG}animate") is not None]
    assert len(legs) == 2 * 6


README = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
PUBLISHED = simulate(dict(CONTROLLERS["fuzzy-pi"].published["A"]))


def ratios(design: dict[str, float]) -> NDArray[np.float64]:
    """(6, 5) of f1 to f5 to those of the published optimum, by scenario."""
    return simulate(design).objectives[0, :, :5] / PUBLISHED.objectives[0, :, :5]


def test_the_headline_below_it_is_true_of_the_demos_second_job() -> None:
    found = ratios(read().gait_best.design)
    _, acceleration, _, energy, time = np.exp(np.log(found).mean(axis=0))
    faster, energy, acceleration = 1.0 / time - 1.0, 1.0 - energy, 1.0 - acceleration
    assert (found < 1.0).all() and found.size == 30
    headline = (
        f"**Better than the thesis's optimum in all 30 figures: {faster:.0%} faster,"
        f" {energy:.0%} less energy per metre, {acceleration:.0%} less acceleration.**"
    )
    assert headline.replace("%", " %") in README


def test_what_the_first_job_gained_and_paid_is_true() -> None:
    best = read().best
    published = PUBLISHED.fitness.item()
    assert f"from {published:.2f} (the thesis's optimum) to {best.fitness:.2f}. That" in README
    found = ratios(best.design)
    energy = 1.0 - np.exp(np.log(found[:, 3]).mean())
    assert f"{energy:.0%} less energy per metre, and".replace("%", " %") in README
    uphill = PUBLISHED.scenarios.index("slope-fast")
    fast = 100.0 / PUBLISHED.objectives[0, uphill, 4]
    assert f"{fast / found[uphill, 4]:.1f} instead of {fast:.1f} cm/s uphill" in README
