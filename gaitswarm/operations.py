"""The table of operations: every question to the service, for HTTP and in process.

A function per operation computes its answer in this process. The server's routes and its client
take method, path and models from the table. Arguments of a function are the service, the parameters
of the path, and at most one model: the body, or for GET the query. Keyword-only arguments are
filled in by a server: the client's name, its quota, and limits.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Generic,
    Literal,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from gaitswarm.designs import SimulationRequest, resolved
from gaitswarm.firmware import (
    FirmwareRequest,
    FirmwareView,
    firmware_request_of_best,
    firmware_view,
    run_firmware,
)
from gaitswarm.meshes import MeshFileView, MeshLibrary
from gaitswarm.recordings import (
    MeasuredWalkRequest,
    MeasuredWalkView,
    RecordingEntryView,
    RecordingView,
    read_measured_walk,
)
from gaitswarm.replay import ReplayRequest, run_replay
from gaitswarm.robots import RobotCheckView, RobotDraftRequest, RobotDraftView, run_robot_draft
from gaitswarm.robots import check_robot as checked_robot
from gaitswarm.robustness_index import (
    RobustnessRequest,
    RobustnessView,
    run_robustness,
    sampled_indices,
)
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.optimizer.analysis.certificate import MOST_WORST, CertificateView
from gaitswarm.services.optimizer.analysis.comparison import (
    MOST_JOBS,
    ConvergencesView,
    JobComparisonView,
)
from gaitswarm.services.optimizer.analysis.distribution import DistributionView
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.analysis.failures import FailuresView
from gaitswarm.services.optimizer.analysis.front import FRONT_DESIGNS, MOST_FRONT_DESIGNS, FrontView
from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    PreferencesRequest,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingRequest, RankingView
from gaitswarm.services.optimizer.analysis.reference import JobReferenceView
from gaitswarm.services.optimizer.analysis.scenario_families import TOLERANCE, ScenarioFamiliesView
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter, LabelsChange
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import MEDIA_TYPE as BINARY
from gaitswarm.services.optimizer.views import PageView
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.firmware import parsed_table_bits
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.simulation import SimulationView, run_simulation
from gaitswarm.specs import checked
from gaitswarm.surface import SurfaceRequest, SurfaceView, run_surface
from gaitswarm.tables import TableFormat, encoded_table
from gaitswarm.views.catalogue import (
    CaseView,
    CatalogueView,
    ControllerView,
    OptimizerView,
    PluginView,
    PreferenceView,
    RobotView,
    ScenarioView,
    case_views,
    controller_views,
    optimizer_views,
    plugin_views,
    preference_views,
    robot_views,
    scenario_views,
)
from gaitswarm.views.history import BestView, IterationView
from gaitswarm.views.job import (
    EstimateView,
    ExtensionRequest,
    JobFacetsView,
    JobKind,
    JobSummaryView,
    JobView,
    PriorityRequest,
    ResumeRequest,
    StateView,
)
from gaitswarm.views.operations import ActivityView, AuditEntryView, Level, NotificationView
from gaitswarm.views.verification import HistoryVerificationView, VerificationRequest
from gaitswarm.zip_archive import MEDIA_TYPE as ZIP
from gaitswarm.zip_archive import zipped

T = TypeVar("T")

Tag = Literal["core", "analysis", "robots", "operations"]
Access = Literal["read", "submit", "command", "admin"]
"""Permission that a token needs; `command`: to command the job of the path."""

LARGEST_INDEX: Final = 2**31 - 1
"""Largest index of an iteration in the database."""


@dataclass(frozen=True)
class Limits:
    """What one request may compute.

    Attributes:
        simulated: Length of all simulations [s].
        logged: The same, of simulations with logs [s].
        sampled: The same, of samples of designs [s].
        ranked: Evaluations times preferences [1].
    """

    simulated: float = math.inf
    logged: float = math.inf
    sampled: float = math.inf
    ranked: float = math.inf

    def check(self, seconds: float, *, field: str, logged: bool = False) -> None:
        """Reject simulations that are too long in total."""
        advice = f"allowed{' with logs' if logged else ''}; choose fewer scenarios or cycles"
        limit = self.logged if logged else self.simulated
        _check_length("the simulations", seconds, limit, advice, field)

    def check_sampled(self, seconds: float) -> None:
        """Reject samples of designs whose simulations are too long in total."""
        advice = "allowed; choose fewer samples or scenarios"
        designs = "the simulations of all designs"
        _check_length(designs, seconds, self.sampled, advice, "samples")

    def check_repeated(self, seconds: float) -> None:
        """Reject repeated evaluations whose simulations are too long in total."""
        evaluations = "the simulations of these evaluations"
        _check_length(evaluations, seconds, self.sampled, "allowed; choose fewer", "replay")

    def check_ranked(self, preferences: int, job: Job) -> None:
        """Reject too many preferences for the evaluations of a job."""
        evaluations = job.progress.evaluations
        most = max(1.0, self.ranked / max(1, evaluations))
        if preferences > most:
            raise InvalidRequest(
                f"must be at most {math.floor(most)} for the {evaluations} evaluations of this job",
                field="drawn",
            )


def _check_length(what: str, seconds: float, limit: float, advice: str, field: str) -> None:
    if seconds > limit:
        text = f"{what} last {seconds:g} s in total, more than the {limit:g} s {advice}"
        raise InvalidRequest(text, field=field)


UNLIMITED: Final = Limits()


@dataclass(frozen=True, eq=False)
class Operation(Generic[T]):
    """A question or a command, over HTTP and in process.

    Attributes:
        answer: Computes the answer in this process.
        path: Under the prefix of the API.
        summary: A few words.
        reads: Whether it changes nothing, so that a client may send it again.
        heavy: Whether it simulates or reads whole histories; a server limits how many run.
        access: Permission that a token needs.
        status: Of a successful response.
        refusals: Statuses of errors, besides those that follow from the parameters.
        content: What the bytes are, for answers that are not JSON.
        media_type: Of those bytes.
        filename: Name of the download, with the parameters of the path.
        cached: Whether clients cache the bytes by their ETag.
        location: Path of what the operation creates, given its answer.
        page: Whether only the web page uses it.
    """

    answer: Callable[..., T]
    method: str
    path: str
    summary: str
    tag: Tag
    reads: bool
    heavy: bool = False
    access: Access = "read"
    status: int = 200
    refusals: tuple[int, ...] = ()
    content: str = ""
    media_type: str = BINARY
    filename: str | None = None
    cached: bool = False
    location: Callable[[T], str] | None = None
    page: bool = False

    @property
    def id(self) -> str:
        """OpenAPI operation id."""
        return self.answer.__name__

    @cached_property
    def path_names(self) -> tuple[str, ...]:
        """Parameters of the path."""
        return tuple(re.findall(r"\{(\w+)\}", self.path))

    @cached_property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Parameters of the function after the service, with evaluated annotations."""
        hints = get_type_hints(self.answer, include_extras=True)
        _, *others = inspect.signature(self.answer).parameters.values()
        return {p.name: p.replace(annotation=hints[p.name]) for p in others}

    @cached_property
    def request(self) -> inspect.Parameter | None:
        """The parameter that is the body, or for GET the query."""
        for name, parameter in self.parameters.items():
            if parameter.kind is not parameter.KEYWORD_ONLY and name not in self.path_names:
                return parameter
        return None

    @cached_property
    def result(self) -> Any:
        """Type of the answer."""
        return get_type_hints(self.answer)["return"]

    @cached_property
    def adapter(self) -> TypeAdapter[T]:
        """Reads and writes the answer as JSON."""
        return TypeAdapter(self.result)

    def request_of(self, arguments: dict[str, Any]) -> BaseModel | None:
        """Validate keyword arguments; raise InvalidRequest that names the field."""
        if self.request is None:
            return None
        kind: Any = self.request.annotation
        if get_origin(kind) is UnionType:
            kind = next(part for part in get_args(kind) if part is not NoneType)
        request: BaseModel = checked(kind, arguments)
        return request


