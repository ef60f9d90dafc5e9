"""Plain wording of pydantic's errors, with the remedy."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, Tag, TypeAdapter, ValidationError

from gaitswarm.sim.input import NAME, OWN, alternatives, message_of, with_known_keys


class Foot(BaseModel):
    model_config = ConfigDict(extra="forbid")
    radius: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 0.1


class Leg(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: Annotated[str, Field(min_length=2, max_length=8, pattern="^[a-z]+$")] = "left"
    side: Literal["left", "right"] = "left"
    joints: Annotated[tuple[int, ...], Field(min_length=1)] = (1,)
    foot: Foot = Foot()
    feet: dict[str, Foot] = {}
    shape: Annotated[
        Annotated[str, Tag(NAME)] | Annotated[Foot, Tag(OWN)], alternatives("must be a name")
    ] = "round"


def said(document: Any, model: Any = Leg) -> list[str]:
    with pytest.raises(ValidationError) as refused:
        TypeAdapter(model).validate_python(document)
    return [message_of(error) for error in with_known_keys(refused.value.errors(), model)]


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"name": 3}, "must be a string"),
        ({"name": "x"}, "must have at least 2 characters"),
        ({"name": "x" * 9}, "must have at most 8 characters"),
        ({"name": "LEFT"}, "must match the pattern ^[a-z]+$"),
        ({"side": "up"}, "must be 'left' or 'right'"),
        ({"side": "rigth"}, "must be 'left' or 'right'; did you mean 'right'?"),
        ({"joints": 3}, "must be a list"),
        ({"joints": []}, "must have at least 1 items, not 0"),
        ({"joints": [1.5]}, "must be a whole number"),
        ({"joints": ["x"]}, "must be a whole number"),
        ({"foot": 3}, "must be an object"),
        ({"foot": {"radius": "x"}}, "must be a number"),
        ({"foot": {"radius": 0}}, "must be greater than 0"),
        ({"foot": {"radius": 2}}, "must be at most 1"),
        ({"foot": {"radius": float("nan")}}, "must be a finite number"),
    ],
)
def test_a_wrong_value_is_answered_with_what_it_must_be(
    document: dict[str, Any], message: str
) -> None:
    assert said(document)[0] == message


@pytest.mark.parametrize(
    ("document", "model", "message"),
    [
        ({"jonts": [1]}, Leg, "unknown key; did you mean 'joints'?"),
        ({"foot": {"raduis": 1}}, Leg, "unknown key; did you mean 'radius'?"),
        ({"feet": {"front": {"raduis": 1}}}, Leg, "unknown key; did you mean 'radius'?"),
        ({"shape": {"raduis": 1}}, Leg, "unknown key; did you mean 'radius'?"),
        ([{"foot": {"wheels": 1}}], tuple[Leg, ...], "unknown key; known are radius"),
        # Of an object within, and by its name exactly before one that is only alike.
        ({"radius": 1}, Leg, "unknown key; did you mean 'foot.radius'?"),
        ({"raduis": 1}, Leg, "unknown key; did you mean 'foot.radius'?"),
        ({"Joints": 1}, Leg, "unknown key; did you mean 'joints'?"),
    ],
)
def test_an_unknown_key_is_answered_with_the_nearest_or_with_all(
    document: Any, model: Any, message: str
) -> None:
    assert said(document, model) == [message]


def test_a_value_that_is_kept_back_is_not_compared_with_those_that_may_be() -> None:
    with pytest.raises(ValidationError) as refused:
        Leg.model_validate({"side": "rigth"})
    (error,) = refused.value.errors(include_input=False)
    assert message_of(error) == "must be 'left' or 'right'"


def test_what_no_plain_word_is_known_for_keeps_pydantics() -> None:
    with pytest.raises(ValidationError) as refused:
        TypeAdapter(bytes).validate_python(3)
    assert message_of(refused.value.errors()[0]) == "must be a valid bytes"
