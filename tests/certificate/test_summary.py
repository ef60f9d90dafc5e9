"""Summaries of certificates, on synthetic outcomes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.certificate import (
    CertificateView,
    certificate,
    proportion,
)
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.kinds.certificate import (
    CertificateSpec,
    conditional_value_at_risk,
)
from gaitswarm.sim.outcome import Status
from tests.certificate.examples import columns, small

PRODUCT = {"bias": [0.0] * 5, "exponent": [0.2] * 5}
"""By which a walk whose objectives are all x is worth x."""


def plain(worlds: int) -> CertificateSpec:
    return small(preference=PRODUCT, worlds=worlds)


def summary(values: list[list[float]], statuses: list[list[int]] | None = None) -> CertificateView:
    """Of a design; rows are worlds, the nominal one first, columns the two scenarios."""
    spec = plain(len(values) - 1)
    ended = None if statuses is None else np.array(statuses, dtype=np.float64)
    return certificate("job", spec, columns(spec, np.array(values), ended))


@pytest.mark.parametrize(("count", "of"), [(0, 20), (3, 20), (20, 20), (1, 1000)])
def test_intervals_of_proportions_are_exact(count: int, of: int) -> None:
    found = proportion(np.arange(of) < count)
    assert (found.count, found.share) == (count, count / of)

    def probability(counts: range, share: float) -> float:
        return sum(math.comb(of, k) * share**k * (1.0 - share) ** (of - k) for k in counts)

    # At each limit, as many or more, or as few or fewer, have a probability of 2.5 %.
    if count == 0:
        assert found.low == 0.0
    else:
        assert probability(range(count, of + 1), found.low) == pytest.approx(0.025, rel=1e-8)
    if count == of:
        assert found.high == 1.0
    else:
        assert probability(range(count + 1), found.high) == pytest.approx(0.025, rel=1e-8)


def test_the_conditional_value_at_risk_is_the_mean_of_the_tail() -> None:
    values = np.arange(1.0, 101.0)
    assert conditional_value_at_risk(values) == pytest.approx((96 + 97 + 98 + 99 + 100) / 5)
    # Of thirty values the tail is one and a half: the worst, and half of the next.
    assert conditional_value_at_risk(values[:30]) == pytest.approx((30.0 + 0.5 * 29.0) / 1.5)
    assert conditional_value_at_risk(values[:4]) == 4.0
    assert conditional_value_at_risk(values, level=0.0) == pytest.approx(50.5)


def test_spreads_are_of_the_drawn_worlds_without_the_nominal_one() -> None:
    found = summary([[7.0, 28.0], *([float(k), 4.0 * k] for k in range(1, 101))])
    level = found.scenarios["short"].utility
    assert level.nominal == pytest.approx(7.0)
    assert level.quantiles == pytest.approx([5.0, 25.0, 50.0, 75.0, 95.0])
    assert (level.worst, level.cvar) == pytest.approx((100.0, 98.0))
    assert level.tail_failed == 0.0
    # Of a scenario in which all is four times as bad, and over both: the geometric mean.
    assert found.scenarios["uphill"].utility.cvar == pytest.approx(4 * 98.0)
    assert found.fitness.cvar == pytest.approx(2 * 98.0)
    assert found.worlds == 100


def test_a_failed_walk_is_worse_than_any_and_counts_as_the_worst_of_the_others() -> None:
    values = [[1.0, 1.0], *([float(k), 1.0] for k in range(1, 41))]
    statuses = [[Status.OK, Status.OK] for _ in values]
    for world in (0, 1, 2):
        statuses[1 + world][0] = Status.FELL
    statuses[1 + 3][0] = Status.STALLED
    case, other = summary(values, [list(map(int, row)) for row in statuses]).scenarios.values()
    assert case.statuses == {"ok": 36, "fell": 3, "stalled": 1}
    assert (case.fell.count, case.failed.count) == (3, 4)
    # 36 of 40 did not fail, so that the worst 5 % are failed walks.
    assert case.utility.quantiles[-1] is None
    assert case.utility.quantiles[2] == pytest.approx(24.0)
    assert (case.utility.worst, case.utility.cvar) == pytest.approx((40.0, 40.0))
    assert case.utility.tail_failed == 1.0
    assert other.failed.count == 0
    assert other.utility.cvar == pytest.approx(1.0)


def test_a_design_that_always_fails_has_no_values_but_a_probability() -> None:
    fallen = [[int(Status.FELL), int(Status.OK)]] * 6
    found = summary([[1.0, 1.0]] * 6, fallen)
    spread = found.scenarios["short"].utility
    assert (spread.worst, spread.cvar) == (None, None)
    assert (found.fell.share, found.failed.high) == (1.0, 1.0)
    assert found.influences == []


def test_the_worst_worlds_come_first_with_their_worst_scenario() -> None:
    ok, fell = int(Status.OK), int(Status.FELL)
    values = [[10.0, 20.0], [11.0, 21.0], [30.0, 20.0], [10.0, 50.0], [1.0, 1.0], [1.0, 1.0]]
    statuses = [[ok, ok], [ok, ok], [ok, ok], [ok, ok], [ok, fell], [fell, fell]]
    spec = plain(5)
    found = certificate("job", spec, columns(spec, np.array(values), np.array(statuses)), most=4)
    assert [world.world for world in found.worst] == [4, 3, 1, 2]
    assert [world.scenario for world in found.worst] == ["short", "uphill", "short", "uphill"]
    assert found.worst[0].failures == {"short": "fell", "uphill": "fell"}
    assert found.worst[3].failures == {}
    assert found.worst[1].values == spec.world(3)
    assert (found.worst[1].iteration, found.worst[1].particle) == (1, 0)


def test_influences_are_rank_correlations() -> None:
    spec = plain(60)
    friction = np.array([spec.world(k)["friction_factor"] for k in range(60)])
    noise = np.array([spec.world(k)["slope_added"] for k in range(60)])
    worth = np.concatenate([[1.0], np.exp(-friction) + 0.02 * noise])
    found = certificate("job", spec, columns(spec, np.stack([worth, worth], axis=1)))
    first = found.influences[0]
    assert first.name == "friction_factor"
    one, other = (values.argsort().argsort() for values in (friction, worth[1:]))
    differences = np.square(one - other).sum()
    assert first.correlation == pytest.approx(1.0 - 6.0 * differences / (60**3 - 60))
    assert -1.0 < first.low < first.correlation < first.high < -0.8
    sizes = [abs(influence.correlation) for influence in found.influences]
    assert sizes == sorted(sizes, reverse=True) and len(sizes) == 3


def test_the_loss_of_height_counts_by_its_size() -> None:
    spec = plain(2)
    made = columns(spec, np.ones((3, 2)))
    made.objectives[1:, :, 5] = [[-0.03, 0.0], [0.01, 0.0]]
    short = certificate("job", spec, made).scenarios["short"]
    assert short.objectives["height_loss"].worst == pytest.approx(0.03)


def test_fewer_worlds_are_the_first_ones() -> None:
    spec = plain(20)
    made = columns(spec, np.arange(1.0, 43.0).reshape(21, 2))
    few = certificate("job", spec, made, worlds=5)
    assert few.worlds == 5
    assert few.scenarios["short"].utility.worst == pytest.approx(11.0)


def test_a_certificate_without_a_drawn_world_is_refused() -> None:
    spec = plain(5)
    with pytest.raises(Conflict, match="no drawn world has been simulated yet"):
        certificate("job", spec, columns(spec, np.ones((1, 2))))