OPERATIONS: Final[list[Operation[Any]]] = []
"""All operations, in the order of the OpenAPI document."""


def _operation(
    route: str, tag: Tag, summary: str, *refusals: int, reads: bool = False, **options: Any
) -> Callable[[Callable[..., T]], Operation[T]]:
    method, path = route.split()

    def add(answer: Callable[..., T]) -> Operation[T]:
        operation = Operation(
            answer, method, path, summary, tag, reads or method == "GET", refusals=refusals,
            **options,
        )  # fmt: skip
        OPERATIONS.append(operation)
        return operation

    return add


JobIdText = Annotated[
    str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_-]+$", examples=["k2q7zr5dm9xw"])
]

Index = Annotated[int, Field(ge=0, le=LARGEST_INDEX)]

AfterIteration = Annotated[
    int | None, Field(ge=0, le=LARGEST_INDEX, description="Only iterations with a greater index.")
]

After = Annotated[str | None, Field(max_length=1000, description="`next` of the previous page.")]

Archived = Annotated[
    bool | None, Field(description="True: only archived jobs; false: only others.")
]

FurtherRuns = Annotated[
    list[JobIdText],
    Field(max_length=31, description="Further runs of the same problem, with other seeds."),
]


class Query(BaseModel):
    """Parameters of a GET."""

    model_config = ConfigDict(frozen=True)


def full_view(service: JobService, job: Job) -> JobView:
    """Return the view of a job with its best design."""
    has_best = job.progress.best_fitness is not None
    return JobView.from_job_and_best(job, service.store.best(job.id) if has_best else None)


# Core: submit a job, follow it, control it, and get the best design.


@_operation("POST /jobs", "core", "Submit a job", 409, access="submit", status=202)
def submit_job(
    service: JobService,
    spec: AnySpec,
    *,
    idempotency_key: str | None = None,
    priority: int = 0,
    notify_url: str | None = None,
) -> JobView:
    """Check that the job can be simulated and queue it.

    Returns at once; a runner starts the job when it has capacity. With an `Idempotency-Key` that
    was used before, the same body returns the existing job with 200, even if presets have changed
    since; a body for another job returns 409.
    """
    job, _ = service.submit(
        spec, idempotency_key=idempotency_key, priority=priority, notify_url=notify_url
    )
    return full_view(service, job)


class JobsQuery(Query):
    """Criteria and order of a list of jobs."""

    state: JobState | None = Field(default=None, description="Only jobs in this state.")
    kind: JobKind | None = Field(default=None, description="Only jobs of this kind.")
    parent: Annotated[JobIdText | None, Field(description="Only forks of the job of this id.")] = (
        None
    )
    search: str = Field(
        default="",
        max_length=200,
        description="Only jobs whose name, id, note or tags contain this, ignoring case.",
    )
    order: JobOrder = Field(
        default=JobOrder.CREATED,
        description="`created`: newest first; `fitness`: best first; `name`: by name, ignoring"
        " case; `state`: unfinished jobs first; `evaluations`, `iterations`, `priority`,"
        " `rate`: largest first; `gain` over the `reference`: largest first; `time_left`:"
        " shortest first. Jobs without the value come last.",
    )
    reverse: bool = Field(
        default=False, description="Reverse the order; jobs without the value still come last."
    )
    robot: str | None = Field(
        default=None,
        max_length=200,
        description="Only jobs of this robot; `own` for all custom robots.",
    )
    controller: str | None = Field(
        default=None, max_length=200, description="Only jobs that tune this controller."
    )
    preference: str | None = Field(
        default=None,
        max_length=200,
        description="Only jobs of this preference; `own` for all custom preferences.",
    )
    tag: str | None = Field(default=None, max_length=200, description="Only jobs with this tag.")
    archived: Archived = None
    after: After = None
    limit: int = Field(default=50, ge=1, le=200, description="Maximum number of jobs.")


