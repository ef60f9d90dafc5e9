"""Requests for what follows from whole histories, as values; as `calls`."""

from __future__ import annotations

from collections.abc import Sequence

from gaitswarm.jobs.server.call import Call, got, job_path, posted
from gaitswarm.services.optimizer.analysis.front import FrontView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    PreferencesRequest,
    RobustPreferencesView,
)
from gaitswarm.views import (
    RankingRequest,
    RankingView,
)
from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView
from gaitswarm.views.comparison import JobComparisonView


def ranking(job_id: str, request: RankingRequest) -> Call[RankingView]:
    """Judge all designs of a job by another preference.

    Args:
        job_id: Identifier of the job.
        request: The preference, and how many designs to list.
    """
    return posted(f"{job_path(job_id)}/ranking", RankingView, request, reads=True)


def scenarios(job_id: str, tolerance: float) -> Call[ScenarioFamiliesView]:
    """Find out which scenarios of a job matter.

    Args:
        job_id: Identifier of the job.
        tolerance: Largest regret of the smallest family, as a share.
    """
    path, read = f"{job_path(job_id)}/scenarios", ScenarioFamiliesView.model_validate_json
    return Call("GET", path, read, {"tolerance": repr(tolerance)})


def importance(job_id: str) -> Call[ImportanceView]:
    """Find out which variables of a job matter.

    Args:
        job_id: Identifier of the job.
    """
    return got(f"{job_path(job_id)}/importance", ImportanceView)


def comparison(job_ids: Sequence[str]) -> Call[JobComparisonView]:
    """Set jobs beside each other.

    Args:
        job_ids: Identifiers of the jobs, at least one.
    """
    first, *others = job_ids
    path = f"{job_path(first)}/comparison"
    return Call("GET", path, JobComparisonView.model_validate_json, {"also": others})


def preferences(job_id: str, request: PreferencesRequest) -> Call[RobustPreferencesView]:
    """Find out which preference's winner is the most robust.

    Args:
        job_id: Identifier of the job.
        request: Preferences, and walks around their winners.
    """
    path = f"{job_path(job_id)}/preferences"
    return posted(path, RobustPreferencesView, request, reads=True)


def front(job_id: str, most: int) -> Call[FrontView]:
    """Find out what designs of a job trade.

    Args:
        job_id: Identifier of the job.
        most: Designs of the front to list.
    """
    path, read = f"{job_path(job_id)}/front", FrontView.model_validate_json
    return Call("GET", path, read, {"most": str(most)})


def preference_for(job_id: str, iteration: int, particle: int) -> Call[PreferenceForView]:
    """Find the preference under which a design wins its job.

    Args:
        job_id: Identifier of the job.
        iteration: Iteration of the design, from 0.
        particle: Number of the design in its iteration, from 0.
    """
    path, read = f"{job_path(job_id)}/preference-for", PreferenceForView.model_validate_json
    return Call("GET", path, read, {"iteration": str(iteration), "particle": str(particle)})
