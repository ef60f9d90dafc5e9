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
            [f"scenarios.0.{f}" for f in ("cycle_time", "radius", "hip_height")],
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


def test_a_former_name_is_told_as_it_was_written() -> None:
    walk = {"name": "x", "cycle_time": 1.5, "radius": 0.16, "withers": 9}
    assert list(told({"scenarios": [walk]})) == ["scenarios.0.withers"]
    assert list(told({"robot": {"gearlash": [1, "much", 1]}})) == ["robot.gearlash.1"]


def test_a_field_under_both_its_names_is_told_by_both() -> None:
    walk = {"name": "x", "cycle_time": 1.5, "radius": 0.16, "withers": 0.1, "hip_height": 0.1}
    (said,) = told({"scenarios": [walk]}).values()
    assert "hip_height: given twice, for 'withers' is its former name" in said
    (said,) = told({"robot": {"gearlash": [1, 1, 1], "backlash": [1, 1, 1]}}).values()
    assert "backlash: given twice, for 'gearlash' is its former name" in said


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