@_operation("GET /jobs", "core", "List jobs")
def list_jobs(service: JobService, query: JobsQuery) -> PageView[JobSummaryView]:
    """Return a page of jobs with their progress. New jobs do not shift later pages."""
    page = service.store.jobs(
        state=query.state,
        kind=query.kind,
        parent=query.parent,
        search=query.search,
        where=JobFilter(
            archived=query.archived,
            robot=query.robot,
            controller=query.controller,
            preference=query.preference,
            tag=query.tag,
        ),
        order=query.order,
        reverse=query.reverse,
        after=query.after,
        limit=query.limit,
    )
    items = [JobSummaryView.from_job(job) for job in page.items]
    return PageView[JobSummaryView](items=items, next=page.next)


@_operation("GET /jobs/{job_id}", "core", "Get a job")
def get_job(service: JobService, job_id: str) -> JobView:
    """Return state, progress, rates, estimated time left, best design and error."""
    return full_view(service, service.job(job_id))


@_operation("POST /jobs/{job_id}/pause", "core", "Pause a job", access="command", status=202)
def pause_job(service: JobService, job_id: str, *, actor: str = LOCAL) -> JobView:
    """Pause a job. A running job first commits its current iteration (`pausing`).

    409 if it is already paused or has ended.
    """
    return full_view(service, service.store.command(job_id, Command.PAUSE, actor=actor))


@_operation("POST /jobs/{job_id}/resume", "core", "Resume a job", access="command", status=202)
def resume_job(
    service: JobService,
    job_id: str,
    request: ResumeRequest | None = None,
    *,
    actor: str = LOCAL,
    quota: Quota | None = None,
) -> JobView:
    """Resume a paused or failed job; it continues bit for bit as if it had never stopped.

    If code, robot files or backend differ from the recorded provenance, the job fails and says
    what has changed; the body `{"accept_changes": true}` continues nevertheless. 409 if the job is
    queued, running or has ended.
    """
    accept = request is not None and request.accept_changes
    job = service.store.command(
        job_id, Command.RESUME, accept_changes=accept, actor=actor, quota=quota
    )
    return full_view(service, job)


@_operation("POST /jobs/{job_id}/cancel", "core", "Cancel a job", access="command")
def cancel_job(service: JobService, job_id: str, *, actor: str = LOCAL) -> JobView:
    """End a job for good. Committed iterations stay; the current one is dropped.

    409 if it has ended.
    """
    return full_view(service, service.store.command(job_id, Command.CANCEL, actor=actor))


@_operation(
    "POST /jobs/{job_id}/extend", "core", "Change the budget of a job", access="command", status=202
)
def extend_job(
    service: JobService,
    job_id: str,
    request: ExtensionRequest,
    *,
    actor: str = LOCAL,
    quota: Quota | None = None,
) -> JobView:
    """Change the budget. A job that has succeeded is queued and continues from its last iteration.

    Committed iterations stay, and the current iteration is committed unchanged. Later ones follow
    the schedule of the new budget, over which a falling inertia falls: a job of 25 iterations
    extended to 50 is reproducible, but differs from a job of 50. 409 if the job was cancelled.
    """
    job = service.extend(job_id, request.iterations, actor=actor, quota=quota)
    return full_view(service, job)


class IterationsQuery(Query):
    """A page of iterations."""

    after: AfterIteration = None
    limit: int = Field(default=100, ge=1, le=1000, description="Maximum number of iterations.")


@_operation("GET /jobs/{job_id}/iterations", "core", "List committed iterations")
def list_iterations(
    service: JobService, job_id: str, query: IterationsQuery
) -> PageView[IterationView]:
    """Return a page of iterations with statistics of their fitness, for convergence plots."""
    page = service.store.iterations(job_id, after=query.after, limit=query.limit)
    items = [IterationView.model_validate(iteration) for iteration in page.items]
    return PageView[IterationView](items=items, next=page.next)


@_operation("GET /jobs/{job_id}/best", "core", "Get the best design", 409)
def get_best(service: JobService, job_id: str) -> BestView:
    """Return the design of least fitness so far, with its results in every scenario.

    404 while no design is feasible in every scenario.
    """
    job, best = service.job(job_id), service.store.best(job_id)
    if best is None:
        raise NotFound(
            f"job {job_id} has no feasible design yet; try again after its next iteration, or see"
            " why designs fail by its failures"
        )
    return BestView.from_evaluation(best, job.spec)


class EventsQuery(Query):
    """Where a stream of events begins and ends."""

    after: AfterIteration = None
    follow: bool = Field(
        default=True, description="False: end the stream after the committed iterations."
    )
    limit: int | None = Field(
        default=None,
        ge=1,
        le=LARGEST_INDEX,
        description="End the stream after this many iterations.",
    )


@_operation("GET /jobs/{job_id}/events", "core", "Follow a job")
def stream_events(
    service: JobService,
    job_id: str,
    query: EventsQuery,
    *,
    wait: Callable[[], bool] = lambda: False,
) -> Iterator[IterationView | StateView]:
    """Stream committed iterations as server-sent events.

    An event `iteration` is sent once for each committed iteration, in order; its id is the
    iteration's index, its data an IterationView. An event `state`, without an id, is sent on
    connecting and whenever the job's state or its reason to wait changes; its data is a StateView.
    The stream ends after the event of a final state. A broken stream continues without gap or
    repetition from `Last-Event-ID` (or `after`). Comments keep idle connections alive. The stream
    of a deleted job ends with an event `deleted`, whose data has its `id`. A stopping server sends
    a comment and the field `retry`. With a revoked token the stream ends within seconds.
    """
    after, sent_state, sent = query.after, None, 0
    while True:
        # The job is read first: the iterations that it counts are then among those read.
        job = service.job(job_id)
        for iteration in committed(service, job_id, after):
            after = iteration.index
            yield iteration
            sent += 1
            if sent == query.limit:
                return
        if (job.state, job.waiting) != sent_state:
            sent_state = (job.state, job.waiting)
            yield StateView.from_job(job)
        if job.state.terminal:
            service.store.verify()
            return
        if not query.follow or not wait():
            return


def committed(service: JobService, job_id: str, after: int | None) -> Iterator[IterationView]:
    """List committed iterations, read by pages."""
    while True:
        page = service.store.iterations(job_id, after=after)
        yield from map(IterationView.model_validate, page.items)
        if page.next is None or not page.items:
            return
        after = page.items[-1].index


# Analysis: evaluations of jobs, and simulations of single designs.


