"""Soft drive at high current, and reversal at extreme current (4.3.2, fig. 4.5, Thesis 5)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.base import Inference
from gaitswarm.sim.controllers.fixed_point import CONVENTIONS

FUZZY: Final = CONTROLLERS["fuzzy-pi"]

WEIGHTS: Final = ("FW1", "FW23", "FW4", "FW56")

Floats = NDArray[np.float64]


def table_4_3(shape: int) -> dict[str, float]:
    """Rules as table 4.3 prints them, without weights: all of weight 1."""
    return {**FUZZY.published["A"], **dict.fromkeys(WEIGHTS, 1.0), "FOMF": float(shape)}


REVERSING: Final[Mapping[str, Mapping[str, float]]] = {
    "A": FUZZY.published["A"],
    "B": FUZZY.published["B"],
    "table 4.3, triangles": table_4_3(1),
    "table 4.3, Gauss": table_4_3(2),
    "table 4.3, pi": table_4_3(3),
}

CURRENTS: Final = np.linspace(0.0, 1.0, 64)
"""Shares of the current's range, at the columns of the table."""

LARGE_BEGINS: Final = CONVENTIONS["large_begins"].default or 0.0

LARGE: Final = LARGE_BEGINS < CURRENTS


def inferred(source: Inference, error: float) -> Floats:
    """Output at a share of the error's range, in PWM counts."""
    crisp = source.system.infer({"error": np.array([error]), "current": CURRENTS})[0]
    return crisp * source.output.full_range


def looked_up(source: Inference, error: float) -> Floats:
    """What the microcontroller's table answers, in PWM counts."""
    counts = CURRENTS * source.inputs["current"].full_range
    current = np.rint(counts).astype(np.int64)
    at = np.full_like(current, round(error * source.inputs["error"].full_range))
    return source.table.respond(at, current, np.zeros_like(current)) / source.output.counts


@pytest.mark.parametrize("answer", [inferred, looked_up], ids=["inference", "table"])
@pytest.mark.parametrize("name", REVERSING)
def test_a_full_error_drives_less_as_current_rises_and_backwards_at_extreme_current(
    name: str, answer: object
) -> None:
    assert callable(answer)
    (source,) = FUZZY.inferences(REVERSING[name])
    forward, backward = answer(source, 1.0), answer(source, -1.0)
    assert (np.diff(forward) <= 1e-9).all()
    full = source.output.full_range
    assert forward[0] > 0.95 * full
    # Soft above the nominal current first, and then the other way.
    soft = (forward > 0.0) & (forward < 0.5 * full)
    assert soft.any()
    assert forward[-1] < -0.4 * full
    np.testing.assert_allclose(backward, -forward, atol=1e-9)


@pytest.mark.parametrize("answer", [inferred, looked_up], ids=["inference", "table"])
def test_with_the_small_weight_of_optimum_c_the_drive_goes_soft_and_no_further(
    answer: object,
) -> None:
    assert callable(answer)
    (source,) = FUZZY.inferences(FUZZY.published["C"])
    forward = answer(source, 1.0)
    full = source.output.full_range
    assert (np.diff(forward) <= 1e-9).all()
    assert forward[0] > 0.95 * full
    assert 0.0 < forward[-1] < 0.4 * full
    np.testing.assert_allclose(answer(source, -1.0), -forward, atol=1e-9)


@pytest.mark.parametrize("name", REVERSING)
def test_a_drive_follows_its_error_until_currents_are_large_then_falls_and_reverses(
    name: str,
) -> None:
    (source,) = FUZZY.inferences(REVERSING[name])
    turns = []
    for error in (0.25, 0.5, 1.0):
        output = inferred(source, error)
        follows, falls = output[~LARGE], output[LARGE]
        assert follows[0] > 0.0
        np.testing.assert_allclose(follows, follows[0])
        assert (falls < follows[0]).all()
        turns.append(CURRENTS[int(np.argmax(output < 0.0))])
    # The larger the error, the more current it takes; half of the range is enough for any.
    assert LARGE_BEGINS < turns[0] < turns[1] < turns[2] <= 0.5


@pytest.mark.parametrize("name", REVERSING)
def test_with_the_extreme_outputs_cut_in_half_no_current_reverses_the_drive(name: str) -> None:
    """Why the output's universe holds them whole."""
    (source,) = FUZZY.inferences({**REVERSING[name], "universe": 2.0})
    assert (inferred(source, 1.0) > 0.0).all()


@pytest.mark.parametrize(("study", "reverses"), [("fuzzy-pso-ps", True), ("fuzzy-pso", False)])
def test_chapter_3s_voltage_reverses_where_rules_5_and_6_weigh_more_than_3_and_4(
    study: str, reverses: bool
) -> None:
    design = CONTROLLERS["fuzzy-pi-3"].published[study]
    assert (design["W56"] > design["W34"]) is reverses
    source, _ = CONTROLLERS["fuzzy-pi-3"].inferences(design)
    crisp = source.system.infer({"error": np.array([1.0]), "current": CURRENTS})[0]
    assert (np.diff(crisp) <= 1e-12).all()
    assert (crisp[~LARGE] > 0.95).all()
    assert (crisp[LARGE] < crisp[0]).all()
    assert crisp[-1] < 0.5
    assert (crisp[-1] < 0.0) is np.bool_(reverses)
