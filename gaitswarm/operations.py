"""Operations of the REST API that `Jobs` has no method for: most of them for the web page."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from gaitswarm.evidence.archive import zipped
from gaitswarm.firmware import (
    FirmwareRequest,
    FirmwareView,
    TrajectoriesRequest,
    firmware_view,
    run_firmware,
)
from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.jobs.operation import (
    ZIP,
    After,
    AfterIteration,
    Context,
    JobIdText,
    PageLimit,
    analysis,
    operations,
    robots,
)
from gaitswarm.recordings import (
    MeasuredWalkRequest,
    MeasuredWalkView,
    RecordingView,
    read_measured_walk,
)
from gaitswarm.replay import ReplayRequest, run_replay
from gaitswarm.robots import (
    MeshFileView,
    RobotCheckView,
    RobotDraftRequest,
    RobotDraftView,
    mesh_content,
    mesh_views,
    run_robot_draft,
)
from gaitswarm.robots import check_robot as checked_robot
from gaitswarm.services.optimizer.analysis.comparison import ConvergencesView, convergence
from gaitswarm.services.optimizer.analysis.distribution import DistributionView, encoded_particles
from gaitswarm.services.optimizer.analysis.distribution import distribution as spread
from gaitswarm.services.optimizer.analysis.robustness import RobustnessRequest, RobustnessView
from gaitswarm.services.optimizer.analysis.surface import SurfaceRequest, SurfaceView, run_surface
from gaitswarm.services.optimizer.analysis.utilities import tuning_spec
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.audit import AuditEntryView
from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.labels import JobFacetsView
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import PageView
from gaitswarm.sim.catalogue import design_numbers
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.firmware.folder import parsed_table_bits
from gaitswarm.sim.gait.setpoints import trajectory_files
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.sim.scenario import find_scenario
from gaitswarm.simulation import SimulationView, run_robustness, run_simulation
from gaitswarm.views.catalogue import (
    CaseView,
    CatalogueView,
    ControllerView,
    OptimizerView,
    PreferenceView,
    RobotView,
    ScenarioView,
    case_views,
    controller_views,
    optimizers,
    preference_views,
    robot_views,
    scenario_views,
)
from gaitswarm.views.operations import ActivityView, Level, NotificationView

TableBits = Annotated[str | None, Field(pattern=r"^[0-9]{1,2}x[0-9]{1,2}$", examples=["8x6"])]


class ServedJobs(DatabaseJobs):
    """Jobs in a database, for one request to a server."""

    def __init__(self, service: JobService, context: Context) -> None:
        super().__init__(service, "")
        self._context = context

    @analysis(
        "GET /jobs/{job_id}/distribution",
        "get_distribution",
        "Get the distribution of designs",
        page=True,
    )
    def distribution(
        self,
        job_id: str,
        *,
        after: AfterIteration = None,
        limit: Annotated[int, Field(ge=1, le=10_000)] = 1000,
    ) -> DistributionView:
        """Return quantiles of the fitness and the diversity of the designs by iteration.

        Args:
            limit: Maximum number of iterations.
        """
        job = self._service.job(job_id)
        columns = self._service.columns(job).after(after)
        return spread(columns, job.spec.design_space(), limit=limit)

    @analysis(
        "GET /jobs/{job_id}/particles",
        "get_particles",
        "Get all designs as binary columns",
        page=True,
    )
    def particles(
        self,
        job_id: str,
        *,
        after_iteration: AfterIteration = None,
        max_points: Annotated[int, Field(ge=1, le=1_000_000)] = 100_000,
        objectives: bool = False,
    ) -> bytes:
        """Return one row per design, by column: iteration, particle, fitness, the searched
        variables, and the utility in each scenario; NaN where undefined.

        The header is a ParticlesHeaderView: it names the columns in order, with units and bounds.

        Args:
            max_points: Maximum number of designs; more are thinned evenly over the iterations, and
                the best is kept.
            objectives: Whether to add f1 to f5, each as its geometric mean over the scenarios; only
                for jobs that tune a drive.

        Returns:
            Length of the header (uint32), header (JSON, padded with spaces), then every column's
            numbers (float32), all little-endian.
        """
        job = self._service.job(job_id)
        columns = self._service.columns(job).after(after_iteration)
        return encoded_particles(job, columns, most=max_points, objectives=objectives)

    @analysis(
        "GET /job-convergences", "list_convergences", "Get short convergences of jobs", page=True
    )
    def convergences(
        self,
        *,
        job: Annotated[list[JobIdText], Field(min_length=1, max_length=200)],
        points: Annotated[int, Field(ge=2, le=100)] = 24,
    ) -> ConvergencesView:
        """Return the best fitness over the iterations of several jobs, for sparklines in lists.

        Args:
            job: Job ids.
            points: Maximum number of iterations per job.
        """
        views = []
        for job_id in job:
            # Jobs that were deleted meanwhile are left out.
            with suppress(NotFound):
                views.append(convergence(self._service.store, job_id, points))
        return ConvergencesView(items=views)

    @analysis(
        "GET /jobs/{job_id}/firmware",
        "get_firmware",
        "Download the best design as firmware",
        media_type=ZIP,
        filename="{job_id}-firmware.zip",
        cached=True,
    )
    def firmware(self, job_id: str, *, table_bits: TableBits = None) -> bytes:
        """Return the best design of a job that tunes a drive as C99 for a leg's microcontroller.

        The archive has the files of `gaitswarm firmware` and is identical every time; unpack it and
        run `make test`. The simulated time is limited, as the response waits for a simulation of
        every scenario.

        Args:
            table_bits: Bits of the indices of a fuzzy table, for angle error and current; default
                10x6. The simulations use this table.

        Returns:
            The folder, as an archive.

        Raises:
            NotFound: No design is feasible in every scenario yet.
        """
        return zipped(run_firmware(self._firmware_of_best(job_id, table_bits)).files)

    @analysis(
        "GET /jobs/{job_id}/firmware/summary",
        "get_firmware_summary",
        "Summarize the best design's firmware",
        page=True,
    )
    def firmware_summary(self, job_id: str, *, table_bits: TableBits = None) -> FirmwareView:
        """Return files with sizes, tables, trajectories by scenario, and flash and RAM compared
        with the thesis's microcontroller, as `gaitswarm firmware --json`.

        Args:
            table_bits: Bits of the indices of a fuzzy table, for angle error and current; default
                10x6. The simulations use this table.
        """
        request = self._firmware_of_best(job_id, table_bits)
        return firmware_view(request, run_firmware(request))

    def _firmware_of_best(self, job_id: str, table_bits: str | None) -> FirmwareRequest:
        bits = None if table_bits is None else parsed_table_bits(table_bits)
        spec, best = self._best(job_id, "firmware")
        label = spec.name or f"job {job_id}"
        request = FirmwareRequest.model_validate(best | {"label": label, "table_bits": bits})
        self._context.limits.check(request.walked_seconds, field="scenarios")
        return request

    @analysis(
        "GET /jobs/{job_id}/trajectories",
        "get_trajectories",
        "Download the best design's joint angles for servos",
        media_type=ZIP,
        filename="{job_id}-trajectories.zip",
        cached=True,
    )
    def trajectories(
        self,
        job_id: str,
        *,
        rate: Annotated[float, Field(ge=1.0, le=500.0)] = 50.0,
        held: bool = True,
    ) -> bytes:
        """Return the desired joint angles of the best design of a job that tunes a drive, as CSV
        and as ROS 2 messages, trajectory_msgs/msg/JointTrajectory.

        The archive has the files of `gaitswarm trajectories`.

        Args:
            rate: Rows a second, changed so that a cycle has a whole number of them [Hz].
            held: Whether held joints have columns as well.

        Returns:
            The folder, as an archive.

        Raises:
            NotFound: No design is feasible in every scenario yet.
        """
        _, best = self._best(job_id, "trajectories")
        request = TrajectoriesRequest.model_validate(best | {"rate": rate, "held": held})
        seconds = request.simulated_seconds(request.resolved_scenarios())
        self._context.limits.check(seconds, field="scenarios")
        return zipped(trajectory_files(request.setpoints()))

    def _best(self, job_id: str, has: str) -> tuple[JobSpec, dict[str, Any]]:
        """Spec of a job that tunes a drive, and fields of a `ScenariosRequest` of its best."""
        spec = tuning_spec(job_id, self._service.job(job_id).spec, has)
        return spec, {
            "robot": spec.robot,
            "controller": spec.controller,
            "design": design_numbers(spec.controller, self.best(job_id).design),
            "scenarios": spec.resolved_scenarios(),
        }

    @analysis("POST /simulations", "simulate", "Simulate one design")
    def simulate(self, design: SimulationRequest) -> SimulationView:
        """Simulate one design in the given scenarios and return objectives, utilities and fitness.

        Nothing is stored. The simulated time is limited, as the response waits for the simulations;
        use a job to search.
        """
        seconds = design.simulated_seconds(design.resolved_scenarios())
        self._context.limits.check(seconds, logged=design.log, field="scenarios")
        return run_simulation(design)

    @analysis("POST /robustness", "estimate_robustness", "Estimate the robustness of one design")
    def robustness(self, design: RobustnessRequest) -> RobustnessView:
        """Estimate how robust a design is, as `gaitswarm.robustness`.

        The design and others around it are simulated, to estimate the norm of the Jacobian of the
        objectives with respect to the variables, both normalized (thesis 4.4.3). Nothing is stored.
        The simulated time is limited.

        Returns:
            The robustness index by scenario, objective and variable.
        """
        seconds = design.simulated_seconds(design.resolved_scenarios())
        self._context.limits.check_sampled(seconds * (1 + design.samples))
        return run_robustness(design)

    @analysis("POST /replays", "replay", "Replay one simulation")
    def replay(self, design: ReplayRequest) -> bytes:
        """Simulate one design in one scenario and return the pose of every link, frame by frame.

        A failed simulation is replayed up to its end, with its status in the header. Nothing is
        stored; the simulated time is limited as for simulations with logs.

        Returns:
            Length of the header in bytes (uint32), the header (JSON, a ReplayHeaderView, padded
            with spaces to a multiple of 4), then frame after frame of float32 numbers in the order
            of the header's channels; all little-endian.
        """
        seconds = design.simulated_seconds([find_scenario(design.scenario)])
        self._context.limits.check(seconds, logged=True, field="scenario")
        return run_replay(design)

    @analysis(
        "POST /controllers/{controller}/surface",
        "controller_surface",
        "Get a fuzzy controller's surface",
    )
    def surface(self, controller: str, design: SurfaceRequest) -> SurfaceView:
        """Compute a fuzzy controller's output over angle error and motor current.

        Sets and rules are those of the thesis; the microcontroller uses the table instead of
        inference.

        Returns:
            Sets, rules and the surfaces of every output, by the rules and by the lookup table.

        Raises:
            NotFound: No such controller.
        """
        if controller not in CONTROLLERS:
            raise NotFound(CONTROLLERS.unknown(controller))
        return run_surface(controller, design)

    @robots("GET /robots", "list_robots", "List robots")
    def list_robots(self) -> CatalogueView[RobotView]:
        """Return shipped robots. A job names one, defines a variant of one, or has files of its
        own.
        """
        return CatalogueView(items=robot_views())

    @robots("GET /scenarios", "list_scenarios", "List preset scenarios")
    def list_scenarios(self) -> CatalogueView[ScenarioView]:
        """Return the six scenarios of thesis table 4.2; a job names them or defines its own."""
        return CatalogueView(items=scenario_views())

    @robots("GET /preferences", "list_preferences", "List preferences")
    def list_preferences(self) -> CatalogueView[PreferenceView]:
        """Return biases and exponents that weight the objectives (thesis table 4.5, eq. 3.1)."""
        return CatalogueView(items=preference_views())

    @robots("GET /optimizers", "list_optimizers", "List optimizers")
    def list_optimizers(self) -> CatalogueView[OptimizerView]:
        """Return search methods with their settings, by the names that jobs use."""
        return CatalogueView(items=optimizers())

    @robots("GET /controllers", "list_controllers", "List controllers")
    def list_controllers(self) -> CatalogueView[ControllerView]:
        """Return motor controllers with design variables, bounds, units and published designs."""
        return CatalogueView(items=controller_views())

    @robots("GET /cases", "list_cases", "List cases of plug-ins")
    def list_cases(self) -> CatalogueView[CaseView]:
        """Return cases of installed plug-ins, which evaluate designs in place of the simulator."""
        return CatalogueView(items=case_views())

    @robots("POST /robots/drafts", "draft_robot", "Draft a robot from a URDF", heavy=True)
    def draft_robot(self, request: RobotDraftRequest) -> RobotDraftView:
        """Find legs, choose a stance, propose actuators and two scenarios, as `gaitswarm robot
        init`.

        The response's `toml` and `urdf` are the `robot` of jobs, simulations and replays; its `job`
        has the required fields of a job. Motors, gears and battery are guesses to start from.
        Nothing is stored.
        """
        return run_robot_draft(request)

    @robots("POST /robots/checks", "check_robot", "Check a custom robot", heavy=True)
    def check_robot(self, robot: RobotFiles) -> RobotCheckView:
        """Load a robot and let it stand for a second with all joints held, as `gaitswarm robot
        check`.

        Returns masses, reach, loads of the soles, and warnings about implausible bodies. Nothing is
        stored.
        """
        return checked_robot(robot, field="")

    @robots("GET /robots/{digest}/meshes", "list_meshes", "List the meshes of a robot", page=True)
    def list_meshes(self, digest: str) -> CatalogueView[MeshFileView]:
        """Return the meshes that the robot's URDF names, and which of them are available.

        Empty for a robot that is in none of the folders of GAITSWARM_ROBOTS. Simulations need no
        meshes.
        """
        return CatalogueView(items=mesh_views(self._context.robots, digest))

    @robots(
        "GET /robots/{digest}/meshes/{number}", "get_mesh", "Get a mesh", page=True, cached=True
    )
    def get_mesh(self, digest: str, number: int) -> bytes:
        """Return the file of a mesh, with the ETag of its content.

        Only files of at most 32 MiB that the robot's URDF names, in the robot's folder, where
        `gaitswarm robot init` copies them.

        Returns:
            The file, in the format given by the list.
        """
        return mesh_content(self._context.robots, digest, number)

    @robots(
        "POST /measured-walks",
        "record_measured_walk",
        "Make a recording from a measured log",
        heavy=True,
        access="submit",
        status=201,
        location=lambda measured: f"/recordings/{measured.recording.id}",
    )
    def record_measured_walk(self, request: MeasuredWalkRequest) -> MeasuredWalkView:
        """Read a log of the robot's instruments and store a recording of it.

        The walk is simulated to find the lag of the log; the recording has the measured currents of
        the whole cycles that both share. The log itself is not stored. Bodies may be larger than
        elsewhere (GAITSWARM_API_MAX_LOG_BYTES).
        """
        seconds = request.simulated_seconds([find_scenario(request.scenario)])
        self._context.limits.check(seconds, logged=True, field="scenario")
        store = partial(self._service.store.add_recording, actor=self._context.actor)
        return read_measured_walk(request, store)

    @robots(
        "GET /recordings/{recording_id}/summary",
        "get_recording_summary",
        "Get a recording without its numbers",
        page=True,
    )
    def recording_summary(self, recording_id: str) -> RecordingView:
        """Return scenario, duration and mean current, as POST /v1/recordings did.

        Raises:
            Conflict: The recording cannot be read.
        """
        return RecordingView.from_walk(recording_id, self.recording(recording_id))

    @operations("GET /job-facets", "count_jobs", "Count jobs by facet", page=True)
    def count_jobs(self, *, archived: bool | None = None) -> JobFacetsView:
        """Count jobs by state, robot, controller, preference and tag.

        Args:
            archived: True: only archived jobs; false: only others.
        """
        return self._service.store.facets(archived=archived)

    @operations(
        "GET /jobs/{job_id}/activity",
        "get_activity",
        "Get the activity of a job's workers",
        page=True,
    )
    def activity(self, job_id: str, *, level: Level = "INFO") -> ActivityView:
        """Return the last iterations and tasks by worker, the workers' health and the log of a job.

        Held in the memory of the process that runs the job, and bounded; `reason` explains an empty
        answer.

        Args:
            level: Least severe level of messages.
        """
        self._service.job(job_id)
        activities = self._context.activity
        known = None if activities is None else activities.of(job_id)
        return ActivityView.from_activity(job_id, known, level, runs_jobs=activities is not None)

    @operations(
        "GET /jobs/{job_id}/notifications",
        "list_notifications",
        "List notifications of a job's end",
    )
    def notifications(self, job_id: str) -> list[NotificationView]:
        """Return one notification for each time that a job with a `Notify-URL` ended."""
        sent = self._service.store.outbox.about(job_id)
        return [NotificationView.from_notification(notification) for notification in sent]

    @operations("GET /audit", "read_audit", "Read the audit log", access="admin")
    def audit(
        self, *, job_id: JobIdText | None = None, after: After = None, limit: PageLimit = 50
    ) -> PageView[AuditEntryView]:
        """Return changes to jobs and tokens, newest first.

        Requires a token of scope `admin`, where tokens are required.

        Args:
            job_id: Only changes of the job of this id.
            limit: Maximum number of entries.
        """
        page = self._service.store.audit(job_id=job_id, after=after, limit=limit)
        return PageView[AuditEntryView].model_validate(page)