@_operation(
    "GET /jobs/{job_id}/iterations/{iteration}/evaluations",
    "analysis",
    "List the evaluations of an iteration",
    409,
)
def list_evaluations(
    service: JobService, job_id: str, iteration: int
) -> CatalogueView[EvaluationView]:
    """Return every design with its values, its fitness, and its results in each scenario.

    Objectives are raw; utilities follow from them and the job's preference.
    """
    spec = service.job(job_id).spec
    return CatalogueView(items=evaluation_views(service.store.evaluations(job_id, iteration), spec))


class ExportQuery(Query):
    """Format of a table."""

    format: TableFormat = Field(default="csv", description="Format of the file.")


@_operation("GET /jobs/{job_id}/export", "analysis", "Download all evaluations", 409)
def export_job(service: JobService, job_id: str, query: ExportQuery) -> Iterator[bytes]:
    """Return one row per design: iteration, particle, fitness, `design.<variable>`, and for every
    scenario `<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`. Floats are
    exact.
    """
    job = service.job(job_id)
    return encoded_table(query.format, job.spec, service.column_pieces(job))


@_operation(
    "GET /jobs/{job_id}/evidence",
    "analysis",
    "Download evidence",
    heavy=True,
    content="The archive.",
    media_type=ZIP,
    filename="{job_id}.zip",
)
def get_evidence(service: JobService, job_id: str) -> bytes:
    """Return an archive that documents the run: spec, robot, provenance, every evaluation, finished
    certificates of its designs, figures, and a page for offline use. `gaitswarm verify` checks it
    anywhere. 409 before the first iteration.
    """
    from gaitswarm.evidence.contents import evidence

    return evidence(service, job_id)


@_operation(
    "POST /jobs/{job_id}/verify", "analysis", "Verify the stored history", reads=True, heavy=True
)
def verify_history(
    service: JobService, job_id: str, request: VerificationRequest, *, limits: Limits = UNLIMITED
) -> HistoryVerificationView:
    """Recompute the digests of a job's iterations and report the first that differs.

    With `head`, report whether a digest noted earlier is among them. With `replay`, simulate that
    number of evaluations again and compare every bit; their simulated time is limited.
    """
    from gaitswarm.evidence.verify import run_verification

    return run_verification(service, job_id, request, check=limits.check_repeated)


class DistributionQuery(Query):
    """A page of the distribution."""

    after: AfterIteration = None
    limit: int = Field(default=1000, ge=1, le=10_000, description="Maximum number of iterations.")


@_operation(
    "GET /jobs/{job_id}/distribution",
    "analysis",
    "Get the distribution of designs",
    heavy=True,
    page=True,
)
def get_distribution(
    service: JobService, job_id: str, query: DistributionQuery
) -> DistributionView:
    """Return quantiles of the fitness and the diversity of the designs by iteration."""
    return service.distribution(job_id, after=query.after, limit=query.limit)


class ParticlesQuery(Query):
    """Designs to return as columns."""

    after_iteration: AfterIteration = None
    max_points: int = Field(
        default=100_000,
        ge=1,
        le=1_000_000,
        description="Maximum number of designs; more are thinned evenly over the iterations,"
        " and the best is kept.",
    )
    objectives: bool = Field(
        default=False,
        description="Whether to add f1 to f5, each as its geometric mean over the scenarios;"
        " only for jobs that tune a drive.",
    )


@_operation(
    "GET /jobs/{job_id}/particles",
    "analysis",
    "Get all designs as binary columns",
    heavy=True,
    page=True,
    content="Length of the header (uint32), header (JSON, padded with spaces), then every column's"
    " numbers (float32), all little-endian.",
)
def get_particles(service: JobService, job_id: str, query: ParticlesQuery) -> bytes:
    """Return one row per design, by column: iteration, particle, fitness, the searched variables,
    and the utility in each scenario; NaN where undefined.

    The header is a ParticlesHeaderView: it names the columns in order, with units and bounds.
    """
    return service.particles(
        job_id, after=query.after_iteration, most=query.max_points, objectives=query.objectives
    )


@_operation(
    "POST /jobs/{job_id}/ranking",
    "analysis",
    "Rank designs under another preference",
    reads=True,
    heavy=True,
)
def rank_designs(service: JobService, job_id: str, request: RankingRequest) -> RankingView:
    """Rank all designs of a job by their stored objectives; nothing is simulated.

    For jobs that tune a drive; a job that identifies parameters has no preference.
    """
    return service.ranking(job_id, request)


class ScenariosQuery(Query):
    """Tolerance of a smallest family."""

    tolerance: float = Field(
        default=TOLERANCE,
        ge=0.0,
        allow_inf_nan=False,
        description="Largest regret of a smallest family [1].",
    )


@_operation(
    "GET /jobs/{job_id}/scenarios", "analysis", "Get the importance of scenarios", heavy=True
)
def get_scenario_families(
    service: JobService, job_id: str, query: ScenariosQuery
) -> ScenarioFamiliesView:
    """Return the best designs that a job would have had with fewer scenarios: without each of them,
    and for families of every size. From stored objectives; nothing is simulated.
    """
    return service.scenarios(job_id, tolerance=query.tolerance)


@_operation("GET /jobs/{job_id}/failures", "analysis", "Get the failures of designs", heavy=True)
def get_failures(service: JobService, job_id: str) -> FailuresView:
    """Count failed designs by case and status, each with a design to replay, most failures first.

    From stored statuses; nothing is simulated. For jobs of every kind.
    """
    return service.failures(job_id)


@_operation(
    "GET /jobs/{job_id}/importance", "analysis", "Get the importance of variables", heavy=True
)
def get_importance(service: JobService, job_id: str) -> ImportanceView:
    """Return first-order Sobol' indices of every variable for the fitness, each objective and
    failure, among the evaluated designs; and whether the best design lies at a bound.

    From stored objectives; nothing is simulated.
    """
    return service.importance(job_id)


class FrontQuery(Query):
    """Size of a list of the front."""

    most: int = Field(
        default=FRONT_DESIGNS,
        ge=1,
        le=MOST_FRONT_DESIGNS,
        description="Maximum number of designs; of more, marked designs and others that cover"
        " the front evenly.",
    )


