"""Importance of scenarios: all four clients."""

from __future__ import annotations

import pytest

import gaitswarm
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow


def test_scenarios_are_left_out_in_their_turn(reach: Reach, finished: Finished) -> None:
    view = reach(finished.db).scenarios(finished.id, tolerance=0.5)
    assert view.scenarios == ["normal-fast", "turn-right-fast"]
    assert [left.scenario for left in view.left_out] == view.scenarios
    assert (view.designs + view.failed, view.tolerance) == (6, 0.5)
    with gaitswarm.open(finished.db) as here:
        assert here.scenarios(finished.id, tolerance=0.5) == view


def test_what_makes_no_sense_is_refused(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.scenarios(finished.id, tolerance=-1.0)
    assert refused.value.field == "tolerance"
    with pytest.raises(gaitswarm.NotFound):
        jobs.scenarios("nowhere")
    queued = jobs.submit(finished.result.job.spec)
    with pytest.raises(gaitswarm.Conflict, match="no design yet"):
        jobs.scenarios(queued.id)
