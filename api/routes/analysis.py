"""Questions about all evaluations of a job at once: spread, particles, other measures."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Response

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    Analysing,
    ExistingJob,
    JobId,
    ServerSettings,
    Service,
    Slots,
    check_sampled_length,
)
from gaitswarm.api.documentation import binary, problems
from gaitswarm.requests.analysis import (
    DESIGNS,
    MOST_FRONT_DESIGNS,
    TOLERANCE,
    PreferencesRequest,
    run_front,
    run_importance,
    run_preference_for,
    run_preferences,
    run_scenario_families,
)
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.views import (
    PREFIX,
    DistributionView,
    RankingRequest,
    RankingView,
    View,
    encoded_particles,
)
from gaitswarm.views.analysis import ImportanceView, RobustPreferencesView, ScenarioFamiliesView
from gaitswarm.views.base import MEDIA_TYPE
from gaitswarm.views.trade_offs import FrontView, PreferenceForView

PreferencesBody = Annotated[PreferencesRequest, Depends(validated(PreferencesRequest, "request"))]

MOST_RANKED: Final = 20_000_000
"""Evaluations times preferences of one request: some seconds."""

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["analysis"])


@router.get(
    "/distribution",
    dependencies=[Analysing],
    operation_id="get_distribution",
    summary="See how designs are spread",
    response_model=DistributionView,
    responses=problems(404, 409, 422),
)
def get_distribution(
    job: ExistingJob,
    service: Service,
    after: AfterIteration = None,
    limit: Annotated[int, Query(ge=1, le=10_000, description="Most iterations on a page.")] = 1000,
) -> Response:
    """Quantiles of fitness and the diversity of the designs, iteration by iteration."""
    found, more = service.distribution(job, after=after, limit=limit)
    return _json(DistributionView.from_distribution(found, more=more))


@router.get(
    "/particles",
    dependencies=[Analysing],
    operation_id="get_particles",
    summary="Take every design as numbers",
    response_class=Response,
    responses=binary(
        "Length of the header (uint32), header (JSON, padded with spaces), then every column's"
        " numbers (float32), all little-endian."
    )
    | problems(404, 409, 422),
)
def get_particles(
    job: ExistingJob,
    service: Service,
    after_iteration: AfterIteration = None,
    max_points: Annotated[
        int,
        Query(
            ge=1,
            le=1_000_000,
            description="Most designs; more are thinned evenly in iterations, the best is kept.",
        ),
    ] = 100_000,
    objectives: Annotated[
        bool,
        Query(
            description="Whether f1 to f5 follow, each as its geometric mean over the scenarios;"
            " only jobs that tune a drive have them."
        ),
    ] = False,
) -> Response:
    """One row per design, by column, in binary: iteration, particle, fitness, the searched
    variables, and the utility in each scenario; NaN for what does not exist.

    The header is a ParticlesHeaderView: it names the columns in order, with units and bounds.
    """
    body = encoded_particles(
        job,
        service.columns(job),
        after=after_iteration,
        most=max_points,
        objectives=objectives,
    )
    return Response(body, media_type=MEDIA_TYPE)


@router.post(
    "/ranking",
    dependencies=[Analysing],
    operation_id="rank_designs",
    summary="Judge by another preference",
    response_model=RankingView,
    responses=problems(400, 404, 409, 413, 422),
)
def rank_designs(request: RankingRequest, job: ExistingJob, service: Service) -> Response:
    """All designs of a job, ranked anew from their stored objectives: no walk is simulated.

    For jobs that tune a drive; a job that identifies parameters has no preference.
    """
    ranked = service.rank(job, request.resolved_preference(), top=request.top)
    return _json(RankingView.from_ranked_job(request, ranked))


@router.get(
    "/scenarios",
    dependencies=[Analysing],
    operation_id="get_scenario_families",
    summary="See which scenarios matter",
    response_model=ScenarioFamiliesView,
    responses=problems(404, 409, 422),
)
def get_scenario_families(
    job_id: JobId,
    service: Service,
    tolerance: Annotated[
        float,
        Query(ge=0.0, allow_inf_nan=False, description="Largest regret of a smallest family [1]."),
    ] = TOLERANCE,
) -> Response:
    """What a job would have taken for its best with fewer scenarios: each of them left out, and
    families of every size; from stored objectives, no walk is simulated.
    """
    return _json(run_scenario_families(service, job_id, tolerance))


@router.get(
    "/importance",
    dependencies=[Analysing],
    operation_id="get_importance",
    summary="See which variables matter",
    response_model=ImportanceView,
    responses=problems(404, 409, 422),
)
def get_importance(job_id: JobId, service: Service) -> Response:
    """First-order Sobol' indices of every variable for the fitness, for each objective and for
    failing, among the designs that were tried; and whether the winner lies at a bound.

    From stored objectives, no walk is simulated.
    """
    return _json(run_importance(service, job_id))


@router.get(
    "/front",
    dependencies=[Analysing],
    operation_id="get_front",
    summary="See what designs trade",
    response_model=FrontView,
    responses=problems(404, 409, 422),
)
def get_front(
    job_id: JobId,
    service: Service,
    most: Annotated[
        int,
        Query(
            ge=1,
            le=MOST_FRONT_DESIGNS,
            description="Most designs; of more, those with a mark and others that cover the front"
            " evenly.",
        ),
    ] = DESIGNS,
) -> Response:
    """The Pareto front of a job over f1 to f5: designs that no other dominates, its knees, the best
    in each objective and under A, B and C, and its hypervolume over the iterations.

    From stored objectives, no walk is simulated; for any job that tunes a drive, whatever its
    search was for.
    """
    return _json(run_front(service, job_id, most=most))


@router.get(
    "/preference-for",
    dependencies=[Analysing],
    operation_id="get_preference_for",
    summary="Find the preference of a design",
    responses=problems(404, 409, 422),
)
def get_preference_for(
    job_id: JobId,
    service: Service,
    iteration: Annotated[
        int, Query(ge=0, le=LARGEST_INDEX, description="Iteration of the design, from 0.")
    ],
    particle: Annotated[
        int,
        Query(ge=0, le=LARGEST_INDEX, description="Number of the design in its iteration, from 0."),
    ],
) -> PreferenceForView:
    """Biases and exponents under which a design is the best of its job, if there are any.

    409 for a design that fails in a scenario.
    """
    return run_preference_for(service, job_id, iteration, particle)


@router.post(
    "/preferences",
    operation_id="find_robust_preferences",
    summary="See whose winners are robust",
    response_model=RobustPreferencesView,
    responses=problems(400, 404, 409, 413, 422),
)
async def find_robust_preferences(
    request: PreferencesBody,
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    slots: Slots,
) -> Response:
    """Rank a job's designs under A, B, C and drawn preferences, and list who wins.

    From stored objectives; with `samples` so many designs walk around each winner, by which its
    robustness index (thesis 4.4.3) is estimated, and the most robust comes first. The answer waits
    for these walks, so the time walked is limited; what is ranked is, too.
    """
    _check_ranked(request, job)

    def found() -> Response:
        check = partial(check_sampled_length, settings)
        return _json(run_preferences(service, job.id, request, check=check))

    return await slots.run(found)


def _check_ranked(request: PreferencesRequest, job: Job) -> None:
    """Raises InvalidRequest."""
    most = max(1, MOST_RANKED // max(1, job.progress.evaluations))
    if request.drawn > most:
        raise InvalidRequest(
            f"must be at most {most} for the {job.progress.evaluations} evaluations of this job",
            field="drawn",
        )


def _json(view: View) -> Response:
    """Serialized here: thousands of items are not validated once more on their way out."""
    return Response(view.model_dump_json(), media_type="application/json")
