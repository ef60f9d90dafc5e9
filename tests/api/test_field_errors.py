"""Errors name fields as the document has them, and speak of the alternative that was meant."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.views.base import field_errors


def messages(document: dict[str, Any]) -> dict[str, str]:
    with pytest.raises(ValidationError) as refused:
        SPECS.validate_python(document)
    found = field_errors(refused.value.errors())
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
    assert sorted(messages(document)) == sorted(fields)


def test_a_robot_file_speaks_for_itself() -> None:
    found = messages({"robot": {"toml": "legs = = 4", "urdf": "<robot/>"}})
    assert list(found) == ["robot"]
    assert found["robot"].startswith("robot.toml: ")


@pytest.mark.parametrize(
    ("document", "field", "hint"),
    [
        ({"preference": "D"}, "preference", "'A', 'B', 'C' or 'chapter-3'"),
        ({"scenarios": ["1", "moon"]}, "scenarios.1", "unknown scenario 'moon'"),
        ({"variables": ["I", "1"]}, "variables.1", "pattern"),
        ({"robot": "octopus"}, "robot", "'szabadka2'"),
    ],
)
def test_a_wrong_name_hears_nothing_of_objects(
    document: dict[str, Any], field: str, hint: str
) -> None:
    found = messages(document)
    assert list(found) == [field]
    assert hint in found[field]


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"preference": 3}, "preference"),
        ({"scenarios": ["1", None]}, "scenarios.1"),
        ({"variables": ["I", ["P"]]}, "variables.1"),
        ({"robot": 2}, "robot"),
    ],
)
def test_what_is_neither_a_name_nor_an_object_hears_of_both(
    document: dict[str, Any], field: str
) -> None:
    found = messages(document)
    assert list(found) == [field]
    assert "or an object" in found[field]


def test_a_robot_with_one_of_its_files_hears_of_the_other() -> None:
    assert list(messages({"robot": {"urdf": "<robot/>"}})) == ["robot.toml"]


def test_a_job_hears_of_its_own_kind_alone() -> None:
    document = {"kind": "identification", "recordings": ["7"], "scenarios": ["moon"]}
    assert sorted(messages(document)) == ["recordings.0", "scenarios"]


def test_an_unknown_kind_hears_of_the_known() -> None:
    assert messages({"kind": "magic"}) == {
        "kind": "must be tuning, identification, calibration, certificate or preferences"
    }


def test_a_wrong_key_is_reported_by_its_path() -> None:
    assert list(messages({"fixed": {"not a name": 1.0}})) == ["fixed.not a name"]


def test_a_check_of_the_whole_names_the_field_that_it_blames() -> None:
    assert messages({"variables": ["nonsense"]})["variables"].startswith(
        "unknown variable 'nonsense'"
    )
