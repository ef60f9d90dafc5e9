import os
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from types import TracebackType
from typing import Self, Unpack

from gaitswarm.firmware import FirmwareOptions, FirmwareView
from gaitswarm.jobs.base import JobEvent, Jobs, Priority, Runs
from gaitswarm.jobs.operation import Index
from gaitswarm.recordings import RecordingEntryView, RecordingView
from gaitswarm.replay import WalkReplay
from gaitswarm.robustness_index import RobustnessOptions, RobustnessView
from gaitswarm.services.optimizer.analysis.certificate import CertificateView
from gaitswarm.services.optimizer.analysis.comparison import JobComparisonView
from gaitswarm.services.optimizer.analysis.failures import FailuresView
from gaitswarm.services.optimizer.analysis.front import FrontView
from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingView
from gaitswarm.services.optimizer.analysis.scenario_families import ScenarioFamiliesView
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.runtime import EvaluatorKind
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.simulation import SimulationResult
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    RobotInput,
    ScenarioInput,
    SpecInput,
    SpecOptions,
)
from gaitswarm.surface import SurfaceView
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views.history import BestView, HistoryIterationView, IterationView
from gaitswarm.views.job import EstimateView, JobSummaryView, JobView
from gaitswarm.views.verification import HistoryVerificationView

class AsyncJobs:
    def __init__(self, connect: Callable[[], Jobs], url: str) -> None: ...
    @property
    def url(self) -> str: ...
    async def __aenter__(self) -> Self: ...
    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...
    async def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView: ...
    async def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView: ...
    async def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView: ...
    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ...,
        order: JobOrder | str = ...,
        reverse: bool = False,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]: ...
    async def job(self, job_id: str) -> JobView: ...
    async def pause(self, job_id: str) -> JobView: ...
    async def resume(self, job_id: str, *, accept_changes: bool = False) -> JobView: ...
    async def cancel(self, job_id: str) -> JobView: ...
    async def extend(self, job_id: str, iterations: int) -> JobView: ...
    async def prioritize(self, job_id: str, priority: Priority) -> JobView: ...
    async def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView: ...
    async def keep(self, job_id: str, *, kept: bool = True) -> JobView: ...
    async def delete(self, job_id: str) -> None: ...
    def follow(self, job_id: str, *, after: int | None = None) -> AsyncIterator[JobEvent]: ...
    async def wait(self, job_id: str) -> JobView: ...
    async def best(self, job_id: str) -> BestView: ...
    def iterations(
        self, job_id: str, *, after: int | None = None
    ) -> AsyncIterator[IterationView]: ...
    def history(self, job_id: str) -> AsyncIterator[HistoryIterationView]: ...
    async def evaluations(self, job_id: str) -> EvaluationTable: ...
    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView: ...
    async def scenarios(self, job_id: str, *, tolerance: float = ...) -> ScenarioFamiliesView: ...
    async def failures(self, job_id: str) -> FailuresView: ...
    async def importance(self, job_id: str) -> ImportanceView: ...
    async def comparison(self, job_ids: Sequence[str]) -> JobComparisonView: ...
    async def preferences(
        self,
        job_id: str,
        *,
        drawn: int = 512,
        candidates: int = 8,
        samples: int = 0,
        radius: float = 0.02,
        seed: int = 1,
        precision: Precision = "double",
    ) -> RobustPreferencesView: ...
    async def front(self, job_id: str, *, most: int = ...) -> FrontView: ...
    async def preference_for(
        self, job_id: str, iteration: Index, particle: Index
    ) -> PreferenceForView: ...
    async def parameters(self, job_ids: Runs) -> IdentifiabilityView: ...
    async def targets(self, job_ids: Runs, *, leave_out: LeaveOut | None = None) -> TargetsView: ...
    async def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView: ...
    def export(self, job_id: str, file_format: TableFormat = "parquet") -> AsyncIterator[bytes]: ...
    async def evidence(self, job_id: str) -> bytes: ...
    async def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView: ...
    async def record(self, walk: RecordedWalk) -> RecordingView: ...
    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> AsyncIterator[RecordingEntryView]: ...
    async def recording(self, recording_id: str) -> RecordedWalk: ...
    async def simulate(
        self,
        design: Mapping[str, float | str],
        *,
        scenarios: ScenarioInput | Iterable[ScenarioInput] | None = None,
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = ...,
        preference: PreferenceInput = "A",
        precision: Precision = "double",
        world: Mapping[str, float] | None = None,
        log: bool = False,
    ) -> SimulationResult: ...
    async def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView: ...
    async def replay(
        self,
        design: Mapping[str, float | str],
        *,
        scenario: ScenarioInput = "normal-fast",
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = ...,
        world: Mapping[str, float] | None = None,
        rate: float = 50.0,
    ) -> WalkReplay: ...
    async def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView: ...
    async def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView: ...
    async def close(self) -> None: ...

class AsyncDatabaseJobs(AsyncJobs):
    async def run(
        self,
        job_id: str,
        *,
        evaluator: EvaluatorKind | Evaluator = "auto",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
    ) -> JobView: ...
