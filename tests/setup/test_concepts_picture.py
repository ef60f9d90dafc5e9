"""The picture of the concepts says of each what the glossary says."""

from __future__ import annotations

import re

from scripts.concepts import ARROWS, PICTURE, ROWS, drawn, entries
from tests.examples.paths import ROOT

CONCEPTS = {concept for row in ROWS for concept in row}


def test_the_picture_is_drawn_from_the_glossary() -> None:
    assert PICTURE.read_text(encoding="utf-8") == drawn(), "`make pictures` redraws it"


def test_every_concept_has_an_entry_and_hangs_together_with_others() -> None:
    assert set(entries()) >= CONCEPTS
    assert {end for arrow in ARROWS for end in arrow} == CONCEPTS


def test_the_page_explains_every_concept_of_the_picture() -> None:
    text = (ROOT / "docs" / "concepts.md").read_text(encoding="utf-8")
    assert [concept for concept in CONCEPTS if not re.search(rf"\*{concept}s?\*", text)] == []
