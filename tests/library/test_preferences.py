"""Preferences with robust winners: all four clients."""

from __future__ import annotations

import pytest

import gaitswarm
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow


def test_winners_are_the_same_wherever_they_are_ranked_and_walk(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    view = jobs.preferences(finished.id, drawn=16, candidates=2, samples=40)
    indices = [found.index.value for found in view.candidates if found.index is not None]
    assert indices == sorted(indices) != []
    with gaitswarm.open(finished.db) as here:
        assert view == here.preferences(finished.id, drawn=16, candidates=2, samples=40)


def test_without_samples_nothing_walks_and_the_named_come_first(
    reach: Reach, finished: Finished
) -> None:
    view = reach(finished.db).preferences(finished.id, drawn=16)
    assert (view.drawn, view.samples) == (16, 0)
    assert [found.index for found in view.candidates] == [None] * len(view.candidates)
    assert sorted(name for found in view.candidates for name in found.named) == ["A", "B", "C"]
    ranks = [(not found.named, -found.share) for found in view.candidates]
    assert ranks == sorted(ranks)


def test_what_makes_no_sense_is_refused(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    for options, field in (
        ({"drawn": 0}, "drawn"),
        ({"samples": 5}, "samples"),
        ({"radius": 0.9}, "radius"),
        ({"precision": "half"}, "precision"),
    ):
        with pytest.raises(gaitswarm.InvalidRequest) as refused:
            jobs.preferences(finished.id, **options)
        assert refused.value.field == field
    with pytest.raises(gaitswarm.NotFound):
        jobs.preferences("nowhere")
    queued = jobs.submit(finished.result.job.spec)
    with pytest.raises(gaitswarm.Conflict, match="no design yet"):
        jobs.preferences(queued.id)
