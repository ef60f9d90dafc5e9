"""A robot that is dropped, and one whose leg is jammed."""

from __future__ import annotations

import pytest

from sim.errors import SimulationInputError
from sim.outcome import Status
from sim.simulate import check_reach
from tests.examples.walks import logged_walk, short_walk, walk

PI = {"P": 0.45, "I": 0.1}


def test_a_robot_is_dropped_from_above_its_stance() -> None:
    stance, above = (logged_walk(short_walk(drop=drop), PI, "pi") for drop in (0.0, 0.05))
    assert above.base_position[0, 2] == stance.base_position[0, 2] + 0.05
    assert not above.foot_force[0].any()
    assert above.foot_force[:, :, 2].max() > 1.5 * stance.foot_force[:, :, 2].max()


def test_a_drop_is_no_loss_of_height() -> None:
    outcome = walk(short_walk(drop=0.05), PI, "pi").outcome
    assert outcome.statuses.tolist() == [Status.OK]
    assert abs(outcome.objectives[0, 5]) < 0.01


def test_a_leg_that_the_robot_does_not_have_cannot_be_jammed() -> None:
    scenario = short_walk(stuck_leg="right_wing")
    for refuse in (
        lambda: walk(scenario, PI, "pi"),
        lambda: check_reach(scenario, [], [], robot="szabadka2"),
    ):
        with pytest.raises(SimulationInputError, match=r"^stuck_leg: .*right_wing.*left_rear"):
            refuse()
