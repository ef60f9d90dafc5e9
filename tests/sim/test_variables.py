"""Variables and their values."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gaitswarm.sim.variables import Variable, VariableValue

LAW = Variable(name="law", kind="categorical", choices=("linear", "stick", "jump"))


def test_bounds_of_a_categorical_variable_are_its_first_and_last_index() -> None:
    assert (LAW.low, LAW.high) == (0.0, 2.0)
    assert Variable.model_validate(LAW.model_dump()) == LAW


def test_a_choice_is_written_by_name_and_read_by_name_or_index() -> None:
    for index, name in enumerate(LAW.choices):
        assert LAW.number(name) == LAW.number(index) == index
        assert LAW.shown(index) == name


def test_numbers_of_other_variables_are_shown_as_they_are() -> None:
    gain = Variable(name="gain", low=0.0, high=1.0)
    assert gain.shown(gain.number(0.25)) == 0.25


@pytest.mark.parametrize("value", ["glue", 3, -1, 0.5])
def test_what_is_no_choice_is_refused_with_the_choices(value: float | str) -> None:
    with pytest.raises(ValueError, match="is not one of its choices linear, stick, jump"):
        LAW.number(value)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"choices": ["one"]}, "at least two"),
        ({}, "at least two"),
        ({"choices": ["a", "b", "a"]}, "'a' is listed twice"),
        ({"choices": ["a", "b"], "low": 0, "high": 2}, "are 0 and 1, or left out"),
        ({"choices": ["1", "2"]}, "String should match pattern"),
        ({"kind": "integer", "low": 0, "high": 2, "choices": ["a", "b"]}, "only a categorical"),
    ],
)
def test_choices_that_make_no_sense_are_refused(document: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Variable.model_validate({"name": "law", "kind": "categorical", **document})


def test_a_number_needs_both_of_its_bounds() -> None:
    with pytest.raises(ValidationError) as refused:
        Variable.model_validate({"name": "gain", "low": 0.0})
    ((error,),) = (refused.value.errors(),)
    assert (error["loc"], error["msg"]) == (("high",), "Field required")


@pytest.mark.parametrize(("value", "read"), [(2, 2.0), ("0.5", 0.5), ("stick", "stick")])
def test_a_value_is_a_number_wherever_it_reads_as_one(value: Any, read: float | str) -> None:
    assert TypeAdapter[float | str](VariableValue).validate_python(value) == read
