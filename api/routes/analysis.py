"""Analyses of the stored evaluations of one or more jobs."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Response

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    Analyzing,
    Computing,
    ExistingJob,
    JobId,
    JobIdText,
    ServerSettings,
    Service,
    check_sampled_length,
)
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.responses import BinaryResponse, json_response
from gaitswarm.requests.analysis import run_certificate
from gaitswarm.requests.comparison import MOST_JOBS, run_comparison, run_convergences
from gaitswarm.requests.identification import run_targets
from gaitswarm.requests.robustness import sampled_indices
from gaitswarm.services.optimizer.analysis.certificate import MOST_WORST
from gaitswarm.services.optimizer.analysis.distribution import DistributionView
from gaitswarm.services.optimizer.analysis.front import FRONT_DESIGNS, MOST_FRONT_DESIGNS, FrontView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    PreferencesRequest,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingRequest, RankingView
from gaitswarm.services.optimizer.analysis.scenario_families import TOLERANCE, ScenarioFamiliesView
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.views import PREFIX, encoded_particles
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.catalogue import JobReferenceView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.comparison import ConvergencesView, JobComparisonView
from gaitswarm.views.identification import IdentifiabilityView

PreferencesBody = Annotated[PreferencesRequest, Depends(validated(PreferencesRequest, "request"))]

FurtherRuns = Annotated[
    list[JobIdText] | None,
    Query(max_length=31, description="Further runs of the same problem, with other seeds."),
]

MOST_RANKED: Final = 20_000_000
"""Evaluations times preferences of one request, which take some seconds."""

router = APIRouter(prefix=PREFIX, tags=["analysis"])


@router.get(
    "/jobs/{job_id}/distribution",
    dependencies=[Analyzing],
    operation_id="get_distribution",
    summary="Get the distribution of designs",
    response_model=DistributionView,
    responses=problems(404, 409, 422),
)
def get_distribution(
    job: ExistingJob,
    service: Service,
    after: AfterIteration = None,
    limit: Annotated[
        int, Query(ge=1, le=10_000, description="Maximum number of iterations.")
    ] = 1000,
) -> Response:
    """Return quantiles of the fitness and the diversity of the designs by iteration."""
    return json_response(service.distribution(job.id, after=after, limit=limit))


@router.get(
    "/jobs/{job_id}/particles",
    dependencies=[Analyzing],
    operation_id="get_particles",
    summary="Get all designs as binary columns",
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
            description="Maximum number of designs; more are thinned evenly over the iterations,"
            " and the best is kept.",
        ),
    ] = 100_000,
    objectives: Annotated[
        bool,
        Query(
            description="Whether to add f1 to f5, each as its geometric mean over the scenarios;"
            " only for jobs that tune a drive."
        ),
    ] = False,
) -> Response:
    """Return one row per design, by column: iteration, particle, fitness, the searched variables,
    and the utility in each scenario; NaN where undefined.

    The header is a ParticlesHeaderView: it names the columns in order, with units and bounds.
    """
    body = encoded_particles(
        job,
        service.columns(job),
        after=after_iteration,
        most=max_points,
        objectives=objectives,
    )
    return BinaryResponse(body)


@router.post(
    "/jobs/{job_id}/ranking",
    dependencies=[Analyzing],
    operation_id="rank_designs",
    summary="Rank designs under another preference",
    response_model=RankingView,
    responses=problems(400, 404, 409, 413, 422),
)
def rank_designs(request: RankingRequest, job: ExistingJob, service: Service) -> Response:
    """Rank all designs of a job by their stored objectives; nothing is simulated.

    For jobs that tune a drive; a job that identifies parameters has no preference.
    """
    return json_response(service.ranking(job.id, request))


@router.get(
    "/jobs/{job_id}/scenarios",
    dependencies=[Analyzing],
    operation_id="get_scenario_families",
    summary="Get the importance of scenarios",
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
    """Return the best designs that a job would have had with fewer scenarios: without each of them,
    and for families of every size. From stored objectives; nothing is simulated.
    """
    return json_response(service.scenarios(job_id, tolerance=tolerance))


@router.get(
    "/jobs/{job_id}/importance",
    dependencies=[Analyzing],
    operation_id="get_importance",
    summary="Get the importance of variables",
    response_model=ImportanceView,
    responses=problems(404, 409, 422),
)
def get_importance(job_id: JobId, service: Service) -> Response:
    """Return first-order Sobol' indices of every variable for the fitness, each objective and
    failure, among the evaluated designs; and whether the best design lies at a bound.

    From stored objectives; nothing is simulated.
    """
    return json_response(service.importance(job_id))


@router.get(
    "/jobs/{job_id}/front",
    dependencies=[Analyzing],
    operation_id="get_front",
    summary="Get the Pareto front",
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
            description="Maximum number of designs; of more, marked designs and others that cover"
            " the front evenly.",
        ),
    ] = FRONT_DESIGNS,
) -> Response:
    """Return the Pareto front over f1 to f5: nondominated designs, its knees, the best in each
    objective and under A, B and C, and its hypervolume by iteration.

    From stored objectives; nothing is simulated. For any job that tunes a drive.
    """
    return json_response(service.front(job_id, most=most))


@router.get(
    "/jobs/{job_id}/preference-for",
    dependencies=[Analyzing],
    operation_id="get_preference_for",
    summary="Find a preference for a design",
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
    """Return biases and exponents under which a design is the best of its job, if there are any.

    409 for a design that fails in a scenario.
    """
    return service.preference_for(job_id, iteration, particle)


@router.post(
    "/jobs/{job_id}/preferences",
    operation_id="find_robust_preferences",
    summary="Rank designs under many preferences",
    response_model=RobustPreferencesView,
    responses=problems(400, 404, 409, 413, 422),
)
async def find_robust_preferences(
    request: PreferencesBody,
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    computing: Computing,
) -> Response:
    """Rank a job's designs under A, B, C and random preferences, and list the winners.

    From stored objectives. With `samples`, that number of designs is simulated around each winner
    to estimate its robustness index (thesis 4.4.3), and the most robust comes first. The number of
    ranked designs and the simulated time are limited.
    """
    _check_ranked(request, job)
    index = partial(sampled_indices, check=partial(check_sampled_length, settings))
    return await computing.run(lambda: json_response(service.preferences(job.id, request, index)))


def _check_ranked(request: PreferencesRequest, job: Job) -> None:
    most = max(1, MOST_RANKED // max(1, job.progress.evaluations))
    if request.drawn > most:
        raise InvalidRequest(
            f"must be at most {most} for the {job.progress.evaluations} evaluations of this job",
            field="drawn",
        )


@router.get(
    "/jobs/{job_id}/reference",
    operation_id="get_reference",
    summary="Compare a job's best with the published or the start design",
    responses=problems(404, 422),
)
async def get_reference(job_id: JobId, service: Service, computing: Computing) -> JobReferenceView:
    """Compare the best design so far with a reference in the job's scenarios: the published design
    of its controller and preference, or for custom robots the middle of the bounds.

    The reference is simulated once and stored with the job; job lists include it from then on.
    """
    return JobReferenceView.from_comparison(
        *await computing.run(partial(service.reference, job_id))
    )


@router.get(
    "/jobs/{job_id}/comparison",
    dependencies=[Analyzing],
    operation_id="compare_jobs",
    summary="Compare jobs",
    response_model=JobComparisonView,
    responses=problems(404, 409, 422),
)
def compare_jobs(
    job_id: JobId,
    service: Service,
    also: Annotated[
        list[JobIdText] | None,
        Query(max_length=MOST_JOBS - 1, description="Further jobs, each once."),
    ] = None,
) -> Response:
    """Compare the convergence of jobs by iterations, evaluations and time, the distribution of
    fitness of their designs, and their specs.
    """
    return json_response(run_comparison(service, [job_id, *(also or ())]))


@router.get(
    "/job-convergences",
    dependencies=[Analyzing],
    operation_id="list_convergences",
    summary="Get short convergences of jobs",
    responses=problems(422),
)
def list_convergences(
    service: Service,
    job: Annotated[list[JobIdText], Query(min_length=1, max_length=200, description="Job ids.")],
    points: Annotated[
        int, Query(ge=2, le=100, description="Maximum number of iterations per job.")
    ] = 24,
) -> ConvergencesView:
    """Return the best fitness over the iterations of several jobs, for sparklines in lists."""
    return run_convergences(service, job, points)


@router.get(
    "/jobs/{job_id}/certificate",
    dependencies=[Analyzing],
    operation_id="get_certificate",
    summary="Get the results of a design in many worlds",
    responses=problems(404, 409, 422),
)
def get_certificate(
    job: ExistingJob,
    service: Service,
    worlds: Annotated[
        int | None, Query(ge=1, le=1_000_000, description="Number of worlds, from the first.")
    ] = None,
    most: Annotated[
        int, Query(ge=0, le=MOST_WORST, description="Number of worst worlds to list.")
    ] = 5,
) -> CertificateView:
    """Return failure rate, worst results and their worlds for a job of kind `certificate`.

    From the worlds simulated so far. The `replay` of a world is a command; its `values` are the
    `world` of POST /v1/replays.
    """
    return run_certificate(service, job.id, worlds=worlds, most=most)


@router.get(
    "/jobs/{job_id}/targets",
    dependencies=[Analyzing],
    operation_id="get_targets",
    summary="Get the deviations of a calibration from its targets",
    responses=problems(404, 409, 422),
)
def get_targets(
    job: ExistingJob,
    service: Service,
    also: FurtherRuns = None,
    leave_out: Annotated[
        LeaveOut | None,
        Query(
            description="Predict every target by the best design without that `target`, or without"
            " all targets of its `walk`. Nothing is simulated."
        ),
    ] = None,
) -> TargetsView:
    """Return the values of every target for the best design of all runs of a `calibration`.

    Differences are in units of the tolerance. `/parameters` has the best fitness of each choice of
    a categorical variable.
    """
    return run_targets(service, [job.id, *(also or ())], leave_out)


@router.get(
    "/jobs/{job_id}/parameters",
    dependencies=[Analyzing],
    operation_id="get_parameters",
    summary="Get the identifiability of parameters",
    responses=problems(404, 409, 422),
)
def get_parameters(
    job: ExistingJob, service: Service, also: FurtherRuns = None
) -> IdentifiabilityView:
    """Return the interval of every variable among designs within twelve thresholds of the best.

    Mainly for jobs of kind `identification`. A single run always narrows; only runs with different
    seeds that narrow to the same values show that a parameter is identifiable.
    """
    jobs = [job, *(service.job(other) for other in also or ())]
    return IdentifiabilityView.from_identifiability(
        [j.id for j in jobs], service.identifiability(jobs)
    )