@_operation("GET /jobs/{job_id}/front", "analysis", "Get the Pareto front", heavy=True)
def get_front(service: JobService, job_id: str, query: FrontQuery) -> FrontView:
    """Return the Pareto front over f1 to f5: nondominated designs, its knees, the best in each
    objective and under A, B and C, and its hypervolume by iteration.

    From stored objectives; nothing is simulated. For any job that tunes a drive.
    """
    return service.front(job_id, most=query.most)


class DesignQuery(Query):
    """A design of a job."""

    iteration: Index = Field(description="Iteration of the design, from 0.")
    particle: Index = Field(description="Number of the design in its iteration, from 0.")


@_operation(
    "GET /jobs/{job_id}/preference-for", "analysis", "Find a preference for a design", heavy=True
)
def get_preference_for(service: JobService, job_id: str, query: DesignQuery) -> PreferenceForView:
    """Return biases and exponents under which a design is the best of its job, if there are any.

    409 for a design that fails in a scenario.
    """
    return service.preference_for(job_id, query.iteration, query.particle)


@_operation(
    "POST /jobs/{job_id}/preferences",
    "analysis",
    "Rank designs under many preferences",
    reads=True,
    heavy=True,
)
def find_robust_preferences(
    service: JobService, job_id: str, request: PreferencesRequest, *, limits: Limits = UNLIMITED
) -> RobustPreferencesView:
    """Rank a job's designs under A, B, C and random preferences, and list the winners.

    From stored objectives. With `samples`, that number of designs is simulated around each winner
    to estimate its robustness index (thesis 4.4.3), and the most robust comes first. The number of
    ranked designs and the simulated time are limited.
    """
    limits.check_ranked(request.drawn, service.job(job_id))
    index = partial(sampled_indices, check=limits.check_sampled)
    return service.preferences(job_id, request, index)


@_operation(
    "GET /jobs/{job_id}/reference",
    "analysis",
    "Compare a job's best with the published or the start design",
    heavy=True,
    page=True,
)
def get_reference(service: JobService, job_id: str) -> JobReferenceView:
    """Compare the best design so far with a reference in the job's scenarios: the published design
    of its controller and preference, or for custom robots the middle of the bounds.

    The reference is simulated once and stored with the job; job lists include it from then on.
    """
    return service.reference(job_id)


class ComparisonQuery(Query):
    """Jobs to compare with."""

    also: Annotated[
        list[JobIdText], Field(max_length=MOST_JOBS - 1, description="Further jobs, each once.")
    ] = []


@_operation("GET /jobs/{job_id}/comparison", "analysis", "Compare jobs", heavy=True)
def compare_jobs(service: JobService, job_id: str, query: ComparisonQuery) -> JobComparisonView:
    """Compare the convergence of jobs by iterations, evaluations and time, the distribution of
    fitness of their designs, and their specs.
    """
    return service.comparison([job_id, *query.also])


class ConvergencesQuery(Query):
    """Jobs to list the convergence of."""

    job: list[JobIdText] = Field(min_length=1, max_length=200, description="Job ids.")
    points: int = Field(
        default=24, ge=2, le=100, description="Maximum number of iterations per job."
    )


@_operation(
    "GET /job-convergences", "analysis", "Get short convergences of jobs", heavy=True, page=True
)
def list_convergences(service: JobService, query: ConvergencesQuery) -> ConvergencesView:
    """Return the best fitness over the iterations of several jobs, for sparklines in lists."""
    return service.convergences(query.job, query.points)


class CertificateQuery(Query):
    """Worlds of a certificate."""

    worlds: int | None = Field(
        default=None, ge=1, le=1_000_000, description="Number of worlds, from the first."
    )
    most: int = Field(default=5, ge=0, le=MOST_WORST, description="Number of worst worlds to list.")


@_operation(
    "GET /jobs/{job_id}/certificate",
    "analysis",
    "Get the results of a design in many worlds",
    heavy=True,
)
def get_certificate(service: JobService, job_id: str, query: CertificateQuery) -> CertificateView:
    """Return failure rate, worst results and their worlds for a job of kind `certificate`.

    From the worlds simulated so far. The `replay` of a world is a command; its `values` are the
    `world` of POST /v1/replays.
    """
    return service.certificate(job_id, worlds=query.worlds, most=query.most)


class TargetsQuery(Query):
    """Runs of a calibration."""

    also: FurtherRuns = []
    leave_out: LeaveOut | None = Field(
        default=None,
        description="Predict every target by the best design without that `target`, or without"
        " all targets of its `walk`. Nothing is simulated.",
    )


@_operation(
    "GET /jobs/{job_id}/targets",
    "analysis",
    "Get the deviations of a calibration from its targets",
    heavy=True,
)
def get_targets(service: JobService, job_id: str, query: TargetsQuery) -> TargetsView:
    """Return the values of every target for the best design of all runs of a `calibration`.

    Differences are in units of the tolerance. `/parameters` has the best fitness of each choice of
    a categorical variable.
    """
    return service.targets([job_id, *query.also], query.leave_out)


class RunsQuery(Query):
    """Runs of one problem."""

    also: FurtherRuns = []


@_operation(
    "GET /jobs/{job_id}/parameters", "analysis", "Get the identifiability of parameters", heavy=True
)
def get_parameters(service: JobService, job_id: str, query: RunsQuery) -> IdentifiabilityView:
    """Return the interval of every variable among designs within twelve thresholds of the best.

    Mainly for jobs of kind `identification`. A single run always narrows; only runs with different
    seeds that narrow to the same values show that a parameter is identifiable.
    """
    return service.parameters([job_id, *query.also])


@_operation("POST /estimates", "analysis", "Estimate a job", reads=True, heavy=True)
def estimate_job(service: JobService, spec: AnySpec) -> EstimateView:
    """Check a job as on submission, and estimate its cost. Nothing is stored.

    The time follows from the rate of earlier jobs with the same robot and controller; if there are
    none, a short simulation is timed on the server, which may have to compile the robot's kernel.
    """
    return EstimateView.model_validate(service.estimate(spec))


