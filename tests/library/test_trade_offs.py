"""Trade-offs: all four clients."""

from __future__ import annotations

import pytest

import gaitswarm
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow


def test_a_front_has_the_winners_of_preferences_without_biases(
    reach: Reach, finished: Finished
) -> None:
    view = reach(finished.db).front(finished.id)
    assert view.designs_judged + view.failed == 6
    assert len(view.designs) == view.size
    (under_c,) = [design for design in view.designs if "best under C" in design.marks]
    with gaitswarm.open(finished.db) as here:
        (best,) = here.ranking(finished.id, "C", top=1).top
        assert here.front(finished.id) == view
    assert (under_c.iteration, under_c.particle) == (best.iteration, best.particle)
    assert [step.index for step in view.iterations] == [0, 1]
    assert view.iterations[-1].hypervolume == view.hypervolume


def test_a_design_gets_the_preference_under_which_it_wins(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    best = finished.result.job.best
    assert best is not None
    view = jobs.preference_for(finished.id, best.iteration, best.particle)
    assert (view.wins, view.certain) == (True, True)
    assert view.chosen.design == best.design
    (winner,) = jobs.ranking(finished.id, view.fits[0].preference, top=1).top
    assert (winner.iteration, winner.particle) == (best.iteration, best.particle)
    assert winner.fitness == view.fits[0].fitness


def test_what_makes_no_sense_is_refused(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.front(finished.id, most=0)
    assert refused.value.field == "most"
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        jobs.preference_for(finished.id, 0, -1)
    assert refused.value.field == "particle"
    for iteration, particle in ((0, 3), (2, 0)):
        with pytest.raises(gaitswarm.NotFound, match="has no design"):
            jobs.preference_for(finished.id, iteration, particle)
    for asked in (jobs.front, lambda job_id: jobs.preference_for(job_id, 0, 0)):
        with pytest.raises(gaitswarm.NotFound):
            asked("nowhere")
    queued = jobs.submit(finished.result.job.spec)
    with pytest.raises(gaitswarm.Conflict, match="no design yet"):
        jobs.front(queued.id)
