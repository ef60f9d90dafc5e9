"""The part of the port that is about tournaments between search methods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gaitswarm.views.tournament import (
        ProblemRunsView,
        TournamentStandingsView,
        TournamentView,
    )


class Tournaments(ABC):
    """Jobs of the kind `tournament`, compared from what is stored."""

    @abstractmethod
    def tournaments(self) -> list[TournamentView]:
        """List tournaments: jobs that ran search methods on the same problems.

        Returns:
            Their problems and methods, newest first. A cancelled job takes no part.
        """

    @abstractmethod
    def standings(self, job_id: str, *, compare_with: str | None = None) -> TournamentStandingsView:
        """See what a tournament comes to, of all runs that have ended.

        Args:
            job_id: Identifier of one of its jobs.
            compare_with: Identifier of a job of another tournament, whose mean ranks are compared.

        Returns:
            Ranks with bootstrap intervals, expected running times, medians, data profiles.

        Raises:
            InvalidRequest: A job of another kind, or one that was cancelled.
            Conflict: No run has ended yet.
        """

    @abstractmethod
    def problem_runs(self, job_id: str, problem: str) -> ProblemRunsView:
        """See all runs of a tournament on one problem.

        Args:
            job_id: Identifier of one of its jobs.
            problem: Name of the problem, as in `tournaments`.

        Returns:
            Every run's best and when it was found, and the best so far by checkpoint.

        Raises:
            NotFound: The tournament has no such problem.
            InvalidRequest: A job of another kind, or one that was cancelled.
            Conflict: No run has ended yet.
        """