@_operation("POST /simulations", "analysis", "Simulate one design", reads=True, heavy=True)
def simulate(
    _service: JobService, design: SimulationRequest, *, limits: Limits = UNLIMITED
) -> SimulationView:
    """Simulate one design in the given scenarios and return objectives, utilities and fitness.

    Nothing is stored. The simulated time is limited, as the response waits for the simulations;
    use a job to search.
    """
    seconds = design.simulated_seconds(design.resolved_scenarios())
    limits.check(seconds, logged=design.log, field="scenarios")
    return run_simulation(design)


@_operation(
    "POST /robustness", "analysis", "Estimate the robustness of one design", reads=True, heavy=True
)
def estimate_robustness(
    _service: JobService, design: RobustnessRequest, *, limits: Limits = UNLIMITED
) -> RobustnessView:
    """Simulate a design and others around it, and estimate the norm of the Jacobian of the
    objectives with respect to the variables, both normalized (thesis 4.4.3).

    Nothing is stored. The simulated time is limited, as the response waits for the simulations.
    """
    seconds = design.simulated_seconds(design.resolved_scenarios())
    limits.check_sampled(seconds * (1 + design.samples))
    return run_robustness(design)


@_operation(
    "POST /replays",
    "analysis",
    "Replay one simulation",
    reads=True,
    heavy=True,
    content="Length of the header in bytes (uint32), the header (JSON, a ReplayHeaderView, padded"
    " with spaces to a multiple of 4), then frame after frame of float32 numbers in the order of"
    " the header's channels; all little-endian.",
)
def replay(_service: JobService, design: ReplayRequest, *, limits: Limits = UNLIMITED) -> bytes:
    """Simulate one design in one scenario and return the pose of every link, frame by frame.

    A failed simulation is replayed up to its end, with its status in the header. Nothing is stored;
    the simulated time is limited as for simulations with logs.
    """
    seconds = design.simulated_seconds([resolved(design.scenario)])
    limits.check(seconds, logged=True, field="scenario")
    return run_replay(design)


@_operation(
    "POST /controllers/{controller}/surface",
    "analysis",
    "Get a fuzzy controller's surface",
    reads=True,
    heavy=True,
)
def controller_surface(
    _service: JobService, controller: str, request: SurfaceRequest
) -> SurfaceView:
    """Return the output over angle error and motor current: by the rules, and by the lookup table.

    Sets and rules are those of the thesis; the microcontroller uses the table instead of inference.
    """
    if controller not in CONTROLLERS:
        raise NotFound(CONTROLLERS.unknown(controller))
    return run_surface(controller, request)


class FirmwareQuery(Query):
    """Table of a firmware."""

    table_bits: str | None = Field(
        default=None,
        pattern=r"^[0-9]{1,2}x[0-9]{1,2}$",
        description="Bits of the indices of a fuzzy table, for angle error and current; default"
        " 10x6. The simulations use this table.",
        examples=["8x6"],
    )


@_operation(
    "GET /jobs/{job_id}/firmware",
    "analysis",
    "Download the best design as firmware",
    heavy=True,
    content="The folder, as an archive.",
    media_type=ZIP,
    filename="{job_id}-firmware.zip",
    cached=True,
)
def get_firmware(
    service: JobService, job_id: str, query: FirmwareQuery, *, limits: Limits = UNLIMITED
) -> bytes:
    """Return the best design of a job that tunes a drive as C99 for a leg's microcontroller.

    The archive has the files of `gaitswarm firmware` and is identical every time; unpack it and run
    `make test`. The simulated time is limited, as the response waits for a simulation of every
    scenario. 404 while no design is feasible in every scenario.
    """
    return zipped(run_firmware(_firmware_of_best(service, job_id, query, limits)).files)


@_operation(
    "GET /jobs/{job_id}/firmware/summary",
    "analysis",
    "Summarize the best design's firmware",
    heavy=True,
    page=True,
)
def get_firmware_summary(
    service: JobService, job_id: str, query: FirmwareQuery, *, limits: Limits = UNLIMITED
) -> FirmwareView:
    """Return files with sizes, tables, trajectories by scenario, and flash and RAM compared with
    the thesis's microcontroller, as `gaitswarm firmware --json`.
    """
    request = _firmware_of_best(service, job_id, query, limits)
    return firmware_view(request, run_firmware(request))


def _firmware_of_best(
    service: JobService, job_id: str, query: FirmwareQuery, limits: Limits
) -> FirmwareRequest:
    job, best = service.job(job_id), service.store.best(job_id)
    view = None if best is None else BestView.from_evaluation(best, job.spec)
    bits = None if query.table_bits is None else parsed_table_bits(query.table_bits)
    request = firmware_request_of_best(job.id, job.spec, view, {"table_bits": bits})
    limits.check(request.walked_seconds, field="scenarios")
    return request


@_operation(
    "POST /firmware",
    "analysis",
    "Download one design as firmware",
    reads=True,
    heavy=True,
    content="The folder, as an archive.",
    media_type=ZIP,
    filename="firmware.zip",
)
def write_firmware(
    _service: JobService, request: FirmwareRequest, *, limits: Limits = UNLIMITED
) -> bytes:
    """Return any design as C99 for a leg's microcontroller, with a test of its simulations.

    Nothing is stored. The simulated time is limited, as the response waits for the simulations.
    """
    limits.check(request.walked_seconds, field="scenarios")
    return zipped(run_firmware(request).files)


@_operation(
    "POST /firmware/summary", "analysis", "Summarize a design's firmware", reads=True, heavy=True
)
def summarize_firmware(
    _service: JobService, request: FirmwareRequest, *, limits: Limits = UNLIMITED
) -> FirmwareView:
    """Return files with sizes, tables, trajectories by scenario, and flash and RAM compared with
    the thesis's microcontroller. Nothing is stored.
    """
    limits.check(request.walked_seconds, field="scenarios")
    return firmware_view(request, run_firmware(request))


# Robots, measured walks, and the options of jobs and simulations.


@_operation("GET /robots", "robots", "List robots")
def list_robots(_service: JobService) -> CatalogueView[RobotView]:
    """Return shipped robots. A job names one, defines a variant of one, or has files of its own."""
    return CatalogueView(items=robot_views())


