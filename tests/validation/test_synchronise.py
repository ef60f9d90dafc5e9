"""Synchronization of two logs of one walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement.measured_log import Quantity, find_lag, synchronise
from tests.validation.walks import CYCLE, CYCLE_TIME, renamed_robot, szabadka, walking_log


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2 * CYCLE), st.integers(0, CYCLE - 1))
def test_the_lag_is_found_to_the_row(standing: int, cut: int) -> None:
    """The measured log starts before the walk does, or misses its beginning."""
    simulated = walking_log(szabadka())
    early = walking_log(szabadka(), rows=3 * CYCLE + standing, standing=standing)
    lag, correlation = find_lag(early.desired_angle, simulated.desired_angle, CYCLE)
    assert lag == standing
    assert correlation == pytest.approx(1.0)
    late = simulated.rows(cut, 3 * CYCLE)
    assert find_lag(late.desired_angle, simulated.desired_angle, CYCLE)[0] == -cut


def test_both_logs_are_trimmed_to_the_last_whole_cycles_that_they_share() -> None:
    simulated = walking_log(szabadka())
    measured = walking_log(szabadka(), rows=3 * CYCLE + 100, standing=180)
    pair = synchronise(measured, simulated, CYCLE_TIME)
    assert (pair.lag, pair.cycles) == (180, 2)
    assert pair.lag_seconds == pytest.approx(0.36)
    assert len(pair.measured.time) == len(pair.simulated.time) == 2 * CYCLE
    assert pair.measured.time[-1] == measured.time[-1]
    np.testing.assert_allclose(
        pair.measured.desired_angle, pair.simulated.desired_angle, atol=1e-12
    )
    measured_supply, supply = (
        log.values(Quantity.SUPPLY) for log in (pair.measured, pair.simulated)
    )
    np.testing.assert_allclose(measured_supply, supply, atol=1e-12)


def test_noise_on_the_desired_angles_does_not_move_the_lag() -> None:
    noise = np.random.default_rng(1)
    simulated = walking_log(szabadka())
    measured = walking_log(szabadka(), rows=3 * CYCLE + 77, standing=77)
    shaken = measured.desired_angle + 0.02 * noise.standard_normal(measured.desired_angle.shape)
    lag, correlation = find_lag(shaken, simulated.desired_angle, CYCLE)
    assert lag == 77
    assert 0.9 < correlation < 1.0


def test_a_cycle_need_not_be_a_whole_number_of_rows() -> None:
    log = walking_log(szabadka())
    pair = synchronise(log, log, 0.3333)
    assert (pair.lag, pair.cycles, len(pair.measured.time)) == (0, 4, 667)


def test_logs_that_cannot_be_aligned_are_refused() -> None:
    log = walking_log(szabadka())
    with pytest.raises(MeasuredLogError, match="shorter than a walking cycle"):
        synchronise(log.rows(0, CYCLE - 1), log, CYCLE_TIME)
    with pytest.raises(MeasuredLogError, match="are constant"):
        synchronise(replace(log, desired_angle=np.ones_like(log.desired_angle)), log, CYCLE_TIME)
    with pytest.raises(MeasuredLogError, match="different joints"):
        synchronise(walking_log(renamed_robot()), log, CYCLE_TIME)
