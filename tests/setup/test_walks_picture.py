"""README's moving picture was drawn with the numbers that are true today."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from gaitswarm import CONTROLLERS
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


def test_the_headline_below_it_has_the_same_numbers() -> None:
    published = fitness_of(dict(CONTROLLERS["fuzzy-pi"].published["A"]))
    headline = f"**From {published:.2f} (the thesis's optimum) to {read().best.fitness:.2f} in "
    assert headline in (ROOT / "README.md").read_text(encoding="utf-8")