@_operation("GET /scenarios", "robots", "List preset scenarios")
def list_scenarios(_service: JobService) -> CatalogueView[ScenarioView]:
    """Return the six scenarios of thesis table 4.2; a job names them or defines its own."""
    return CatalogueView(items=scenario_views())


@_operation("GET /preferences", "robots", "List preferences")
def list_preferences(_service: JobService) -> CatalogueView[PreferenceView]:
    """Return biases and exponents that weight the objectives (thesis table 4.5, eq. 3.1)."""
    return CatalogueView(items=preference_views())


@_operation("GET /optimizers", "robots", "List optimizers")
def list_optimizers(_service: JobService) -> CatalogueView[OptimizerView]:
    """Return search methods with their settings, by the names that jobs use."""
    return CatalogueView(items=optimizer_views())


@_operation("GET /controllers", "robots", "List controllers")
def list_controllers(_service: JobService) -> CatalogueView[ControllerView]:
    """Return motor controllers with design variables, bounds, units and published designs."""
    return CatalogueView(items=controller_views())


@_operation("GET /cases", "robots", "List cases of plug-ins")
def list_cases(_service: JobService) -> CatalogueView[CaseView]:
    """Return cases of installed plug-ins, which evaluate designs in place of the simulator."""
    return CatalogueView(items=case_views())


@_operation("GET /plugins", "robots", "List plug-ins")
def list_plugins(_service: JobService) -> CatalogueView[PluginView]:
    """Return controllers, cases and search methods that installed packages add."""
    return CatalogueView(items=plugin_views())


@_operation("POST /robots/drafts", "robots", "Draft a robot from a URDF", reads=True, heavy=True)
def draft_robot(_service: JobService, request: RobotDraftRequest) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two scenarios, as `gaitswarm robot init`.

    The response's `toml` and `urdf` are the `robot` of jobs, simulations and replays; its `job` has
    the required fields of a job. Motors, gears and battery are guesses to start from. Nothing is
    stored.
    """
    return run_robot_draft(request)


@_operation("POST /robots/checks", "robots", "Check a custom robot", reads=True, heavy=True)
def check_robot(_service: JobService, robot: RobotFiles) -> RobotCheckView:
    """Load a robot and let it stand for a second with all joints held, as `gaitswarm robot check`.

    Returns masses, reach, loads of the soles, and warnings about implausible bodies. Meshes are not
    looked up, so `meshes` is empty. Nothing is stored.
    """
    return checked_robot(robot, folder=None, field="")


@_operation("GET /robots/{digest}/meshes", "robots", "List the meshes of a robot", page=True)
def list_meshes(
    _service: JobService, digest: str, *, folders: Sequence[Path] = ()
) -> CatalogueView[MeshFileView]:
    """Return the meshes that the robot's URDF names, and which of them are available.

    Empty for a robot that is in none of the folders of GAITSWARM_ROBOTS. Simulations need no
    meshes.
    """
    meshes = MeshLibrary(folders).of(digest)
    return CatalogueView(
        items=[MeshFileView.from_mesh(digest, k, mesh) for k, mesh in enumerate(meshes)]
    )


@_operation(
    "GET /robots/{digest}/meshes/{number}",
    "robots",
    "Get a mesh",
    page=True,
    content="The file, in the format given by the list.",
    cached=True,
)
def get_mesh(
    _service: JobService, digest: str, number: int, *, folders: Sequence[Path] = ()
) -> bytes:
    """Return the file of a mesh, with the ETag of its content.

    Only files of at most 32 MiB that the robot's URDF names, in the robot's folder or in the
    package that the URDF names.
    """
    return MeshLibrary(folders).content(digest, number)


@_operation(
    "POST /recordings",
    "robots",
    "Add a recording",
    access="submit",
    status=201,
    location=lambda recording: f"/recordings/{recording.id}",
)
def add_recording(service: JobService, walk: RecordedWalk, *, actor: str = LOCAL) -> RecordingView:
    """Store motor currents of a measured walk, for jobs of kind `identification`.

    The id is a hash of the content: the same walk yields the same recording. `gaitswarm record` and
    POST /v1/measured-walks make a recording from a measured log.
    """
    return RecordingView.from_walk(service.store.add_recording(walk, actor=actor), walk)


class RecordingsQuery(Query):
    """Criteria of a list of recordings."""

    search: str = Field(
        default="",
        max_length=200,
        description="Only recordings whose id, scenario or controller contain this, ignoring case.",
    )
    after: After = None
    limit: int = Field(default=50, ge=1, le=200, description="Maximum number of recordings.")


@_operation("GET /recordings", "robots", "List recordings")
def list_recordings(service: JobService, query: RecordingsQuery) -> PageView[RecordingEntryView]:
    """Return a page of recordings without their numbers, newest first. New ones do not shift later
    pages.

    Every token with read access sees all of them, as with jobs.
    """
    page = service.store.recording_list(search=query.search, after=query.after, limit=query.limit)
    items = [RecordingEntryView.from_entry(entry) for entry in page.items]
    return PageView[RecordingEntryView](items=items, next=page.next)


@_operation(
    "POST /measured-walks",
    "robots",
    "Make a recording from a measured log",
    heavy=True,
    access="submit",
    status=201,
    location=lambda measured: f"/recordings/{measured.recording.id}",
)
def record_measured_walk(
    service: JobService,
    request: MeasuredWalkRequest,
    *,
    limits: Limits = UNLIMITED,
    actor: str = LOCAL,
) -> MeasuredWalkView:
    """Read a log of the robot's instruments and store a recording of it.

    The walk is simulated to find the lag of the log; the recording has the measured currents of the
    whole cycles that both share. The log itself is not stored. Bodies may be larger than elsewhere
    (GAITSWARM_API_MAX_LOG_BYTES).
    """
    seconds = request.simulated_seconds([resolved(request.scenario)])
    limits.check(seconds, logged=True, field="scenario")
    measured = read_measured_walk(request)
    return measured.view(service.store.add_recording(measured.walk, actor=actor))


@_operation("GET /recordings/{recording_id}", "robots", "Get a recording", 409)
def get_recording(service: JobService, recording_id: str) -> RecordedWalk:
    """Return the whole recording with its numbers."""
    return service.recording(recording_id)


@_operation(
    "GET /recordings/{recording_id}/summary",
    "robots",
    "Get a recording without its numbers",
    409,
    page=True,
)
def get_recording_summary(service: JobService, recording_id: str) -> RecordingView:
    """Return scenario, duration and mean current, as POST /v1/recordings did."""
    return RecordingView.from_walk(recording_id, service.recording(recording_id))


# Operations: everything else about jobs, and the server.


@_operation(
    "POST /jobs/{job_id}/fork", "operations", "Fork a job", heavy=True, access="submit", status=202
)
def fork_job(
    service: JobService,
    job_id: str,
    fork: ForkRequest,
    *,
    idempotency_key: str | None = None,
    priority: int = 0,
    notify_url: str | None = None,
) -> JobView:
    """Queue a job that starts from iterations of this one, which stays unchanged.

    With the same settings the fork continues bit for bit. Under another preference the stored
    objectives are judged again and passed to the search if its method supports that; otherwise, and
    with another optimizer, robot or other scenarios, a new search starts from the best designs. The
    fork's `lineage` says which, and why. 409 if the search cannot be continued, or if its
    provenance has changed and the request does not accept that.
    """
    job, _ = service.fork(
        job_id, fork, idempotency_key=idempotency_key, priority=priority, notify_url=notify_url
    )
    return full_view(service, job)


@_operation(
    "PATCH /jobs/{job_id}",
    "operations",
    "Change name, note, tags or archival of a job",
    access="command",
)
def label_job(
    service: JobService, job_id: str, change: LabelsChange, *, actor: str = LOCAL
) -> JobView:
    """Apply a JSON merge patch to the labels of a job. Its spec and results do not change."""
    return full_view(service, service.store.label(job_id, change, actor=actor))


@_operation(
    "PUT /jobs/{job_id}/priority", "operations", "Change the priority of a job", access="command"
)
def prioritize_job(
    service: JobService,
    job_id: str,
    request: PriorityRequest,
    *,
    actor: str = LOCAL,
    check_priority: Callable[[int], None] = lambda _: None,
) -> JobView:
    """Queued jobs start in order of priority, the oldest first among equals. Each step doubles a
    running job's share of the workers, from its next iteration on; no job is interrupted.

    Results do not depend on it. Values above 0 require a token of scope `admin`, where tokens are
    required. 409 if the job has ended.
    """
    check_priority(request.priority)
    return full_view(service, service.prioritize(job_id, request.priority, actor=actor))


@_operation(
    "PUT /jobs/{job_id}/keep", "operations", "Protect a job from deletion", access="command"
)
def keep_job(service: JobService, job_id: str, *, actor: str = LOCAL) -> JobView:
    """Protect a job from deletion by users and by retention."""
    return full_view(service, service.store.keep(job_id, kept=True, actor=actor))


@_operation(
    "DELETE /jobs/{job_id}/keep", "operations", "End the protection of a job", access="command"
)
def release_job(service: JobService, job_id: str, *, actor: str = LOCAL) -> JobView:
    """Allow deletion again; a server with a retention time deletes the job when that has passed."""
    return full_view(service, service.store.keep(job_id, kept=False, actor=actor))


@_operation("DELETE /jobs/{job_id}", "operations", "Delete a job", access="command", status=204)
def delete_job(service: JobService, job_id: str, *, actor: str = LOCAL) -> None:
    """Delete a job with its iterations and evaluations, irrevocably.

    Forks and certificates of its designs stay. Its idempotency key can be used again, and streams
    of its events end with an event `deleted`. 409 for a job that is protected, or has neither ended
    nor is paused; cancel it first.
    """
    service.store.delete_job(job_id, actor=actor)


class FacetsQuery(Query):
    """Jobs to count."""

    archived: Archived = None


@_operation("GET /job-facets", "operations", "Count jobs by facet", page=True)
def count_jobs(service: JobService, query: FacetsQuery) -> JobFacetsView:
    """Count jobs by state, robot, controller, preference and tag."""
    return JobFacetsView.model_validate(service.store.facets(archived=query.archived))


class ActivityQuery(Query):
    """Messages of a job's log."""

    level: Level = Field(default="INFO", description="Least severe level of messages.")


