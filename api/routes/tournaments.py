"""Tournaments between search methods: which there are, and what they come to."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query

from gaitswarm.api.dependencies import Analysing, JobId, JobIdText, Service
from gaitswarm.api.documentation import problems
from gaitswarm.requests.tournament import run_problem, run_standings, run_tournaments
from gaitswarm.views import PREFIX
from gaitswarm.views.tournament import (
    ProblemRunsView,
    TournamentStandingsView,
    TournamentsView,
)

router = APIRouter(prefix=f"{PREFIX}/tournaments", tags=["tournaments"])


@router.get(
    "",
    dependencies=[Analysing],
    operation_id="list_tournaments",
    summary="List tournaments",
    responses=problems(),
)
def list_tournaments(service: Service) -> TournamentsView:
    """Jobs of kind `tournament`, put together where their runs can be compared; newest first.

    Those of one tournament have the same problems, budget and checkpoints, and depend on the same
    code. Cancelled jobs take no part.
    """
    return TournamentsView(items=run_tournaments(service))


@router.get(
    "/{job_id}",
    dependencies=[Analysing],
    operation_id="get_standings",
    summary="See what a tournament comes to",
    responses=problems(404, 409, 422),
)
def get_standings(
    job_id: JobId,
    service: Service,
    compare_with: Annotated[
        JobIdText | None,
        Query(description="A job of another tournament, to compare its mean ranks."),
    ] = None,
) -> TournamentStandingsView:
    """Ranks with bootstrap intervals, expected running times, medians and data profiles.

    Any job of the tournament stands for it. What counts are all runs that have ended; methods
    without one are left out.
    """
    return run_standings(service, job_id, compare_with)


@router.get(
    "/{job_id}/problems/{problem}",
    dependencies=[Analysing],
    operation_id="get_problem_runs",
    summary="See all runs on a problem",
    responses=problems(404, 409, 422),
)
def get_problem_runs(
    job_id: JobId,
    problem: Annotated[
        str, Path(min_length=1, max_length=40, description="Name of a problem of the tournament.")
    ],
    service: Service,
) -> ProblemRunsView:
    """Performance clouds as figs. 3.1 to 3.3: the best of every run, and when it was found.

    With the median and quartiles of the best so far, by checkpoint.
    """
    return run_problem(service, job_id, problem)
