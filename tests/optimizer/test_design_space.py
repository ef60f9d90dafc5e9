"""From positions in the box to the designs that are simulated."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.sim.variables import Variable

GAIN = Variable(name="gain", low=0.0, high=2.0, unit="1")
SHAPE = Variable(name="shape", low=1, high=3, kind="integer", unit="index")
STRIDE = Variable(name="stride", low=0.1, high=0.2, unit="m")
LAW = Variable(name="law", kind="categorical", choices=("linear", "stick", "jump"))


def build(
    chosen: list[str | Variable] | None = None, fixed: dict[str, float | str] | None = None
) -> DesignSpace:
    return DesignSpace.build(
        required=(GAIN, SHAPE), optional=(STRIDE, LAW), chosen=chosen, fixed=fixed or {}
    )


def only_law(*choices: str) -> DesignSpace:
    own = Variable(name="law", kind="categorical", choices=choices) if choices else "law"
    return build([own], {"gain": 1.0, "shape": 2.0})


def test_without_a_choice_all_required_variables_are_searched() -> None:
    assert build().variables == (GAIN, SHAPE)


def test_a_fixed_variable_is_not_searched_but_is_in_every_design() -> None:
    space = build(fixed={"shape": 2.0})
    assert space.variables == (GAIN,)
    assert space.names == ("gain", "shape")
    assert space.designs(np.array([[0.5], [1.5]])).tolist() == [[0.5, 2.0], [1.5, 2.0]]


def test_optional_variables_are_searched_when_they_are_chosen() -> None:
    space = build(["gain", "shape", "stride"])
    assert space.box.low.tolist() == [0.0, 1.0, 0.1]
    assert space.box.high.tolist() == [2.0, 3.0, 0.2]


def test_integers_are_rounded_and_nothing_else_is() -> None:
    designs = build().designs(np.array([[0.3, 1.4], [0.7, 2.6]]))
    assert designs.tolist() == [[0.3, 1.0], [0.7, 3.0]]


def test_positions_are_not_changed() -> None:
    positions = np.array([[0.3, 1.4]])
    build().designs(positions)
    assert positions.tolist() == [[0.3, 1.4]]


def test_custom_bounds_keep_the_unit_of_the_catalogue() -> None:
    narrow = Variable(name="gain", low=0.5, high=0.6, unit="furlong")
    (variable, _) = build([narrow, "shape"]).variables
    assert (variable.low, variable.high, variable.unit) == (0.5, 0.6, "1")


def test_each_choice_has_an_equal_share_of_the_range_that_is_searched() -> None:
    space = only_law()
    positions = np.linspace(space.box.low[0], space.box.high[0], 3001).reshape(-1, 1)
    indices, counts = np.unique(space.designs(positions)[:, 0], return_counts=True)
    assert indices.tolist() == [0.0, 1.0, 2.0]
    assert counts.max() - counts.min() <= 1


def test_a_choice_may_be_held_by_name_or_index() -> None:
    for value in ("stick", 1.0):
        space = build(["gain", "shape"], {"law": value})
        assert space.fixed == (("law", 1.0),)
        assert space.shown_fixed == {"law": "stick"}


def test_designs_are_shown_with_the_names_of_choices() -> None:
    assert only_law().shown([2.0, 1.0, 2.0]) == {"law": "jump", "gain": 1.0, "shape": 2.0}


def test_fewer_choices_are_searched_in_their_own_order_and_simulated_by_the_catalogues() -> None:
    space = only_law("jump", "linear")
    designs = space.designs(np.array([[0.0], [1.0]]))
    assert designs[:, 0].tolist() == [0.0, 1.0]
    assert [space.shown(row)["law"] for row in designs] == ["jump", "linear"]
    assert space.simulated(designs)[:, 0].tolist() == [2.0, 0.0]
    assert [corner["law"] for corner in space.corners()] == [2.0, 0.0]


@pytest.mark.parametrize(
    ("chosen", "fixed", "message"),
    [
        (["gain", "shape", "colour"], {}, "unknown variable 'colour'; known are gain, shape"),
        (["gain", "gain", "shape"], {}, "'gain' is named twice"),
        (["gain", "shape"], {"gain": 1.0}, "'gain' is also among the variables"),
        (["gain"], {}, "shape neither searched nor fixed"),
        (None, {"colour": 1.0}, "unknown variable 'colour'"),
        ([], {"gain": 1.0, "shape": 1.0}, "every variable is fixed"),
        (["gain", Variable(name="shape", low=1.0, high=3.0)], {}, "shape is an integer variable"),
        (["gain", "shape", Variable(name="law", low=0, high=2)], {}, "law is a categorical var"),
        (
            ["gain", "shape", Variable(name="law", kind="categorical", choices=("stick", "glue"))],
            {},
            "'glue' is not a choice of law; choose from linear, stick, jump",
        ),
        (None, {"law": "glue"}, "fixed: law: 'glue' is not one of its choices linear, stick, jump"),
        (None, {"law": 3.0}, "fixed: law: 3 is not one of its choices"),
        (None, {"gain": "stick"}, "fixed: gain: 'stick' is not a number"),
    ],
)
def test_an_invalid_space_is_refused_by_name(
    chosen: list[str | Variable] | None, fixed: dict[str, float | str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        build(chosen, fixed)