@_operation(
    "GET /jobs/{job_id}/activity", "operations", "Get the activity of a job's workers", page=True
)
def get_activity(
    service: JobService, job_id: str, query: ActivityQuery, *, activities: Activity | None = None
) -> ActivityView:
    """Return the last iterations and tasks by worker, the workers' health and the log of a job.

    Held in the memory of the process that runs the job, and bounded; `reason` explains an empty
    answer.
    """
    service.job(job_id)
    known = None if activities is None else activities.of(job_id)
    return ActivityView.from_activity(job_id, known, query.level, runs_jobs=activities is not None)


@_operation("GET /jobs/{job_id}/notifications", "operations", "List notifications of a job's end")
def list_notifications(service: JobService, job_id: str) -> list[NotificationView]:
    """Return one notification for each time that a job with a `Notify-URL` ended."""
    notifications = service.store.outbox.about(job_id)
    return [NotificationView.from_notification(notification) for notification in notifications]


class AuditQuery(Query):
    """Criteria of the audit log."""

    job_id: Annotated[
        JobIdText | None, Field(description="Only changes of the job of this id.")
    ] = None
    after: After = None
    limit: int = Field(default=50, ge=1, le=200, description="Maximum number of entries.")


@_operation("GET /audit", "operations", "Read the audit log", access="admin")
def read_audit(service: JobService, query: AuditQuery) -> PageView[AuditEntryView]:
    """Return changes to jobs and tokens, newest first.

    Requires a token of scope `admin`, where tokens are required.
    """
    page = service.store.audit(job_id=query.job_id, after=query.after, limit=query.limit)
    items = [AuditEntryView.model_validate(entry) for entry in page.items]
    return PageView[AuditEntryView](items=items, next=page.next)
