"""Places of designs as text."""

from __future__ import annotations

import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.settings import place_of, read_place


@pytest.mark.parametrize("place", [(8, 12), (0, 0), (8, 1), (8, 10)])
def test_a_place_that_was_written_is_read_again(place: tuple[int, int]) -> None:
    assert read_place(place_of(*place), field="for") == place


@pytest.mark.parametrize("text", ["8", "8.", ".12", "8.12.1", "-1.2", "8,12", "8/12", "", "٨.١"])
def test_anything_else_is_no_place(text: str) -> None:
    with pytest.raises(InvalidRequest, match=r"for: must be .* such as 24\.7"):
        read_place(text, field="for")
