"""Tournaments answer alike in a database and behind a server."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest

import gaitswarm
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.sql_store import open_store
from tests.library.conftest import Reach
from tests.tournament.examples import entrant, submitted

pytestmark = pytest.mark.slow


@pytest.fixture
def compared(db: Path) -> list[str]:
    """Ids of two jobs of a tournament, and of one of another."""
    with closing(open_store(str(db))) as store:
        service = JobService(store)
        elsewhere = entrant("pso", "pso", problems=[{"function": "D4C0R0I0"}])
        return [
            submitted(service, entrant("pso", "pso"), [1e-4, 0.2]).id,
            submitted(service, entrant("random", "random"), [0.5, 0.6]).id,
            submitted(service, elsewhere).id,
        ]


def test_tournaments_are_listed_judged_and_shown(
    reach: Reach, db: Path, compared: list[str]
) -> None:
    jobs = reach(db)
    first, second, other = compared
    assert [found.id for found in jobs.tournaments()] == [other, first]
    found = jobs.standings(second)
    assert (found.tournament, *found.mean_ranks) == (jobs.tournaments()[1], "pso", "random")
    assert found.problems["D7C0R1I1"].methods["pso"].solved == 1
    runs = jobs.problem_runs(first, "D7C0R1I1")
    assert runs.methods["random"].best == [0.5, 0.6]


def test_what_there_is_not_is_an_error(reach: Reach, db: Path, compared: list[str]) -> None:
    jobs = reach(db)
    first, _, other = compared
    with pytest.raises(gaitswarm.Conflict, match="has ended yet"):
        jobs.standings(first, compare_with=other)
    with pytest.raises(gaitswarm.NotFound, match="no problem"):
        jobs.problem_runs(first, "D4C0R0I0")
    for ask in (jobs.standings, lambda job: jobs.problem_runs(job, "D4C0R0I0")):
        with pytest.raises(gaitswarm.NotFound):
            ask("nosuchjob")
    tuning = jobs.submit(controller="pi", iterations=1)
    with pytest.raises(gaitswarm.InvalidRequest, match="is of kind tuning") as raised:
        jobs.standings(tuning.id)
    assert raised.value.field == "job_id"
