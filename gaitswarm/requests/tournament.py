"""Tournaments between search methods, from what is stored. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final, Protocol

from gaitswarm.services.optimizer.analysis.tournaments.entrants import Tournament, tournaments_of
from gaitswarm.services.optimizer.analysis.tournaments.standings import (
    looked_at,
    profiles_of,
    standings_of,
)
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Results
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.views.tournament import ProblemRunsView, TournamentStandingsView, TournamentView

_PAGE: Final = 200


class Histories(Protocol):
    """Where jobs and their evaluations are."""

    def job(self, job_id: str) -> Job:
        """A job."""

    def jobs(self, *, kind: str, after: str | None, limit: int) -> Page[Job]:
        """Jobs of a kind, page by page."""

    def columns(self, job: Job) -> EvaluationColumns:
        """All evaluations of a job."""


def run_tournaments(histories: Histories) -> list[TournamentView]:
    """List all tournaments."""
    return [TournamentView.from_tournament(found) for found in _tournaments(histories)]


def run_standings(
    histories: Histories, job_id: str, compare_with: str | None = None
) -> TournamentStandingsView:
    """Judge a tournament by all of its runs that have ended."""
    tournament = _tournament(histories, job_id, "job_id")
    compared = None
    if compare_with is not None:
        compared = _tournament(histories, compare_with, "compare_with")
    results = _results(histories, tournament)
    other = None if compared is None else _results(histories, compared)
    found = standings_of(results, looked_at(tournament.spec.evaluations), other)
    return TournamentStandingsView.from_tournament(tournament, found, profiles_of(found.results))


def run_problem(histories: Histories, job_id: str, problem: str) -> ProblemRunsView:
    """Show all runs of a tournament on a problem."""
    tournament = _tournament(histories, job_id, "job_id")
    names = tournament.spec.case_names
    if problem not in names:
        raise NotFound(f"no problem {problem!r} in this tournament; it has {', '.join(names)}")
    return ProblemRunsView.from_runs(problem, _results(histories, tournament)[problem])


def _tournaments(histories: Histories) -> tuple[Tournament, ...]:
    found: list[Job] = []
    after: str | None = None
    while True:
        page = histories.jobs(kind="tournament", after=after, limit=_PAGE)
        found += page.items
        if page.next is None:
            return tournaments_of(found)
        after = page.next


def _tournament(histories: Histories, job_id: str, field: str) -> Tournament:
    job = histories.job(job_id)
    if not isinstance(job.spec, TournamentSpec):
        raise InvalidRequest(
            f"job {job.id} is of kind {job.spec.kind}, and takes part in no tournament", field=field
        )
    for tournament in _tournaments(histories):
        if any(entrant.job.id == job.id for entrant in tournament.entrants):
            return tournament
    raise InvalidRequest(
        f"job {job.id} was cancelled, and takes part in no tournament", field=field
    )


def _results(histories: Histories, tournament: Tournament) -> Results:
    results = tournament.results(histories.columns)
    if not results:
        raise Conflict(
            f"no run of the tournament of job {tournament.id} has ended yet; ask again later"
        )
    return results
