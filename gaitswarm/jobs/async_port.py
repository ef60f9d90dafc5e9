"""The port for programs with an event loop."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self, Unpack

from gaitswarm.jobs.port import JobEvent
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT

if TYPE_CHECKING:
    from gaitswarm.requests.firmware import FirmwareOptions
    from gaitswarm.requests.robustness import RobustnessOptions
    from gaitswarm.services.optimizer.analysis.front import FrontView
    from gaitswarm.services.optimizer.analysis.preferences import (
        PreferenceForView,
        RobustPreferencesView,
    )
    from gaitswarm.services.optimizer.analysis.targets import LeaveOut
    from gaitswarm.sim.identification.recorded_walk import RecordedWalk
    from gaitswarm.simulation_result import SimulationResult
    from gaitswarm.specs import (
        ForkOptions,
        PreferenceInput,
        RobotInput,
        ScenarioInput,
        SpecInput,
        SpecOptions,
    )
    from gaitswarm.tables import EvaluationTable, TableFormat
    from gaitswarm.views import (
        BestView,
        EstimateView,
        HistoryIterationView,
        IterationView,
        JobSummaryView,
        JobView,
        RankingView,
    )
    from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView, SurfaceView
    from gaitswarm.views.calibration import TargetsView
    from gaitswarm.views.certificate import CertificateView
    from gaitswarm.views.comparison import JobComparisonView
    from gaitswarm.views.firmware import FirmwareView
    from gaitswarm.views.identification import (
        IdentifiabilityView,
        RecordingEntryView,
        RecordingView,
    )
    from gaitswarm.views.replay import WalkReplay
    from gaitswarm.views.robustness import RobustnessView
    from gaitswarm.views.verification import HistoryVerificationView


class AsyncJobs(ABC):
    """`Jobs` for asyncio (`gaitswarm.open_async`, `gaitswarm.connect_async`).

    Methods have the names, arguments, results and errors of `Jobs`, where they are documented; they
    are awaited, or iterated with `async for`.
    """

    @property
    @abstractmethod
    def url(self) -> str:
        """Where the jobs are: the database's file or URL, or the server's URL."""

    @abstractmethod
    async def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Check that a job can be simulated, and queue it."""

    @abstractmethod
    async def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a job that begins with iterations of another one."""

    @abstractmethod
    async def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Say what a job would cost; nothing is stored."""

    @abstractmethod
    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]:
        """List jobs."""

    @abstractmethod
    async def job(self, job_id: str) -> JobView:
        """Look at one job."""

    @abstractmethod
    async def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Pause, resume or cancel a job."""

    async def pause(self, job_id: str) -> JobView:
        """Pause a job when its present iteration is committed."""
        return await self.command(job_id, Command.PAUSE)

    async def resume(self, job_id: str, *, accept_changes: bool = False) -> JobView:
        """Queue a paused or failed job again."""
        return await self.command(job_id, Command.RESUME, accept_changes=accept_changes)

    async def cancel(self, job_id: str) -> JobView:
        """End a job for good; what it has committed stays."""
        return await self.command(job_id, Command.CANCEL)

    @abstractmethod
    async def extend(self, job_id: str, iterations: int) -> JobView:
        """Give a job another budget; one that has succeeded is queued again."""

    @abstractmethod
    async def best(self, job_id: str) -> BestView:
        """Take the best design that a job has found so far."""

    @abstractmethod
    def iterations(self, job_id: str, *, after: int | None = None) -> AsyncIterator[IterationView]:
        """List the committed iterations of a job."""

    @abstractmethod
    def history(self, job_id: str) -> AsyncIterator[HistoryIterationView]:
        """List the committed iterations of a job with every design."""

    @abstractmethod
    async def evaluations(self, job_id: str) -> EvaluationTable:
        """Take every evaluation of a job at once, as arrays."""

    @abstractmethod
    async def prioritize(self, job_id: str, priority: int) -> JobView:
        """Give a job that has not ended another priority."""

    @abstractmethod
    async def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Write on a job what people want to know of it."""

    @abstractmethod
    async def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Protect a job from deletion, or release it."""

    @abstractmethod
    async def delete(self, job_id: str) -> None:
        """Delete a job with its iterations and evaluations; nothing brings them back."""

    @abstractmethod
    def follow(self, job_id: str, *, after: int | None = None) -> AsyncIterator[JobEvent]:
        """Follow a job until it has ended; a paused one is waited for.

        A loop that is left early should close it, as `contextlib.aclosing` does.

        Args:
            job_id: Identifier of the job.
            after: Leave out iterations up to this index, which are known already.

        Returns:
            Each iteration and each state, the one in which it ended last.
        """

    async def wait(self, job_id: str) -> JobView:
        """Wait until a job has ended; a paused one is waited for."""
        job = await self.job(job_id)
        async for _ in self.follow(job_id, after=job.last_iteration):
            pass
        return await self.job(job_id)

    @abstractmethod
    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView:
        """Judge all designs of a job by another preference; no walk is run."""

    @abstractmethod
    async def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """See which scenarios of a job matter, from what is stored."""

    @abstractmethod
    async def importance(self, job_id: str) -> ImportanceView:
        """See which variables of a job matter, from what is stored."""

    @abstractmethod
    async def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Set jobs beside each other, from what is stored."""

    @abstractmethod
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
    ) -> RobustPreferencesView:
        """Find the preference whose winner among a job's designs is the most robust."""

    @abstractmethod
    async def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """See what designs of a job trade."""

    @abstractmethod
    async def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find the preference under which a design wins its job."""

    @abstractmethod
    async def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """See which parameters runs of one problem agree on, so that they can be trusted."""

    @abstractmethod
    async def targets(
        self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None
    ) -> TargetsView:
        """See how near runs of a calibration come to their targets."""

    @abstractmethod
    async def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """See what a design comes to in many worlds."""

    @abstractmethod
    def export(self, job_id: str, file_format: TableFormat = "parquet") -> AsyncIterator[bytes]:
        """Write every evaluation of a job as a file."""

    @abstractmethod
    async def evidence(self, job_id: str) -> bytes:
        """Write one file that proves a job's run, for `gaitswarm.verify`."""

    @abstractmethod
    async def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Check that what is stored of a job is what was committed."""

    @abstractmethod
    async def record(self, walk: RecordedWalk) -> RecordingView:
        """Keep a recorded walk, to which jobs can fit parameters of the robot."""

    @abstractmethod
    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> AsyncIterator[RecordingEntryView]:
        """List recorded walks."""

    @abstractmethod
    async def recording(self, recording_id: str) -> RecordedWalk:
        """Take a recorded walk."""

    @abstractmethod
    async def simulate(
        self,
        design: Mapping[str, float | str],
        *,
        scenarios: ScenarioInput | Iterable[ScenarioInput] | None = None,
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        preference: PreferenceInput = "A",
        precision: Precision = "double",
        world: Mapping[str, float] | None = None,
        log: bool = False,
    ) -> SimulationResult:
        """Let one design walk where the jobs are."""

    @abstractmethod
    async def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Estimate where the jobs are how robust a design is."""

    @abstractmethod
    async def replay(
        self,
        design: Mapping[str, float | str],
        *,
        scenario: ScenarioInput = "normal-fast",
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        world: Mapping[str, float] | None = None,
        rate: float = 50.0,
    ) -> WalkReplay:
        """Let one design walk, to look at it: where every link is, frame by frame."""

    @abstractmethod
    async def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Take the surfaces of a fuzzy controller, by its rules and by its table."""

    @abstractmethod
    async def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Write a design, or a job's best, as C for the robot's microcontrollers."""

    @abstractmethod
    async def close(self) -> None:
        """Release connections. Closing twice does no harm."""

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()
