"""The README's picture of the architecture is what the code's imports are."""

from __future__ import annotations

import pytest

from scripts.architecture import PICTURE, ROWS, drawn, edges, sentence


@pytest.mark.slow
def test_the_picture_shows_the_imports_of_the_code() -> None:
    sentences = {room: sentence(room) for row in ROWS for room in row}

    assert PICTURE.read_text(encoding="utf-8") == drawn(edges(), sentences), (
        "`make architecture` draws it anew"
    )


def test_an_import_that_leads_upwards_cannot_be_drawn() -> None:
    sentences = {room: "" for row in ROWS for room in row}

    with pytest.raises(ValueError, match="sim imports api, which leads upwards"):
        drawn([("sim", "api")], sentences)
