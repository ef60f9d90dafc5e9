"""Errors name fields as the document has them, and speak of the alternative that was meant."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from gaitswarm.field_errors import field_errors
from services.optimizer.jobs.documents import SPECS


def told(document: dict[str, Any]) -> dict[str, str]:
    with pytest.raises(ValidationError) as refused:
        SPECS.validate_python(document)
    found = field_errors(refused.value.errors(), document)
    assert len({(error.field, error.message) for error in found}) == len(found)
    return {error.field: error.message for error in found}


@pytest.mark.parametrize(
    ("document", "fields"),
    [
        ({"variables": [{"name": "I", "low": 3, "high": 1}]}, ["variables.0"]),
        ({"variables": ["I", {"name": "P", "low": "a", "high": 1}]}, ["variables.1.low"]),
        (
            {"scenarios": [{"name": "x"}]},
            [f"scenarios.0.{f}" for f in ("cycle_time", "radius", "withers")],
        ),
        ({"robot": {"contact_law": "glue"}}, ["robot.contact_law"]),
        ({"preference": {"bias": [1, 1, 1, 1, 1]}}, ["preference.exponent"]),
        ({"nonsense": 1}, ["nonsense"]),
        ({"kind": "identification"}, ["recordings"]),
        ({"variables": []}, ["variables"]),
        ({"optimizer": {"particles": 0}, "iterations": 0}, ["optimizer.particles", "iterations"]),
    ],
)
def test_only_the_fields_that_are_wrong_are_named(
    document: dict[str, Any], fields: list[str]
) -> None:
    assert sorted(told(document)) == sorted(fields)


def test_a_robot_file_speaks_for_itself() -> None:
    found = told({"robot": {"toml": "legs = = 4", "urdf": "<robot/>"}})
    assert list(found) == ["robot"]
    assert found["robot"].startswith("robot.toml: ")


def test_a_value_that_is_like_none_of_the_alternatives_hears_of_all() -> None:
    document = {"preference": "D"}
    with pytest.raises(ValidationError) as refused:
        SPECS.validate_python(document)
    messages = [error.message for error in field_errors(refused.value.errors(), document)]
    assert any("'A', 'B' or 'C'" in message for message in messages)
    assert len(messages) == 2


def test_a_check_of_the_whole_names_the_field_that_it_blames() -> None:
    assert told({"variables": ["nonsense"]})["variables"].startswith("unknown variable 'nonsense'")
